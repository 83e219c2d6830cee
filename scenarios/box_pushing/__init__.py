"""Box pushing: wheels that learn to bring a box to a goal (Section IX-A)."""
