"""The checker that every scenario passes, the user's own included."""
