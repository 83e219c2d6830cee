"""Digests of rows of published studies of boxes: ``python -m research.digests > FILE``.

Trials of one seed, cut short, of every published condition in which boxes are pushed. Two files,
made on two machines or with two builds of Box2D, are compared line by line: equal digests are
equal states, rewards and weights to the last bit, as every row depends on all that was before it.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import nested_agents as na
from nested_agents import Session, Spec, SpecError
from nested_agents.study import Trial, trials_of

ROOT = Path(__file__).parents[1]
EPISODES = 2
STEPS = 30


def specs() -> Iterator[Path]:
    """Yield the specs of what is published, and of the catalogue."""
    for folder in ("research/specs", "studies/catalogue"):
        yield from sorted((ROOT / folder).rglob("*.toml"))


def trials(path: Path) -> list[Trial]:
    """Return a trial of each condition in which boxes are pushed; none of what needs an extra."""
    try:
        spec = Spec.load(path)
    except SpecError:
        return []
    first = trials_of(spec)[: len(spec.conditions())]
    return [trial for trial in first if trial.settings.scenario.kind == "box-pushing"]


def digest(trial: Trial) -> str:
    """Return a digest of the rows of a trial that is cut short."""
    cut = replace(trial, episodes=EPISODES, steps=min(trial.steps, STEPS), evaluation=1)
    session = Session(cut)
    session.train(EPISODES)
    result = session.finish()
    rows = [row.flat([measure.name for measure in result.measures]) for row in result.rows]
    return hashlib.sha256(repr(rows).encode()).hexdigest()[:16]


def main() -> None:
    """Print a line for every condition."""
    parser = argparse.ArgumentParser(prog="python -m research.digests", description=__doc__)
    parser.parse_args()
    for path in specs():
        for trial in trials(path):
            try:
                value = digest(trial)
            except ValueError as error:  # an extra is missing
                value = f"not run: {error}"
            print(path.relative_to(ROOT), trial.condition, value, sep="\t", flush=True)
    print(f"nested-agents {na.__version__}", file=sys.stderr)


if __name__ == "__main__":
    main()
