"""What a step costs, and how that grows with the number of agents."""
