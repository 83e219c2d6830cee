"""Coordination graphs: the joint action of the greatest sum of local values (Guestrin et al. 2002).

Conventions. ``n`` agents, ``A`` actions. A *scope* is a tuple of agents, increasing; its table
``(A,) * len(scope)`` holds what their joint actions are worth, one axis for each agent in order.
What is sought is the joint action ``(n,)`` of the greatest sum over all tables.
"""
