"""What hierarchies cost: by formula, counted and timed."""
