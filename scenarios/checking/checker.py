"""A check that a scenario keeps the promises on which learning and its measurement rest.

Whole episodes of random actions are played and compared to the last bit: states, reward, end of the
episode, twists and measurements of every step. Not compared are the measured times, ``seconds``.
What is said of variables is held against what is met (see `sensing`). Predictions are held against
each other (see `predictions`), and, of scenarios that can be predicted exactly, against what is
then sensed; of others it is shown by how much they are off. A further check is one function in
`promises` and one line in `CHECKS`. What a scenario raises is what is wrong with it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from math import isnan
from numbers import Integral
from pathlib import Path
from textwrap import fill
from traceback import extract_tb
from typing import NamedTuple

import numpy as np

from ...core.plugins.words import expect, expect_each, show
from .frames import Examination
from .promises import (
    check_form,
    check_global_numbers,
    check_looking,
    check_measures,
    check_predictions,
    check_repetition,
    check_returned_arrays,
    check_sensing,
    check_two_instances,
    check_values,
    check_variety,
)
from .sensing import MetVariable, met_variables, predicted_steps

CHECKS: dict[str, Callable[[Examination], Iterator[str]]] = {
    "form": check_form,
    "measures": check_measures,
    "values": check_values,
    "equal seeds": check_repetition,
    "different seeds": check_variety,
    "two instances": check_two_instances,
    "predicting": check_looking,
    "predictions": check_predictions,
    "sensed and predicted": check_sensing,
    "returned arrays": check_returned_arrays,
    "global random numbers": check_global_numbers,
}
"""The checks by name, in their order: later ones rely on earlier ones."""

SMALL = 0.02
"""Error of prediction, in ranges of the variable, of which no word is lost."""
FAR = 10
"""Ranges beyond its own at which a variable looks as if it were in another unit."""
LEAST_STEPS = 2
"""Steps of the shortest episodes by which equal and different seeds can be distinguished."""


class Findings(NamedTuple):
    """What came of a check that found no fault."""

    passed: tuple[str, ...]
    """Names of the checks that were passed."""
    unchecked: Mapping[str, str]
    """Why something was not checked, by its name."""
    variables: tuple[MetVariable, ...]
    """What was met of every variable and of the reward."""

    def warnings(self) -> Iterator[str]:
        """Yield what is allowed and looks wrong, a line each."""
        for v in self.variables:
            width = v.greatest - v.least if isnan(v.low) else v.high - v.low
            if v.error >= max(v.persistence, SMALL * width) > 0:
                yield f"{v.name} is predicted no better than if it stayed as it is"
            if max(v.low - v.least, v.greatest - v.high) > FAR * width:
                yield f"{v.name} goes more than {FAR} times its range beyond it"

    def remarks(self) -> Iterator[tuple[str, str]]:
        """Yield what came of it in words, each after its kind: passed, not checked, warning."""
        yield "passed", ", ".join(self.passed)
        for name, reason in self.unchecked.items():
            yield "not checked", f"{name}: {reason}"
        for warning in self.warnings():
            yield "warning", warning

    def __str__(self) -> str:
        """Return them as the command ``check`` prints them."""
        lines = (f"{kind}  {text}" for kind, text in self.remarks())
        return "\n".join(fill(line, 80, subsequent_indent=" " * 8) for line in lines)


class ScenarioError(ValueError):
    """What is wrong with a scenario: one line."""


def check_scenario(
    factory: Callable[[], object],
    *,
    steps: int = 40,
    seeds: Sequence[int] = (0, 1),
    episodes: Sequence[int] = (0, 1),
) -> Findings:
    """Check a scenario and return what it passed, what could not be checked, and what was met.

    Parameters
    ----------
    factory
        Makes a new instance of the scenario, the same each time.
    steps
        Most steps of the episodes played, about twenty of them.
    seeds
        Seeds of worlds, at least two.
    episodes
        Numbers of the episodes played.

    Raises
    ------
    ScenarioError
        If it breaks a promise, or raises; the message is one line.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> findings = check_scenario(LineUpSettings(carts=2).build)
    >>> findings.passed == tuple(CHECKS), list(findings.unchecked)
    (True, ['roles'])
    >>> [(v.name, v.low, v.high) for v in findings.variables]
    [('distance', -1.0, 1.0), ('lead', -0.8, 0.8), ('reward', nan, nan)]
    """
    if not callable(factory):
        raise ValueError(f"factory = {show(factory)}, allowed: what makes a scenario")
    expect("whole numbers", Integral, steps=steps)
    expect("lists of whole numbers", Sequence, seeds=seeds, episodes=episodes)
    expect_each("whole numbers", Integral, seeds=seeds, episodes=episodes)
    if steps < LEAST_STEPS:
        raise ValueError(f"steps = {steps}: must be at least {LEAST_STEPS}")
    for name, numbers, least in (("seeds", seeds, 2), ("episodes", episodes, 1)):
        if len(numbers) < least:
            raise ValueError(f"{name} = {list(numbers)}: must hold at least {least}")
    examination = Examination(factory, steps, tuple(seeds), tuple(episodes))
    for name, check in CHECKS.items():
        try:
            fault = next(check(examination), None)
        except (Exception, SystemExit) as error:
            fault = _raised(error)
        if fault is not None:
            raise ScenarioError(f"{name}: {fault}")
    scenario = examination.factory()
    unchecked = examination.unchecked
    actions = examination.actions(scenario, seeds[0])
    played = [
        predicted_steps(scenario, seed, episode, actions, scenario.horizon)
        for seed, episode in product(seeds, episodes)
    ]
    passed = tuple(name for name in CHECKS if name not in unchecked)
    return Findings(passed, unchecked, met_variables(scenario, np.concatenate(played)))


def _raised(error: BaseException) -> str:
    """Return in one line what was raised, and where."""
    where = extract_tb(error.__traceback__)[-1]
    place = f"{where.name}, {Path(where.filename).name}:{where.lineno}"
    return f"{type(error).__name__} in {place}: {' '.join(str(error).split())}"
