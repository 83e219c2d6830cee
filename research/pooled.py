"""Hierarchies over all settings of a study: success and decisions, and whether they are equal.

``python -m research.pooled [NAME ...]`` prints them for published results of the study
`hierarchies`, by default those of the file of that name. See `research.studies.edges.effects`.
"""

import argparse
from collections.abc import Sequence

import nested_agents as na
from nested_agents.terminal import print_lines, run_to_status

from . import RESULTS
from .studies.edges import effects, lines_of

REFERENCE = "chain"


def lines(name: str) -> list[str]:
    """Return the comparison of published results, line by line."""
    study = na.load(RESULTS / f"{name}.json")
    return list(lines_of(effects(study.results, study.analysis.cases, REFERENCE), REFERENCE))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the comparison of each name, and return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m research.pooled", description=__doc__)
    parser.add_argument("names", nargs="*", default=["hierarchies"], metavar="NAME")
    names = parser.parse_args(arguments).names
    for name in names:
        print_lines([name, *lines(name)])
    return 0


if __name__ == "__main__":
    raise SystemExit(run_to_status("research.pooled", main))
