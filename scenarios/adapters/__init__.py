"""Scenarios as environments of Gymnasium and PettingZoo."""
