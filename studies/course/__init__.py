"""A course of four labs: their questions, and how answers to them are graded."""
