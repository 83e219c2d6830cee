"""Value functions: fuzzy partitions, and rule bases that are linear in their weights."""
