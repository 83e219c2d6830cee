"""Agents in a hierarchy: their team, its control loop, who the agents are, and what that costs."""
