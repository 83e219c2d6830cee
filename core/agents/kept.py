"""Agents that begin with what a kept team has learned."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from typing import Any
from zipfile import BadZipFile

import numpy as np

from ..interface.agents import Agents, StateDict, select_prefix
from ..numerics import AnyArray
from ..plugins import sources

OF_A_RUN = ("generator", "explorer", "seen", "given")
"""Saved arrays that belong to a run, not to what a team has learned."""


def begin_with(agents: Agents[Any], file: str, part: int) -> None:
    """Initialize the agents of a part with the weights of a saved team.

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
    learned = _learned(own) & kept.keys()
    if not learned:
        content = ", ".join(sorted(kept)) or "nothing"
        raise ValueError(f"{where}: contains no weights of this learner, but {content}")
    for name in sorted(learned):
        _check_shape(where, name, kept[name], own)
    try:
        agents.load_state_dict({**own, **{name: kept[name] for name in learned}})
    except (KeyError, ValueError) as error:
        raise ValueError(f"{where}: {error}") from None


def _learned(memory: StateDict) -> set[str]:
    return {name for name in memory if name not in OF_A_RUN}


def _check_shape(where: str, name: str, kept: AnyArray, own: Mapping[str, AnyArray]) -> None:
    """Refuse weights of another shape; arrays that grow with experience may have any length."""
    is_weights = name.endswith("theta")
    if is_weights and kept.shape != own[name].shape:
        raise ValueError(
            f"{where}: {name} has shape {kept.shape}, these agents need {own[name].shape}; "
            "with learner.weights = 'role', teams of other sizes can share weights"
        )
