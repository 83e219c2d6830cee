"""Exact probabilities that Bayesian agents with private signals are right.

Two states are equally probable; signals are right with probability q > 1/2, independently. An agent
that is told nothing names its signal, and of n such agents most are right with the probability of
`majority` (Condorcet 1785). An agent that is told what others have named weighs that as they would
have been led to it. In a chain that is told, sooner or later two more have named the one state than
the other: from then on every agent names it, whatever its own signal is. That is an informational
cascade, and nobody learns anything from those who are in it (Banerjee 1992; Bikhchandani,
Hirshleifer and Welch 1992).

An agent for whom both states are equally probable names its own signal, or tosses a coin, as in the
paper of Bikhchandani and others. For itself it makes no difference; for those below it does.

Log odds are those of state b against a.

References
----------
Banerjee, A. V. (1992). A simple model of herd behavior. Quarterly Journal of Economics 107.
Bikhchandani, S., Hirshleifer, D., Welch, I. (1992). A theory of fads, fashion, custom, and cultural
change as informational cascades. Journal of Political Economy 100.
Condorcet, N. de (1785). Essai sur l'application de l'analyse a la probabilite des decisions.
"""

from __future__ import annotations

from math import log
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

import nested_agents as na

FloatArray = NDArray[np.float64]

Indifferent = Literal["signal", "coin"]
"""Decision of an agent for which both states are equally probable."""
EQUAL = 1e-9
"""Difference of log odds that counts as rounding error."""
MAX_ENUMERATED = 16
"""Maximum number of agents whose signals are enumerated."""


def majority(agents: int, accuracy: float) -> float:
    """Return with what probability most signals are right (Condorcet 1785), a coin deciding ties.

    Examples
    --------
    >>> round(majority(3, 0.7), 3), round(majority(2, 0.7), 3)
    (0.784, 0.7)
    """
    right = stats.binom(agents, accuracy)
    tied = right.pmf(agents // 2) if agents % 2 == 0 else 0.0
    return float(right.sf(agents // 2) + 0.5 * tied)


def naming(public: FloatArray, accuracy: float, indifferent: Indifferent) -> FloatArray:
    """Return with what probability ``(..., 2)`` an agent names b whose signal is a, or b.

    Parameters
    ----------
    public
        ``(...)`` log odds by all that it has been told.
    accuracy
        Of its signal.
    indifferent
        What it does if both states are equally probable.

    Examples
    --------
    >>> one = log(0.7 / 0.3)
    >>> naming(np.array([0.0, one, 2 * one]), 0.7, "coin").tolist()
    [[0.0, 1.0], [0.5, 1.0], [1.0, 1.0]]
    """
    one = log(accuracy / (1.0 - accuracy)) if accuracy < 1.0 else np.inf
    odds = np.asarray(public)[..., None] + one * np.array([-1.0, 1.0])
    tied = np.array([0.0, 1.0]) if indifferent == "signal" else 0.5
    return np.where(np.abs(odds) <= EQUAL, tied, odds > 0.0)


def evidence(public: FloatArray, accuracy: float, indifferent: Indifferent) -> FloatArray:
    """Return the log odds ``(..., 2)`` that follow from an agent naming a, or b.

    An agent that names the same state for either signal gives no evidence. The arguments are those
    of `naming`.

    Examples
    --------
    >>> one = log(0.7 / 0.3)
    >>> (evidence(np.array([0.0, 2 * one]), 0.7, "signal") / one).round(6).tolist()
    [[-1.0, 1.0], [0.0, 0.0]]
    """
    by_signal = naming(public, accuracy, indifferent)
    likely = by_signal @ np.array([[accuracy, 1.0 - accuracy], [1.0 - accuracy, accuracy]])
    named = np.stack([1.0 - likely, likely], axis=-2)  # (..., named, state)
    known = np.where(named > 0.0, named, 1.0)
    return np.where((named > 0.0).all(axis=-1), np.log(known[..., 1] / known[..., 0]), 0.0)


class Expected(NamedTuple):
    """Probabilities that agents, and their vote, are right."""

    right: FloatArray
    """Probability that each agent is right ``(n,)``."""
    vote: float
    """Probability that the vote is right; a coin decides ties."""


def cascade(agents: int, accuracy: float, indifferent: Indifferent = "signal") -> Expected:
    """Return how often the Bayesian agents of a chain are right, if each hears all agents above it.

    What was named before matters by its log odds alone, of which there are five values at most. How
    often the vote is right follows from how many have been right, value by value.

    Parameters
    ----------
    agents
        Length of the chain, n.
    accuracy
        Of their signals, below 1.
    indifferent
        What an agent does if both states are equally probable.

    Examples
    --------
    >>> cascade(3, 0.7, "signal").right.round(3).tolist()
    [0.7, 0.7, 0.784]
    >>> cascade(3, 0.7, "coin").right.round(4).tolist()
    [0.7, 0.7, 0.742]
    """
    right = np.empty(agents)
    start: FloatArray = np.zeros(agents + 1)  # by how many have named b, which is the state
    start[0] = 1.0
    by_odds = {0.0: start}
    for place in range(agents):
        following: dict[float, FloatArray] = {}
        right[place] = 0.0
        for odds, counts in by_odds.items():
            public = np.array(odds)
            for_a, for_b = naming(public, accuracy, indifferent)
            b = float((1.0 - accuracy) * for_a + accuracy * for_b)
            right[place] += b * counts.sum()
            learned = evidence(public, accuracy, indifferent)
            for named, chance in enumerate((1.0 - b, b)):
                if chance > 0.0:
                    key = round(odds + float(learned[named]), 9)
                    rest = following.setdefault(key, np.zeros(agents + 1))
                    rest[named:] += chance * counts[: agents + 1 - named]
        by_odds = following
    counted = np.sum(list(by_odds.values()), axis=0)
    return Expected(right, _of_vote(counted))


def unweighed(hierarchy: na.Hierarchy) -> tuple[int, int] | None:
    """Return an agent and one of its senders that heard more than the agent hears, or None.

    Without such a pair, every agent knows the log odds by which its senders decided.

    Examples
    --------
    >>> unweighed(na.Hierarchy("abc", [("a", "b"), ("b", "c")], communication="parents"))
    (2, 1)
    """
    for agent in hierarchy.order:
        heard = {*hierarchy.senders(agent)}
        for sender in heard:
            if not heard.issuperset(hierarchy.senders(sender)):
                return agent, sender
    return None


def expected(
    hierarchy: na.Hierarchy, accuracy: float, indifferent: Indifferent = "signal"
) -> Expected | None:
    """Return how often the Bayesian agents of a hierarchy are right, or None if it is unknown.

    It is known without communication, if the agents above each agent form a chain (as in a chain,
    a tree or a star), or for few agents. The vote is NaN where it is unknown.

    Examples
    --------
    >>> tree = na.Hierarchy("abc", [("a", "b"), ("a", "c")])
    >>> expected(tree, 0.7).right.round(3).tolist(), round(expected(tree, 0.7).vote, 3)
    ([0.7, 0.7, 0.7], 0.784)
    """
    n = len(hierarchy)
    places = [len(hierarchy.senders(agent)) for agent in range(n)]
    lines = all(
        sorted(places[sender] for sender in hierarchy.senders(agent)) == list(range(places[agent]))
        for agent in range(n)
    )
    is_enumerated = n <= MAX_ENUMERATED and indifferent == "signal"
    if not lines or unweighed(hierarchy):
        return enumerated(hierarchy, accuracy) if is_enumerated else None
    chain = cascade(max(places) + 1, accuracy, indifferent)
    vote = chain.vote
    if max(places) == 0:
        vote = majority(n, accuracy)
    elif max(places) < n - 1:
        vote = enumerated(hierarchy, accuracy).vote if is_enumerated else np.nan
    return Expected(chain.right[places], vote)


def _of_vote(counted: FloatArray) -> float:
    """Return how often a majority is right, given how often 0, ..., n agents are right."""
    n = len(counted) - 1
    tied = counted[n // 2] if n % 2 == 0 else 0.0
    return float(counted[n // 2 + 1 :].sum() + 0.5 * tied)


def enumerated(hierarchy: na.Hierarchy, accuracy: float) -> Expected:
    """Return how often the Bayesian agents of any hierarchy are right, by enumerating all signals.

    An indifferent agent names its own signal. An agent knows the hierarchy, its own signal and its
    messages. It names the state that is more probable over all cases with these signals and
    messages.

    Parameters
    ----------
    hierarchy
        Who is told by whom.
    accuracy
        Of their signals.

    Raises
    ------
    ValueError
        If there are more than `MAX_ENUMERATED` agents.

    Examples
    --------
    >>> star = na.Hierarchy("abc", [("a", "b"), ("a", "c")])
    >>> enumerated(star, 0.7).right.round(3).tolist()
    [0.7, 0.7, 0.7]
    """
    n = len(hierarchy)
    if n > MAX_ENUMERATED:
        raise ValueError(f"enumerated: {n} agents, allowed: {MAX_ENUMERATED} or fewer")
    signals = np.arange(2**n)[:, None] >> np.arange(n) & 1
    ones = signals.sum(axis=1)
    if_b = accuracy**ones * (1.0 - accuracy) ** (n - ones)
    if_a = if_b[::-1]  # all signals are the others
    named = np.zeros_like(signals)
    for agent in hierarchy.order:
        known = np.column_stack([named[:, list(hierarchy.senders(agent))], signals[:, agent]])
        _, case = np.unique(known, axis=0, return_inverse=True)
        more = (np.bincount(case, if_b) - np.bincount(case, if_a))[case]
        is_tied = np.abs(more) <= EQUAL * np.bincount(case, if_a + if_b)[case]
        named[:, agent] = np.where(is_tied, signals[:, agent], more > 0.0)
    counted: FloatArray = np.zeros(n + 1)
    np.add.at(counted, named.sum(axis=1), if_b)
    return Expected(if_b @ named, _of_vote(counted))
