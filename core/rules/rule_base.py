"""Fuzzy rule bases as linear value functions (Section IV-B, Eq. 9).

A rule base is a sum of *terms*. A term is a set of state variables; it holds one rule for every
combination of their membership functions, whose firing strength is the product of the membership
degrees. Since each partition sums to one, so do the firing strengths of a term. Order d (one term
over all variables, 5^7 rules) is the paper's rule base; order 1 (one term per variable, 35 rules)
is a sum of one-variable functions.

The consequent weights theta of one agent are a flat array ``(n_rules,)``: the terms one after the
other, each in C order of its variables. The feature vector phi is the concatenation of the firing
strengths; it is built explicitly by `RuleBase.features` only, for tests and tables.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import combinations
from math import prod
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ..interface.prediction import Blocks
from ..interface.spaces import StateSpace
from ..numerics import FloatArray, IntArray, interpreted
from ..plugins.settings import Positive, Settings
from .kernels.compact_states import active_compact, each_compact, total_compact
from .kernels.dense import Tried, enumerate_dense, enumerate_looked_up, values_dense
from .kernels.dense_states import each_dense
from .kernels.fuzzy import Partition, layout, unpack


class RuleBaseSettings(Settings):
    """The fuzzy rule base that every agent holds (Section IV-B)."""

    membership: Literal["triangular", "sigmoid"] = "triangular"
    """Shape of the membership functions; the paper's are differences of sigmoids (Eq. 6)."""
    memberships: Annotated[int, Field(ge=2, le=15)] | None = None
    """Membership functions per variable, spread evenly; none: the state space's own centres."""
    steepness: Positive = 8.0
    """Sigmoid slope times the distance of neighbouring centres (c_j of Eq. 6, dimensionless)."""
    order: Annotated[int, Field(ge=1, le=12)] | Literal["full"] = 1
    """Variables per rule: 1 sums one-variable rule bases, d or ``full`` is the paper's product of
    all variables. 2 where what one variable is worth depends on another; it takes more episodes."""
    products: tuple[tuple[str, ...], ...] = ()
    """Further products of variables by name, summed to those of `order`."""
    precision: Literal["float64", "float32"] = "float64"
    """Precision of the consequent weights and traces; float32 halves memory and traffic."""


MOST_RULES = 2**63 - 1
"""Rules that can be numbered."""


class Pooled(NamedTuple):
    """The consequent weights of k agents of b bodies, summed where they see the same."""

    weights: tuple[FloatArray, FloatArray, FloatArray]
    """Of the agents ``(k, n_rules)``, of their bodies ``(b, n_rules)``, of all ``(1, n_rules)``."""
    agents: IntArray
    """``(k,)`` which agents they are."""
    bodies: IntArray
    """``(b,)`` which bodies they are."""
    firsts: IntArray
    """``(b + 1,)`` the first agent of every body among them, and k."""


class RuleBase:
    """A sum of fuzzy rule bases over subsets of the state variables.

    Parameters
    ----------
    partitions
        One partition per state variable, all of one membership shape.
    terms
        Index tuples into the variables, each increasing, all distinct.
    n_own
        How many leading variables form the own block (see `nested_agents.core.interface.spaces`).
    dtype
        Type of the consequent weights that learners keep; states are double precision always.
    common
        Indices of variables that are the same for all agents.
    actions
        Indices of variables that are actions taken.
    names
        What the variables are called; none: nobody asks.

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
        dtype: str = "float64",
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
        if self.n_rules > MOST_RULES:
            raise ValueError(f"rule base: {self.n_rules} rules, allowed {MOST_RULES} at most")
        self.layout = layout(self.partitions, self.terms, n_own)
        # Not worth compiling it for.
        lay = interpreted(unpack)(self.layout)
        self.n_parts = int(lay.row_sizes @ lay.part_sizes)
        self.dtype = np.dtype(dtype)
        self.compact = self.partitions[0].membership == "triangular"
        self._enumerate = enumerate_looked_up if self.compact else enumerate_dense

    @classmethod
    def build(cls, space: StateSpace, settings: RuleBaseSettings) -> RuleBase:
        """Build the rule base of `settings` over a state space.

        Raises
        ------
        ValueError
            If the order exceeds the number of variables or a product names an unknown variable,
            one twice, or none.
        """
        names = [v.name for v in space.variables]
        order = len(names) if settings.order == "full" else settings.order
        if order > len(names):
            raise ValueError(
                f"learner.rule_base.order = {order}, allowed 1 to {len(names)} in state "
                f"space {space.name!r}"
            )
        terms = list(combinations(range(len(names)), order))
        for product in settings.products:
            unknown = [name for name in product if name not in names]
            if unknown:
                raise ValueError(
                    f"learner.rule_base.products: unknown variable {unknown[0]!r}, known: "
                    f"{', '.join(names)}"
                )
            if not product or len(set(product)) < len(product):
                raise ValueError(
                    f"learner.rule_base.products: {list(product)} must name at least one variable, "
                    "each once"
                )
            terms.append(tuple(sorted(names.index(name) for name in product)))
        counts = dict.fromkeys(names, settings.memberships) | dict.fromkeys(space.actions)
        partitions = [
            Partition.of(v, settings.membership, counts[v.name], settings.steepness)
            for v in space.variables
        ]
        common = [names.index(name) for name in space.common]
        terms = list(dict.fromkeys(terms))
        actions = [names.index(name) for name in space.actions]
        return cls(partitions, terms, space.n_own, settings.precision, common, actions, names)

    @cached_property
    def kinds(self) -> tuple[IntArray, IntArray, IntArray]:
        """The terms whose variables an agent alone sees, its body's agents do, or all do."""
        own = np.array([any(j < self.n_own for j in term) for term in self.terms])
        common = ~own & [self.common.issuperset(term) for term in self.terms]
        return np.flatnonzero(own), np.flatnonzero(~(own | common)), np.flatnonzero(common)

    def features(self, states: FloatArray) -> FloatArray:
        """Return phi ``(m, n_rules)`` of states ``(m, d)`` explicitly.

        The reference implementation of every kernel rests on it.

        Raises
        ------
        ValueError
            If the states have another shape.
        """
        strengths = self._strengths(states)
        parts = []
        for term in self.terms:
            product = np.ones((len(states), 1))
            for j in term:
                product = (product[:, :, None] * strengths[j][:, None, :]).reshape(len(states), -1)
            parts.append(product)
        return np.concatenate(parts, axis=1)

    def values(self, theta: FloatArray, states: FloatArray) -> FloatArray:
        """Return f ``(m,)`` of states ``(m, d)`` for one agent's weights ``(n_rules,)`` (Eq. 9).

        Raises
        ------
        ValueError
            If theta or the states have another shape.
        """
        states = np.ascontiguousarray(states, dtype=float)
        self._check_states(states)
        self._check_theta(theta)
        if self.compact:
            return each_compact(theta[None], states[None], self.layout)[0]
        return values_dense(theta, states, self.layout)

    def each(self, theta: FloatArray, states: FloatArray) -> FloatArray:
        """Return f ``(n, s)`` of states ``(n, s, d)``, by the rows of theta ``(n, n_rules)``.

        Raises
        ------
        ValueError
            If theta or the states have another shape.
        """
        states = np.ascontiguousarray(states, dtype=float)
        self._check_states(states, "n, s")
        self._check_theta(theta, len(states))
        if self.compact:
            return each_compact(theta, states, self.layout)
        return each_dense(theta, states, self.layout)

    def total(self, pooled: Pooled, own: FloatArray, shared: FloatArray) -> FloatArray:
        """Return the summed value ``(m,)`` of some agents, each thing shared valued once.

        Own variables are those of all agents, shared ones those of the bodies, as of
        `core.rules.kernels.compact_states.total_compact`. Shapes are trusted: an evaluator calls
        this many times at every decision. Where all rules are active, each agent is valued by
        itself.
        """
        weights, agents, _, firsts = pooled
        if self.compact:
            return total_compact(weights, agents, firsts, self.kinds, own, shared, self.layout)
        body = np.repeat(np.arange(len(shared)), np.diff(firsts))
        states = np.concatenate([own[agents], shared[body]], axis=2)
        return each_dense(weights[0], states, self.layout).sum(axis=0)

    def squared_lengths(self, states: FloatArray) -> FloatArray:
        """Return the squared length ``(m,)`` of phi of states ``(m, d)``.

        A product's is the product of its variables' squared lengths.

        Raises
        ------
        ValueError
            If the states have another shape.
        """
        squares = [(strengths**2).sum(axis=1) for strengths in self._strengths(states)]
        return np.sum([np.prod([squares[j] for j in term], axis=0) for term in self.terms], axis=0)

    def active(self, states: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return rules ``(m, k)`` and their firing strengths ``(m, k)``; the others are zero.

        For triangular partitions ``k`` is the sum of ``2 ** len(term)`` over the terms; for
        sigmoid ones all rules are active.

        Raises
        ------
        ValueError
            If the states have another shape.
        """
        states = np.ascontiguousarray(states, dtype=float)
        self._check_states(states)
        if self.compact:
            return active_compact(states, self.layout)
        strengths = self.features(states)
        return np.broadcast_to(np.arange(self.n_rules), strengths.shape), strengths

    def block_values(self, theta: FloatArray, blocks: Blocks, indices: IntArray) -> FloatArray:
        """Return f ``(len(indices),)`` of the next states that joint-action `indices` lead to.

        The own part of theta is contracted once per distinct own block, or the few active rules
        are looked up; the feature vector of a joint action is never built. Blocks are trusted, as
        in `enumerate`.

        Raises
        ------
        ValueError
            If theta is not ``(n_rules,)``.
        """
        self._check_theta(theta)
        none = np.zeros(0, dtype=np.int64)
        tried = np.ascontiguousarray(indices)[:, None], none, none
        return self.enumerate(theta, blocks, tried, none, np.zeros((0, 0)))

    def enumerate(
        self,
        theta: FloatArray,
        blocks: Blocks,
        tried: Tried,
        joint_action: IntArray,
        probabilities: FloatArray,
    ) -> FloatArray:
        """Return the value ``(A,)`` of each own action over the joint actions `tried`.

        Shapes are trusted: an evaluator calls this at every decision. Whether the blocks of a
        scenario are sound, `nested_agents.scenarios.checking.checker` finds out.

        Parameters
        ----------
        theta
            ``(n_rules,)`` consequent weights.
        blocks
            Where joint actions lead.
        tried
            Which ones.
        joint_action
            ``(n,)`` actions of the agents that are given.
        probabilities
            ``(n, A)`` probabilities of the actions of the agents below, to average over; with
            ``(0, 0)`` the maximum is taken.
        """
        tables = blocks.own, blocks.own_rows, blocks.shared, blocks.shared_rows, blocks.divisor
        return self._enumerate(theta, tables, tried, joint_action, probabilities, self.layout)

    def _strengths(self, states: FloatArray) -> list[FloatArray]:
        """Return by variable the firing strengths of states ``(m, d)``."""
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
