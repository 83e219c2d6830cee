"""Explanations of trained teams in words and figures."""
