"""Fuzzy rule bases as linear value functions (Section IV-B, Eq. 9).

A rule base is a sum of *terms*. A term is a set of state variables. It holds one rule for every
combination of their membership functions; the firing strength of a rule is the product of its
membership degrees. Since each partition sums to one, so do the firing strengths of a term. Order d
(one term over all variables, 5^7 rules) is the paper's rule base; order 1 (one term per variable,
35 rules) is a sum of functions of one variable.

The consequent weights theta of one agent are a flat array ``(n_rules,)``: the terms one after the
other, each in C order of its variables. The feature vector phi holds the firing strengths in the
same order. `RuleBase.features` defines it; the kernels compute the same values faster.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from math import prod
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ..interface.spaces import StateSpace
from ..numerics import FloatArray, IntArray, compile_ahead
from ..plugins.settings import Positive, Settings
from ..plugins.words import closest
from .partitions import Partition
from .triangular import active_rules, layout, summed_values, values_of_agents


class RuleBaseSettings(Settings):
    """Fuzzy rule base of every agent (Section IV-B)."""

    membership: Literal["triangular", "sigmoid"] = "triangular"
    """Shape of the membership functions. The paper uses differences of sigmoids (Eq. 6)."""
    memberships: Annotated[int, Field(ge=2, le=15)] | None = None
    """Number of evenly spread membership functions per variable. With none, the centers of the
    state space are used."""
    centers: Mapping[str, tuple[float, ...]] = Field(default_factory=dict)
    """Centers of the membership functions by variable, in increasing order and in its unit; other
    variables keep theirs."""
    steepness: Positive = 8.0
    """Slope of a sigmoid times the distance of neighboring centers (c_j of Eq. 6)."""
    order: Annotated[int, Field(ge=1, le=12)] | Literal["full"] = 1
    """Number of variables per rule. 1 is a sum of functions of one variable; ``full``, or the
    number of variables, is the paper's product of all. Use 2 if the effect of one variable depends
    on another; learning then takes more episodes."""


MAX_RULES = 2**63 - 1
"""Maximum number of rules: indices are 64-bit integers."""


class PooledWeights(NamedTuple):
    """Consequent weights of k agents of b bodies, summed over agents with the same variables."""

    weights: tuple[FloatArray, FloatArray, FloatArray]
    """Weights of the agents ``(k, n_rules)``, their sum by body ``(b, n_rules)``, and the sum of
    all ``(1, n_rules)``."""
    agents: IntArray
    """``(k,)`` indices of the agents."""
    bodies: IntArray
    """``(b,)`` indices of their bodies."""
    firsts: IntArray
    """``(b + 1,)`` the first agent of every body among the k agents, and k."""


class RuleBase:
    """A sum of fuzzy rule bases over subsets of the state variables.

    Parameters
    ----------
    partitions
        One partition per state variable, all of one membership shape.
    terms
        Tuples of variable indices, each increasing, all distinct.
    n_own
        Number of leading variables that are an agent's own (see
        `nested_agents.core.interface.spaces`).
    common
        Indices of variables that are the same for all agents.
    actions
        Indices of variables that are actions.
    names
        Names of the variables, used in messages.

    Examples
    --------
    The paper's example (Section IV-B): three variables with LOW and HIGH give eight rules.

    >>> low_high = Partition((0.0, 1.0), "triangular")
    >>> base = RuleBase([low_high] * 3, [(0, 1, 2)])
    >>> base.n_rules, base.features(np.array([[0.0, 0.0, 0.25]])).round(2).tolist()
    (8, [[0.75, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    """

    def __init__(
        self,
        partitions: Sequence[Partition],
        terms: Sequence[tuple[int, ...]],
        n_own: int = 0,
        common: Sequence[int] = (),
        actions: Sequence[int] = (),
        names: Sequence[str] = (),
    ) -> None:
        d = len(partitions)
        for term in terms:
            if not term or list(term) != sorted(set(term)) or not 0 <= term[0] <= term[-1] < d:
                raise ValueError(f"rule base: term {term} must increase within 0 to {d - 1}")
        if not terms or len(set(terms)) != len(terms):
            raise ValueError(f"rule base: terms {list(terms)} must be distinct and at least one")
        if len({p.membership for p in partitions}) > 1:
            raise ValueError("rule base: all partitions must have one membership shape")
        if not 0 <= n_own <= d:
            raise ValueError(f"rule base: n_own = {n_own}, allowed 0 to {d}")
        self.partitions = tuple(partitions)
        self.terms = tuple(terms)
        self.n_own = n_own
        self.common = frozenset(common)
        self.actions = frozenset(actions)
        self.names = tuple(names)
        self.sizes = tuple(prod(self.partitions[j].size for j in term) for term in self.terms)
        self.n_rules = sum(self.sizes)
        if self.n_rules > MAX_RULES:
            raise ValueError(f"rule base: {self.n_rules} rules, allowed {MAX_RULES} at most")
        self.is_triangular = self.partitions[0].membership == "triangular"
        self.layout = layout(self.partitions, self.terms)

    @classmethod
    def build(cls, space: StateSpace, settings: RuleBaseSettings) -> RuleBase:
        """Return the rule base of `settings` over a state space.

        Raises
        ------
        ValueError
            If the order exceeds the number of variables.
        """
        names = [v.name for v in space.variables]
        order = len(names) if settings.order == "full" else settings.order
        if order > len(names):
            raise ValueError(
                f"learner.rule_base.order = {order}, allowed 1 to {len(names)} in state "
                f"space {space.name!r}"
            )
        counts = dict.fromkeys(names, settings.memberships) | dict.fromkeys(space.actions)
        partitions = {
            v.name: Partition.of(v, settings.membership, counts[v.name], settings.steepness)
            for v in space.variables
        }
        for name, centers in settings.centers.items():
            if name not in partitions or name in space.actions:
                known = set(names) - set(space.actions)
                raise ValueError(f"learner.rule_base.centers.{name}: {closest(name, known)}")
            try:
                partitions[name] = replace(partitions[name], centers=centers)
            except ValueError as error:
                raise ValueError(f"learner.rule_base.centers.{name}: {error}") from None
        return cls(
            list(partitions.values()),
            list(combinations(range(len(names)), order)),
            space.n_own,
            [names.index(name) for name in space.common],
            [names.index(name) for name in space.actions],
            names,
        )

    @cached_property
    def terms_by_owner(self) -> tuple[IntArray, IntArray, IntArray]:
        """Rows of the layout by owner: terms of one agent, of the agents of a body, of all."""
        own = np.array([any(j < self.n_own for j in term) for term in self.terms])
        common = ~own & [self.common.issuperset(term) for term in self.terms]
        rows = self.layout[1]
        return rows[own], rows[~(own | common)], rows[common]

    def features(self, states: FloatArray) -> FloatArray:
        """Return the feature vectors phi ``(m, n_rules)`` of states ``(m, d)``.

        Raises
        ------
        ValueError
            If the states have another shape.
        """
        strengths = self._strengths(states)
        of_terms = [_products([strengths[j] for j in term], len(states)) for term in self.terms]
        return of_terms[0] if len(of_terms) == 1 else np.concatenate(of_terms, axis=1)

    def values(self, theta: FloatArray, states: FloatArray) -> FloatArray:
        """Return values ``(m,)`` of states ``(m, d)`` by the weights ``(n_rules,)`` of one agent.

        Raises
        ------
        ValueError
            If theta or the states have another shape (Eq. 9).
        """
        self._check_states(states)
        self._check_theta(theta)
        return self.values_of_agents(theta[None], states[None])[0]

    def values_of_agents(self, theta: FloatArray, states: FloatArray) -> FloatArray:
        """Return values ``(n, s)`` of states ``(n, s, d)``, by the rows of theta ``(n, n_rules)``.

        Raises
        ------
        ValueError
            If theta or the states have another shape.
        """
        states = np.ascontiguousarray(states, dtype=float)
        self._check_states(states, "n, s")
        self._check_theta(theta, len(states))
        if self.is_triangular:
            return values_of_agents(theta, states, self.layout)
        return np.stack([self._dense_values(*each) for each in zip(theta, states, strict=True)])

    def summed_values(
        self, pooled: PooledWeights, own: FloatArray, shared: FloatArray
    ) -> FloatArray:
        """Return the summed value ``(m,)`` of some agents.

        Terms of shared variables are valued once, by summed weights. Shapes are not checked.

        Parameters
        ----------
        pooled
            Weights of the k agents.
        own, shared
            ``(n, m, n_own)`` own variables of all agents of the team, and ``(b, m, d - n_own)``
            shared variables of the bodies in `pooled`.
        """
        weights, agents, _, firsts = pooled
        if self.is_triangular:
            terms, variables = self.terms_by_owner, self.layout[0]
            return summed_values(weights, agents, firsts, terms, own, shared, variables)
        body = np.repeat(np.arange(len(shared)), np.diff(firsts))
        states = np.concatenate([own[agents], shared[body]], axis=2)
        return self.values_of_agents(weights[0], states).sum(axis=0)

    def prepare_kernels(self) -> None:
        """Begin to compile `summed_values`, if it is not cached yet."""
        if self.is_triangular:
            some = np.zeros((1, 1))
            none = np.zeros(1, np.int64)
            weights = some, some, some
            terms, variables = self.terms_by_owner, self.layout[0]
            own = some[None]
            compile_ahead(summed_values, weights, none, none, terms, own, own, variables)

    def squared_lengths(self, states: FloatArray) -> FloatArray:
        """Return the squared lengths ``(m,)`` of the feature vectors of states ``(m, d)``.

        Raises
        ------
        ValueError
            If the states have another shape.
        """
        squares = [(strengths**2).sum(axis=1) for strengths in self._strengths(states)]
        return np.sum([np.prod([squares[j] for j in term], axis=0) for term in self.terms], axis=0)

    def active(self, states: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the rules ``(m, k)`` that may be active and their firing strengths ``(m, k)``.

        For triangular partitions k is the sum of ``2 ** len(term)`` over the terms; for sigmoids
        all rules are active.

        Raises
        ------
        ValueError
            If the states have another shape.
        """
        states = np.ascontiguousarray(states, dtype=float)
        self._check_states(states)
        if self.is_triangular:
            return active_rules(states, self.layout)
        strengths = self.features(states)
        return np.tile(np.arange(self.n_rules, dtype=np.int32), (len(states), 1)), strengths

    def add_features(
        self, target: FloatArray, rows: IntArray, states: FloatArray, weights: FloatArray
    ) -> None:
        """Add ``weights[i] * phi(states[i])`` to row ``rows[i]`` of `target`, in place."""
        rules, strengths = self.active(states)
        np.add.at(target, (rows[:, None], rules), weights[:, None] * strengths)

    def _dense_values(self, theta: FloatArray, states: FloatArray) -> FloatArray:
        """Return values ``(m,)`` of states ``(m, d)`` where every rule is active.

        A term is a matrix of weights; its first variables are contracted, then its last ones.
        """
        strengths = self._strengths(states)
        values: FloatArray = np.zeros(len(states))
        blocks = np.split(theta, np.cumsum(self.sizes)[:-1])
        for term, weights in zip(self.terms, blocks, strict=True):
            half = len(term) // 2
            heads = _products([strengths[j] for j in term[:half]], len(states))
            tails = _products([strengths[j] for j in term[half:]], len(states))
            values += ((heads @ weights.reshape(heads.shape[1], -1)) * tails).sum(axis=1)
        return values

    def _strengths(self, states: FloatArray) -> list[FloatArray]:
        """Return the membership degrees of states ``(m, d)`` by variable."""
        self._check_states(states)
        return [p.strengths(states[:, j]) for j, p in enumerate(self.partitions)]

    def _check_states(self, states: FloatArray, sets: str = "m") -> None:
        d = len(self.partitions)
        if states.shape[len(sets.split()) :] != (d,):
            raise ValueError(f"rule base: states of shape {states.shape}, must be ({sets}, {d})")

    def _check_theta(self, theta: FloatArray, *agents: int) -> None:
        shape = (*agents, self.n_rules)
        if theta.shape != shape:
            raise ValueError(f"rule base: theta of shape {theta.shape}, must be {shape}")


def _products(strengths: Sequence[FloatArray], n_states: int) -> FloatArray:
    """Return the products ``(m, rules)`` of membership degrees ``(m, size)``, in C order."""
    product: FloatArray = np.ones((n_states, 1))
    for degrees in reversed(strengths):
        product = (degrees[:, :, None] * product[:, None, :]).reshape(n_states, -1)
    return product
