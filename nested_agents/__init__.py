"""Hierarchies of fuzzy reinforcement-learning agents, and how they scale."""

from importlib.metadata import version

__all__ = ["__version__"]

__version__: str = version("nested-agents")
