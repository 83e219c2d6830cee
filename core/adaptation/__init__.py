"""What a team revises beside its values: self-models, constants of predictors, experience."""
