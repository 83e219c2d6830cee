"""Where joint actions lead: predictors of the push."""
