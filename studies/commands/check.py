"""``nested-agents check``: whether the scenarios of a spec keep their promises."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from .options import Changes


def command(
    spec: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="SPEC.toml")],
    steps: int = 40,
    set: Changes = (),
) -> int:
    """Check the scenarios of a spec: equal seeds, equal bits; nothing shared; finite numbers; ...

    Parameters
    ----------
    spec
        Whose conditions to check.
    steps
        Most steps of the episodes that are played for it.
    set
        Lay a value over the spec, as for run.
    """
    from functools import partial

    from ... import scenarios
    from ...scenarios.checker import ScenarioError, check_scenario
    from ..spec import Spec
    from ..spec_errors import SpecError

    faults = 0
    seen: dict[str, str] = {}
    for condition in Spec.load(spec, set).conditions():
        settings = condition.settings.scenario
        if settings.model_dump_json() in seen:
            continue
        seen[settings.model_dump_json()] = condition.label
        # Played are the first episode and those in which failures begin.
        episodes = sorted({0, *(failure.episode for failure in settings.failures)})
        try:
            scenarios.build(settings)
            passed = check_scenario(
                partial(scenarios.build, settings), steps=steps, episodes=episodes
            )
        except ScenarioError as error:
            faults += 1
            print(f"FAULT   {condition.label}: {error}")
        except ValueError as error:
            raise SpecError(str(error)) from None
        else:
            print(f"passed  {condition.label}: {', '.join(passed)}")
    return 1 if faults else 0
