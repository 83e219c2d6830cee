"""A study: how many steps the episodes take, and no more."""

import nested_agents as na
from nested_agents import run_trial as measure


def analyse(results):
    """One line for every condition."""
    steps = {c: results.values(c, "steps").mean(axis=1) for c in results.conditions}
    return na.Analysis(
        tuple(na.Summary(c, len(own), {"steps": na.bootstrap(own)}) for c, own in steps.items())
    )


def draw(analysis):
    """No figure."""
    return {}


__all__ = ["analyse", "draw", "measure"]
