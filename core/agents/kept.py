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
    """Let the agents of a part begin with the weights of a kept team.

    Random numbers, exploration and how often actions were seen are their own. Other learners of the
    same weights may go on, as ``frozen`` with those of ``batch-td``.

    Parameters
    ----------
    agents
        They are modified.
    file
        That of a kept team, as specs name files.
    part
        Which part of the team they are.

    Raises
    ------
    ValueError
        If it holds nothing that these agents learn, or of other agents; one line.
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
        raise ValueError(f"{where}: holds {', '.join(sorted(kept)) or 'nothing'}, and no weights")
    for name in sorted(learned):
        _check_shape(where, name, kept[name], own)
    try:
        agents.load_state_dict({**own, **{name: kept[name] for name in learned}})
    except (KeyError, ValueError) as error:
        raise ValueError(f"{where}: {error}") from None


def _learned(memory: StateDict) -> set[str]:
    return {name for name in memory if name not in OF_A_RUN}


def _check_shape(where: str, name: str, kept: AnyArray, own: Mapping[str, AnyArray]) -> None:
    """Refuse weights of other agents; what grows with experience may be of any length."""
    is_weights = name.endswith("theta")
    if is_weights and kept.shape != own[name].shape:
        raise ValueError(
            f"{where}: its {name} has shape {kept.shape}, that of these agents {own[name].shape}; "
            "weights of roles (learner.weights = 'role') fit teams of other sizes"
        )
