"""Decision settings, exploration, and errors of agents."""
