"""``nested-agents check``: whether scenarios keep their promises, those of a spec or one's own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any

import tyro

from .options import Changes

Case = tuple[str, Callable[[], Any], list[int]]
"""What a scenario is called, a function that makes it, and the episodes to play."""


def command(
    source: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="SPEC.toml|FILE.py:NAME")],
    steps: int = 40,
    set: Changes = (),
) -> int:
    """Check scenarios: equal seeds, equal bits; nothing shared; finite numbers; ...

    Parameters
    ----------
    source
        A spec, whose conditions are checked, or a function or class in a Python file that makes a
        scenario of one's own.
    steps
        Most steps of the episodes that are played for it.
    set
        Lay a value over the spec, as for run.
    """
    from ....scenarios.checking.checker import LEAST_STEPS, ScenarioError, check_scenario
    from ...spec.errors import SpecError

    if steps < LEAST_STEPS:
        raise SpecError(f"--steps {steps}: must be at least {LEAST_STEPS}")
    faults = 0
    for label, factory, episodes in _cases(source, set):
        try:
            passed = check_scenario(factory, steps=steps, episodes=episodes)
        except ScenarioError as error:
            faults += 1
            print(f"FAULT   {label}: {error}")
        except ValueError as error:
            raise SpecError(str(error)) from None
        else:
            print(f"passed  {label}: {', '.join(passed)}")
    return 1 if faults else 0


def _cases(source: str, changes: Changes) -> Iterator[Case]:
    """Yield what is to be checked, each scenario of a spec once."""
    from ....core.sources import active
    from ...spec.errors import SpecError
    from ...spec.spec import Spec

    if ".py:" in source or source.endswith(".py"):
        if changes:
            raise SpecError("set: lays values over a spec, not over a Python file")
        try:
            factory = active().load(source)
        except ValueError as error:
            raise SpecError(" ".join(str(error).split())) from None
        try:
            factory()
        except Exception as error:
            said = " ".join(str(error).split())
            raise SpecError(
                f"{source}, called without arguments, raised {type(error).__name__}: {said}"
            ) from None
        yield source.rpartition(":")[2], factory, [0, 1]
        return
    seen: set[Any] = set()
    for condition in Spec.load(Path(source), changes).conditions():
        settings = condition.settings.scenario
        if settings not in seen:
            seen.add(settings)
            # Played are the first episode and those in which failures begin.
            episodes = sorted({0, *(failure.episode for failure in settings.failures)})
            try:
                settings.build()
            except ValueError as error:
                raise SpecError(str(error)) from None
            yield condition.label, settings.build, episodes
