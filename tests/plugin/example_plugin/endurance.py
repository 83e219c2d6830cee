"""A study: how many steps the episodes take, and no more."""

from dataclasses import dataclass

import nested_agents as na
from nested_agents import run_trial as measure


@dataclass
class Endurance:
    """The analysis."""

    table: tuple


def analyse(results):
    """One line for every condition."""
    return Endurance(
        tuple(
            na.Summary(
                c, len(measures["steps"]), {"steps": na.bootstrap(measures["steps"].mean(1))}
            )
            for c, measures in results.training.items()
        )
    )


def draw(analysis):
    """No figure."""
    return {}


__all__ = ["analyse", "draw", "measure"]
