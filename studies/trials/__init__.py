"""Trials: one condition with one seed, and its measurements."""
