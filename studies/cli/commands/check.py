"""``nested-agents check``: whether scenarios keep their promises, those of a spec or one's own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .. import options

if TYPE_CHECKING:
    from pandas import DataFrame

SHORT = "{:.2g}".format
"""How numbers are printed."""
LESSONS = 8
"""Episodes from which a predictor has learned when its errors are shown."""
Case = tuple[str, Callable[[], Any], list[int]]
"""What a scenario is called, a function that makes it, and the episodes to play."""


@click.command()
@click.argument("source", metavar="SPEC.toml|FILE.py:NAME")
@options.number("--steps", "N", 40, "Most steps of the episodes that are played for it.")
@options.changes
def command(source: str, steps: int, changes: tuple[str, ...]) -> int:
    """Check what every scenario must promise, such as equal bits for equal seeds.

    A table shows the values met of every variable beside its range, and the root mean square error
    of its prediction beside that of persistence, as if all stayed as it is. Where agents learn to
    predict, a second table shows the errors of that after a few episodes.

    SPEC.toml is a spec, whose conditions are checked; FILE.py:NAME a function or class in a Python
    file that makes a scenario of one's own.
    """
    from pandas import DataFrame

    from ....scenarios.checking.checker import ScenarioError, check_scenario
    from ...errors import SpecError
    from ..display import print_wrapped

    faults = 0
    for label, factory, episodes in _cases(source, changes):
        try:
            findings = check_scenario(factory, steps=steps, episodes=episodes)
        except ScenarioError as error:
            faults += 1
            print(f"FAULT   {label}: {error}")
        except ValueError as error:
            raise SpecError(str(error)) from None
        else:
            print_wrapped(f"{label}: {', '.join(findings.passed)}", "passed  ", 8)
            for name, reason in findings.unchecked.items():
                print_wrapped(f"{name}: {reason}", "not checked  ", 8)
            for warning in findings.warnings():
                print_wrapped(warning, "warning  ", 8)
            frame = DataFrame(findings.variables).rename(columns={"persistence": "as it is"})
            print("", frame.to_string(index=False, na_rep="", float_format=SHORT), "", sep="\n")
    if not faults and not source.partition(":")[0].endswith(".py"):
        for label, errors in _learned_errors(source, changes, steps):
            print_wrapped(f"{label}: what {LESSONS} episodes teach to predict", "learned  ", 8)
            print("", errors.to_string(float_format=SHORT), "", sep="\n")
    return 1 if faults else 0


def _learned_errors(
    source: str, changes: tuple[str, ...], steps: int
) -> Iterator[tuple[str, DataFrame]]:
    """Yield the errors of learned predictors by variable, see `errors_of`, each once."""
    from ....core.adaptation.predictors import LearnedPredictorSettings
    from ....core.agents.team import of_fuzzy_agents
    from ...explain.team import errors_of
    from ...spec.spec import Spec
    from ...trials.session import Session
    from ...trials.trial import trials_of

    seen: set[Any] = set()
    for trial in trials_of(Spec.load(Path(source), changes)):
        predictor = getattr(trial.settings.learner, "predictor", None)
        what = trial.settings.scenario, predictor
        if what in seen or not isinstance(predictor, LearnedPredictorSettings):
            continue
        seen.add(what)
        session = Session(replace(trial, episodes=LESSONS, steps=steps, curriculum=()))
        session.train(LESSONS)
        errors = errors_of(of_fuzzy_agents(session.team), session.scenario, trial.seed)
        if errors is not None:
            yield trial.condition, errors


def _cases(source: str, changes: tuple[str, ...]) -> Iterator[Case]:
    """Yield what is to be checked, each scenario of a spec once."""
    from ....core.learners import check_prediction
    from ....core.plugins.sources import active
    from ...errors import SpecError, refused
    from ...spec.spec import Spec

    if ".py:" in source or source.endswith(".py"):
        if changes:
            raise SpecError("--set: lays values over a spec, not over a Python file")
        with refused():
            factory = active().load(source)
        try:
            factory()
        except (Exception, SystemExit) as error:
            message = f"raised {type(error).__name__}: {' '.join(str(error).split())}"
            raise SpecError(f"{source}, called as a scenario is, {message}") from None
        yield source.rpartition(":")[2], factory, [0, 1]
        return
    seen: set[Any] = set()
    for condition in Spec.load(Path(source), changes).conditions():
        settings = condition.settings.scenario
        with refused():
            check_prediction(condition.settings.learner, settings.build())
        if settings not in seen:
            seen.add(settings)
            # Played are the first episode and those in which failures begin.
            failures = getattr(settings, "failures", ())
            episodes = sorted({0, *(failure.episode for failure in failures)})
            yield condition.label, settings.build, episodes
