"""Fuzzy rule bases: partitions, rules, their reference implementation and compiled kernels."""
