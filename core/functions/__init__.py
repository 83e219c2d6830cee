"""Agents that decide by a user-defined function."""
