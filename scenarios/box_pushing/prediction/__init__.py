"""Predictors of the push."""
