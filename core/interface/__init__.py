"""Interfaces of scenarios and agents, and the values that they exchange."""
