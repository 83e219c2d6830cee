"""Resilience of trained teams: what the loss of one, two or more agents costs."""
