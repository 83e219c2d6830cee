"""Proximal policy optimization (PPO) of agents in a hierarchy, in NumPy."""
