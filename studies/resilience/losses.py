"""Losses of agents or actuators: which can be lost, in which sets, and the settings of a loss."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, islice
from math import comb
from typing import Literal, get_args

import numpy as np

from ...core.agents.joint import joint_blocks
from ...core.hierarchy.hierarchy import Hierarchy
from ...core.interface.scenario import checked_scenario
from ...core.plugins.settings import ScenarioSettings
from ...core.plugins.words import closest
from ..errors import SpecError
from ..spec.conditions import ConditionSettings

Position = Literal["root", "middle", "leaf", "alone"]
"""Place of an agent: without superiors, with both, without subordinates, or with neither."""
POSITIONS: dict[tuple[bool, bool], Position] = {
    (True, False): "root",
    (True, True): "middle",
    (False, True): "leaf",
    (False, False): "alone",
}
"""Position of an agent that is a superior, and that is a subordinate."""
AGENT_FAULTS = ("absent", "left", "lost")
"""Kinds of ``[[topology.failures]]`` by which an agent can be lost in any scenario."""


def positions(hierarchy: Hierarchy) -> tuple[Position, ...]:
    """Return the position of each agent in a hierarchy."""
    superiors = {superior for superior, _ in hierarchy.edges}
    subordinates = {subordinate for _, subordinate in hierarchy.edges}
    return tuple(POSITIONS[i in superiors, i in subordinates] for i in range(len(hierarchy)))


LosableTeam = tuple[Hierarchy, tuple[str, ...], tuple[int, ...]]
"""A hierarchy, the units that can be lost, agents or actuators, and the agent of each unit."""


def losable_team(settings: ConditionSettings, fault: str) -> LosableTeam:
    """Return the team of a condition with the units that a fault can take from it.

    Raises
    ------
    SpecError
        If the scenario has no such fault, or there is only one unit; one line.
    """
    world = checked_scenario(settings.scenario.build())
    _, hierarchy = settings.arrange(world)
    if fault in AGENT_FAULTS:
        units = hierarchy.agents
        agents = tuple(range(len(units)))
    else:
        _actuator_key(settings.scenario, fault)
        units = tuple(world.agents)
        n_actions = len(world.action_set)
        _, blocks = joint_blocks(world.agents, world.groups, n_actions, settings.agents)
        agent_of = {unit: agent for agent, block in enumerate(blocks) for unit in block}
        agents = tuple(agent_of[unit] for unit in range(len(units)))
    if len(units) < 2:
        raise SpecError(f"fault = {fault!r}: there is one agent only; losses need two or more")
    return hierarchy, units, agents


def with_loss(settings: ConditionSettings, fault: str, units: Sequence[str]) -> ConditionSettings:
    """Return the settings of a condition in which units are lost from the first step on.

    Raises
    ------
    SpecError
        If the scenario has no such fault; one line.
    """
    table = settings.model_dump()
    if fault in AGENT_FAULTS:
        loss: dict[str, object] = {"kind": fault, "agents": tuple(units)}
        part = table["topology"]
    else:
        loss = {"kind": fault, _actuator_key(settings.scenario, fault): tuple(units)}
        part = table["scenario"]
    part["failures"] = (*part.get("failures", ()), loss)
    return ConditionSettings.model_validate(table)


def _actuator_key(scenario: ScenarioSettings, fault: str) -> str:
    """Return the key, such as ``wheels``, by which a fault of a scenario names actuators."""
    kinds = actuator_faults(scenario)
    if fault not in kinds:
        raise SpecError(f"fault = {fault!r}: {closest(fault, [*AGENT_FAULTS, *kinds])}")
    return kinds[fault]


def actuator_faults(scenario: ScenarioSettings) -> Mapping[str, str]:
    """Return the kinds of ``[[scenario.failures]]``, each with its key of actuators."""
    field = type(scenario).model_fields.get("failures")
    if field is None:
        return {}
    annotated, *_ = get_args(field.annotation)
    union, *_ = get_args(annotated)
    return {model.model_fields["kind"].default: model.part for model in get_args(union)}


def loss_sets(n_units: int, n_lost: int, max_sets: int) -> list[tuple[int, ...]]:
    """Return sets of lost units: all of them, or distinct random ones if there are too many.

    All single units are returned whatever their number.

    Examples
    --------
    >>> loss_sets(3, 2, max_sets=20)
    [(0, 1), (0, 2), (1, 2)]
    >>> len(set(loss_sets(30, 3, max_sets=20)))
    20
    """
    if n_lost == 1 or comb(n_units, n_lost) <= max_sets:
        return list(combinations(range(n_units), n_lost))
    return sorted(islice(_distinct_sets(n_units, n_lost), max_sets))


def _distinct_sets(n_units: int, n_lost: int) -> Iterator[tuple[int, ...]]:
    rng = np.random.default_rng(n_lost)
    known = set[tuple[int, ...]]()
    while True:
        drawn = tuple(sorted(rng.choice(n_units, n_lost, replace=False).tolist()))
        if drawn not in known:
            known.add(drawn)
            yield drawn


def next_number(n_lost: int) -> int:
    """Return the next number of lost units to try: 1, 2, 3, 4, 6, 9 and so on.

    Examples
    --------
    >>> [next_number(n) for n in (0, 1, 2, 3, 4, 6)]
    [1, 2, 3, 4, 6, 9]
    """
    return n_lost + max(1, n_lost // 2)
