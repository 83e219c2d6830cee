"""Whose consequent weights are whose: an agent's own, or those of its role."""

import numpy as np

from ..interface.scenario import Scenario, roles_of
from ..numerics.arrays import IntArray


def rows_of(scenario: Scenario, *, shared: bool) -> IntArray:
    """Return the row of weights of every agent ``(n,)``: its own, or that of its role.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> three = SimpleNamespace(agents=("a.left", "a.right", "b.left"), roles=("l", "r", "l"))
    >>> rows_of(three, shared=True).tolist(), rows_of(three, shared=False).tolist()
    ([0, 1, 0], [0, 1, 2])
    """
    owners = roles_of(scenario) if shared else tuple(scenario.agents)
    names = list(dict.fromkeys(owners))
    return np.array([names.index(owner) for owner in owners])


def carried_rows(former: Scenario, scenario: Scenario, *, shared: bool) -> IntArray:
    """Return the row of weights of a scenario's team that each row of another's goes on from.

    Parameters
    ----------
    former, scenario
        The scenario that was learned in, and the one that follows.
    shared
        Whether weights are those of roles; if not, the agents must be the same.

    Returns
    -------
    IntArray
        ``(n_rows,)`` rows of the weights of `former`.

    Raises
    ------
    ValueError
        If state space, actions, or whose weights there are differ; one line.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> one, three = (LineUpSettings(carts=carts).build() for carts in (1, 3))
    >>> carried_rows(one, three, shared=True).tolist()
    [0]
    """
    trained, acting = (
        f"{len(s.agents)} agents over {s.state_space.name!r}" for s in (former, scenario)
    )
    problem = f"a team trained with {trained} cannot act with {acting}"
    if former.state_space != scenario.state_space:
        raise ValueError(f"{problem}: the state spaces differ")
    if former.action_set != scenario.action_set:
        raise ValueError(f"{problem}: the actions differ")
    owners, others = (
        list(dict.fromkeys(roles_of(s) if shared else s.agents)) for s in (former, scenario)
    )
    if set(owners) != set(others):
        raise ValueError(
            f"{problem}: their roles are {', '.join(owners)}, and {', '.join(others)}"
            if shared
            else f"{problem}: learner.weights = 'own'; with 'role', agents of a role share theirs"
        )
    return np.array([owners.index(owner) for owner in others])
