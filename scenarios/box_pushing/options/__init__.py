"""Box pushing by one agent per robot, whose actions are ways to pushing points."""
