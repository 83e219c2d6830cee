"""What a scenario and those who act in it promise each other."""
