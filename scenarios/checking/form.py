"""Whether a scenario has what it must have, in the right shapes, and measures what it declares."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.interface.scenario import RecordedScenario, Scenario, groups_of, roles_of
from .examination import Examination
from .frames import FIELDS, at, bits, measured, opening

MEMBERS = ("agents", "state_space", "action_set", "reset", "step", "predict")
"""Of the protocol `Scenario`."""
STEPS = 5
"""Steps after which measurements are looked at."""


def fault_of_form(of: Examination) -> str | None:
    """Check names, groups, shapes and types."""
    scenario: Any = of.factory()
    if not isinstance(scenario, Scenario):
        missing = [name for name in MEMBERS if not hasattr(scenario, name)]
        return f"{type(scenario).__name__} lacks {', '.join(missing)}"
    n, d = len(scenario.agents), scenario.state_space.n_variables
    if not n or len(set(scenario.agents)) != n:
        return f"agents {scenario.agents} must be at least one, of different names"
    groups, roles = groups_of(scenario), roles_of(scenario)
    if [i for group in groups for i in group] != list(range(n)):
        return f"groups {groups} must hold the {n} agents once each, in order"
    if len(roles) != n:
        return f"roles {roles} must be one for each of the {n} agents"
    opening(scenario, of.seeds[0], of.episodes[0])
    transition = scenario.step(of.actions(scenario, of.seeds[0])[0])
    missing = [field for field in FIELDS if not hasattr(transition, field)]
    if missing:
        return f"step returns {type(transition).__name__}, must be Transition: no {missing[0]}"
    for step, frame in enumerate(of.play(scenario, of.seeds[0], of.episodes[0])):
        for name, shapes in (("states", [(n, d)]), ("reward", [(), (n,)]))[: step + 1]:
            value = np.asarray(frame[name])
            if value.shape not in shapes or value.dtype.kind not in "biuf":
                allowed = " or ".join(map(str, shapes))
                return f"{name} of shape {value.shape} {at(step)}, must be numbers of {allowed}"
        if step and not all(isinstance(frame[e], bool) for e in ("terminated", "truncated")):
            return f"terminated and truncated must be bool, {at(step)} they are not"
        twists = frame.get("twists")
        shape = (len(groups), 3) if twists is None else np.shape(twists)
        if shape[1:] != (3,) or shape[0] < len(groups):
            return f"twists of shape {shape} {at(step)}, must be (bodies >= {len(groups)}, 3)"
    return None


def fault_of_measures(of: Examination) -> str | None:
    """Check that what a scenario declares to be measured and recorded is there."""
    scenario: Any = of.factory()
    measures = tuple(getattr(scenario, "measures", ()))
    names = [measure.name for measure in measures]
    if len(set(names)) != len(names):
        return f"names {names} must be distinct"
    opening(scenario, of.seeds[0], of.episodes[0])
    kept = scenario.recorded if isinstance(scenario, RecordedScenario) else ()
    for step, action in enumerate(of.actions(scenario, of.seeds[0])[:STEPS], 1):
        transition = scenario.step(action)
        info, told = transition.info, measured(scenario)
        for measure in measures:
            source = measure.source
            if source != "terminated" and source not in info:
                return f"{measure.name}: info has no {source!r} {at(step)}, has {', '.join(info)}"
            if source != "terminated" and np.ndim(info[source]):
                return f"{measure.name}: info[{source!r}] must be one number"
        for name in kept:
            if name not in info or name not in told:
                return (
                    f"recorded is {name!r}, which {'measure' if name in info else 'info'} has not"
                )
            if bits(info[name]) != bits(told[name]):
                return f"recorded is {name!r}, of which info and measure differ {at(step)}"
        if transition.terminated or transition.truncated:
            break
    return None
