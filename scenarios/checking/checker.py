"""Contract test of scenarios: the properties on which learning and its measurement rely.

A check is a function in `checks` that yields faults, and one line in `CHECKS`. Episodes of random
actions are compared bit for bit, except for measured times (``seconds``). Predictions that should
be exact are compared with the states that follow; the errors of other predictions are reported.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import isnan
from numbers import Integral
from pathlib import Path
from textwrap import fill
from traceback import extract_tb
from typing import NamedTuple

import numpy as np

from ...core.interface.abilities import horizon_of
from ...core.plugins.words import expect, expect_each, show
from . import checks
from .episodes import CheckPlan
from .sensing import VariableSummary, fault_of_rewards, predicted_steps, summarize_variables

CHECKS: dict[str, Callable[[CheckPlan], Iterator[str]]] = {
    "form": checks.check_form,
    "measures": checks.check_measures,
    "values": checks.check_values,
    "equal seeds": checks.check_equal_seeds,
    "different seeds": checks.check_different_seeds,
    "two instances": checks.check_two_instances,
    "predicting": checks.check_predicting_changes_nothing,
    "predictions": checks.check_predictions,
    "sensed and predicted": checks.check_sensed_and_predicted,
    "returned arrays": checks.check_returned_arrays,
    "global random numbers": checks.check_global_random_numbers,
}
"""Checks by name, in order: later ones rely on earlier ones."""

MIN_ERROR = 0.02
"""Errors of predictions below this fraction of the variable's range are not reported."""
MAX_EXCESS = 10
"""Number of ranges beyond its own at which a variable looks as if its unit were wrong."""
MIN_STEPS = 2
"""Minimum number of steps to distinguish equal from different seeds."""


class CheckReport(NamedTuple):
    """Result of a check without faults."""

    passed: tuple[str, ...]
    """Names of the passed checks."""
    skipped: Mapping[str, str]
    """Reasons why something was not checked, by name."""
    variables: tuple[VariableSummary, ...]
    """Observed values of each variable and of the reward."""

    def warnings(self) -> Iterator[str]:
        """Yield warnings about allowed but suspicious behavior."""
        for v in self.variables:
            width = v.max - v.min if isnan(v.low) else v.high - v.low
            if v.error >= max(v.persistence, MIN_ERROR * width) > 0:
                yield f"{v.name} is predicted no better than by persistence"
            if max(v.low - v.min, v.max - v.high) > MAX_EXCESS * width:
                yield f"{v.name} exceeds its range by more than {MAX_EXCESS} times its width"

    def remarks(self) -> Iterator[tuple[str, str]]:
        """Yield kind and text of each line: passed, not checked, warning."""
        yield "passed", ", ".join(self.passed)
        for name, reason in self.skipped.items():
            yield "not checked", f"{name}: {reason}"
        for warning in self.warnings():
            yield "warning", warning

    def __str__(self) -> str:
        """Return the lines as the command ``check`` prints them."""
        lines = (f"{kind}  {text}" for kind, text in self.remarks())
        return "\n".join(fill(line, 80, subsequent_indent=" " * 8) for line in lines)


class ScenarioError(ValueError):
    """A fault of a scenario, in one line."""


def check_scenario(
    factory: Callable[[], object],
    *,
    steps: int = 40,
    seeds: Sequence[int] = (0, 1),
    episodes: Sequence[int] = (0, 1),
) -> CheckReport:
    """Check that a scenario keeps its contract.

    Parameters
    ----------
    factory
        Makes a new instance of the scenario, the same each time.
    steps
        Maximum number of steps of the episodes, about twenty of which are played.
    seeds
        At least two seeds.
    episodes
        Numbers of the episodes.

    Raises
    ------
    ScenarioError
        If the scenario breaks its contract or raises an exception.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> report = check_scenario(LineUpSettings(carts=2).build)
    >>> report.passed == tuple(CHECKS), list(report.skipped)
    (True, ['roles'])
    >>> [(v.name, v.low, v.high) for v in report.variables]
    [('distance', -1.0, 1.0), ('lead', -0.8, 0.8), ('reward', nan, nan)]
    """
    if not callable(factory):
        raise ValueError(f"factory = {show(factory)}, allowed: a function that makes a scenario")
    expect("whole numbers", Integral, steps=steps)
    expect("lists of whole numbers", Sequence, seeds=seeds, episodes=episodes)
    expect_each("whole numbers", Integral, seeds=seeds, episodes=episodes)
    if steps < MIN_STEPS:
        raise ValueError(f"steps = {steps}: must be at least {MIN_STEPS}")
    for name, numbers, minimum in (("seeds", seeds, 2), ("episodes", episodes, 1)):
        if len(numbers) < minimum:
            raise ValueError(f"{name} = {list(numbers)}: must hold at least {minimum}")
    plan = CheckPlan(factory, steps, tuple(seeds), tuple(episodes))
    for name, check in CHECKS.items():
        try:
            fault = next(check(plan), None)
        except (Exception, SystemExit) as error:  # raised by the scenario
            fault = _describe(error)
        if fault is not None:
            raise ScenarioError(f"{name}: {fault}")
    scenario = plan.make()
    actions = plan.actions(scenario, seeds[0])
    played = [
        predicted_steps(scenario, seed, episode, actions, horizon_of(scenario))
        for seed, episode in plan.runs
    ]
    all_steps = np.concatenate(played)
    if fault := fault_of_rewards(all_steps):
        raise ScenarioError(f"predictions: {fault}")
    passed = tuple(name for name in CHECKS if name not in plan.skipped)
    return CheckReport(passed, plan.skipped, summarize_variables(scenario, all_steps))


def _describe(error: BaseException) -> str:
    """Return type, place and message of an exception in one line."""
    frame = extract_tb(error.__traceback__)[-1]
    place = f"{frame.name}, {Path(frame.filename).name}:{frame.lineno}"
    return f"{type(error).__name__} in {place}: {' '.join(str(error).split())}"
