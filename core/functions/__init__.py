"""Agents that are functions of a user's: scripts, rules, whatever can be called and answers."""
