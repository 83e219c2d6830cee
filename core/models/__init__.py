"""Models that a team learns: predictors, self-models and calibrated constants."""
