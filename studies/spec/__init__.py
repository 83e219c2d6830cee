"""Specs: what a study compares, and for how long."""
