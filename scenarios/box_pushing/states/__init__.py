"""State variables and state spaces of wheel agents."""
