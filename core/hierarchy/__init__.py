"""Hierarchies of agents, their messages, and failures of these messages."""
