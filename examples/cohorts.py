"""
Your own topology
=================

A topology is a function from the names of the agents, and the same names by robot, to pairs
(superior, subordinate). Here every wheel of a robot is above every wheel of the next robot. The
wheels of one robot are not connected.
"""

# sphinx_gallery_thumbnail_path = "figures/topology-cohorts.svg"
from itertools import pairwise, product


def cohorts(agents, bodies):
    """Put every wheel of a robot above every wheel of the next one."""
    pairs = []
    for robot, following in pairwise(bodies):
        pairs.extend(product(robot, following))
    return pairs
