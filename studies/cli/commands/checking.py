"""Command ``check``: contract test of scenarios."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...errors import SpecError, refused
from .. import options
from ..display import print_text, print_wrapped

if TYPE_CHECKING:
    from ....core.plugins.settings import ScenarioSettings

SHORT = "{:.2g}".format
"""Format of the numbers in tables: two significant digits."""


ScenarioCase = tuple[str, Callable[[], object], list[int]]
"""Label of a scenario, a function that builds a new instance, and the episodes that are played: the
first, and those in which failures begin."""


@click.command()
@click.argument("source", metavar="SPEC.toml|FILE.py:NAME")
@options.number("--steps", "N", 40, "Maximum number of steps of each episode.")
@options.trust
@options.changes
def check(source: str, steps: int, trust: bool, changes: tuple[str, ...]) -> int:
    """Check the contract of scenarios, such as equal results for equal seeds.

    A table shows the range and the observed values of every variable, and the root mean square
    errors of its prediction and of persistence.

    With SPEC.toml, the scenario of each condition is checked. With FILE.py:NAME, the scenario that
    this function or class of a Python file builds is checked. A class with a nested class Settings
    gets the default settings.
    """
    from pandas import DataFrame

    from ....scenarios.checking.checker import ScenarioError, check_scenario
    from ...spec.spec import Spec
    from ...trials.arrangement import check_conditions
    from ..loading import trust_beside

    is_spec = not source.partition(":")[0].endswith(".py")
    if not is_spec and changes:
        raise SpecError("--set: changes a spec, and a Python file is none; allowed with SPEC.toml")
    if is_spec and trust:
        trust_beside(Path(source))
    cases = _cases_of_spec(source, changes) if is_spec else [_case_of_file(source)]
    faults = 0
    for label, build, episodes in cases:
        try:
            report = check_scenario(build, steps=steps, episodes=episodes)
        except ScenarioError as error:
            faults += 1
            print_text(f"FAULT   {label}: {error}")
        except ValueError as error:
            raise SpecError(str(error)) from None
        else:
            for kind, text in report.remarks():
                head = f"{label}: " if kind == "passed" else ""
                print_wrapped(f"{head}{text}", f"{kind}  ", 8)
            frame = DataFrame(report.variables)
            print_text("", frame.to_string(index=False, na_rep="", float_format=SHORT), "")
    if is_spec and not faults:
        check_conditions(Spec.load(Path(source), changes))
    return 1 if faults else 0


def _case_of_file(source: str) -> ScenarioCase:
    """Return the scenario that a function or class in a Python file builds."""
    with refused():
        build = _factory_of(source)
    try:
        build()
    except (Exception, SystemExit) as error:
        message = f"raised {type(error).__name__}: {' '.join(str(error).split())}"
        raise SpecError(f"{source}, called as a scenario is, {message}") from None
    return source.rpartition(":")[2], build, [0, 1]


def _factory_of(source: str) -> Callable[[], object]:
    """Return a function that builds the scenario of a Python file with its default settings."""
    from ....core.plugins.sources import active
    from ....scenarios import SCENARIOS

    thing: Callable[[], object] = active().load(source)
    if not hasattr(thing, "Settings"):
        return thing
    try:
        build: Callable[[], object] = SCENARIOS.parsed(source).build
    except ValueError as error:
        raise ValueError(f"{source}: its Settings have no defaults for all keys, {error}") from None
    return build


def _cases_of_spec(source: str, changes: tuple[str, ...]) -> Iterator[ScenarioCase]:
    """Yield the distinct scenarios of the conditions of a spec."""
    from ....core.interface.scenario import checked_scenario
    from ....core.learners import check_prediction
    from ...spec.spec import Spec

    checked: list[ScenarioSettings] = []
    for condition in Spec.load(Path(source), changes).conditions():
        settings = condition.settings.scenario
        with refused():
            check_prediction(condition.settings.learner, checked_scenario(settings.build()))
        if settings not in checked:
            checked.append(settings)
            episodes = sorted({0, *(begin for begin, _ in settings.failure_spans)})
            yield condition.label, settings.build, episodes
