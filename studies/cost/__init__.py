"""Cost of hierarchies: formulas of Section VII, counts and times of the running system."""
