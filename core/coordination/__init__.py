"""Coordination graphs: the joint action of the greatest sum of local values (Guestrin et al. 2002).

Conventions. ``n`` agents, ``A`` actions. A *scope* is a tuple of agents, increasing; its table
``(A,) * len(scope)`` holds the values of their joint actions, one axis per agent in order. The
maximizers return the joint action ``(n,)`` with the greatest sum over all tables.
"""
