"""Agents that decide by a function of a user."""
