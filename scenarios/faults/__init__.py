"""Failures of actuators: what is wrong with them, and from when to when, in whatever scenario."""
