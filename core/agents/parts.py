"""Parts of a team, which can start from the weights of a saved team."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from typing import TYPE_CHECKING
from zipfile import BadZipFile

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..interface.agents import (
    AgentContext,
    AnyAgents,
    Counts,
    ReportsResources,
    StateDict,
    add_prefix,
    select_prefix,
)
from ..interface.scenario import Scenario
from ..numerics import AnyArray
from ..plugins import sources
from .fuzzy import FuzzyAgents

if TYPE_CHECKING:
    from ..learners.learner import TeamSettings

OF_A_RUN = ("generator", "explorer", "seen", "given", "learner.trace", "learner.previous")
"""Saved arrays that belong to a run and are no learned weights."""
OWNERS = "owners"
"""Array of a team's file: the owner of each member's weights, an agent or a role."""


def build_parts(
    settings: TeamSettings,
    scenario: Scenario,
    hierarchy: Hierarchy,
    seed: np.random.SeedSequence,
    *,
    messages_fail: bool,
) -> tuple[tuple[AnyAgents, ...], list[int]]:
    """Return the parts of a team, and the index of the part of every agent.

    Raises
    ------
    ValueError
        If the settings do not fit the scenario; one line.
    """
    kinds = settings.members(scenario, hierarchy)
    seeds = [seed] if len(kinds) == 1 else seed.spawn(len(kinds))
    parts: list[AnyAgents] = []
    part_of = [0] * len(hierarchy)
    for (members, own, kept), own_seed in zip(kinds, seeds, strict=True):
        for agent in members.tolist():
            part_of[agent] = len(parts)
        context = AgentContext(scenario, hierarchy, members, own_seed, messages_fail)
        parts.append(own.agents(context))
        if kept is not None:
            begin_with(parts[-1], kept, len(parts) - 1)
    return tuple(parts), part_of


def counts_of(parts: Sequence[AnyAgents]) -> Counts:
    """Return the number of evaluations of the parts that count them."""
    total = Counts()
    for part in parts:
        if isinstance(part, ReportsResources):
            total.add(part.counts)
    return total


def weight_bytes_of(parts: Sequence[AnyAgents]) -> int:
    """Return the memory of the learned weights of all parts [bytes]."""
    return sum(
        part.weight_bytes
        if isinstance(part, ReportsResources)
        else sum(array.nbytes for array in part.state_dict().values())
        for part in parts
    )


def state_of(parts: Sequence[AnyAgents]) -> StateDict:
    """Return the saved state of all parts as named arrays."""
    return _joined([part.state_dict() for part in parts])


def owners_in(parts: Sequence[AnyAgents]) -> StateDict:
    """Return the owners of all parts' weights as named arrays, for `begin_with`."""
    owners = [{OWNERS: np.array(p.owners)} if isinstance(p, FuzzyAgents) else {} for p in parts]
    return _joined(owners)


def _joined(states: Sequence[StateDict]) -> StateDict:
    """Return the arrays of all parts; those of several parts are named after them."""
    if len(states) == 1:
        return states[0]
    return {
        name: array
        for k, state in enumerate(states)
        for name, array in add_prefix(f"part{k}.", state).items()
    }


def load_state(parts: Sequence[AnyAgents], state: Mapping[str, AnyArray]) -> None:
    """Continue all parts from what `state_of` returned.

    Raises
    ------
    ValueError
        If it is the state of other agents.
    """
    for k, part in enumerate(parts):
        own = state if len(parts) == 1 else select_prefix(f"part{k}.", state)
        part.load_state_dict(own)


def begin_with(agents: AnyAgents, file: str, part: int) -> None:
    """Initialize the agents of a part with the weights of a saved team, by agent or role.

    Random numbers, exploration and counts of actions stay those of the agents. The learner may
    differ if the weights fit: ``frozen`` can use those of ``batch-td``.

    Parameters
    ----------
    agents
        Agents, modified.
    file
        Name of the team's file, as in a spec.
    part
        Index of the part.

    Raises
    ------
    ValueError
        If the file has no weights that fit these agents; one line.
    """
    where = f"learner.parts[{part}].team = {file!r}"
    try:
        with np.load(BytesIO(sources.active().content(file)), allow_pickle=False) as arrays:
            kept = dict(arrays)
    except (OSError, ValueError, BadZipFile) as error:
        raise ValueError(f"{where}: {error}") from None
    kept = select_prefix(f"part{part}.", kept) or kept
    own = agents.state_dict()
    learned = {name: kept[name] for name in own if name in kept and name not in OF_A_RUN}
    if not learned:
        content = ", ".join(sorted(kept)) or "nothing"
        raise ValueError(f"{where}: contains no weights of this learner, but {content}")
    for name, array in learned.items():  # other arrays grow with experience
        if name.endswith("theta") and array.shape != own[name].shape:
            raise ValueError(
                f"{where}: {name} has shape {array.shape}, these agents need {own[name].shape}; "
                "with learner.weights = 'role', teams of other sizes can share weights"
            )
    if isinstance(agents, FuzzyAgents) and OWNERS not in kept and len(agents.learner.theta) > 1:
        raise ValueError(
            f"{where}: does not say to which agents or roles its weights belong; save the team "
            "again with this version"
        )
    try:
        agents.load_state_dict(own | learned)
        if isinstance(agents, FuzzyAgents) and OWNERS in kept:
            agents.assign_rows(kept[OWNERS].tolist())
    except (KeyError, ValueError) as error:
        raise ValueError(f"{where}: {error}") from None
