"""Scalability of hierarchies: speed-up, laws, crossovers, Pareto fronts and budgets."""
