"""A predictor that is learned online, from nothing, by regression on states and actions alone.

Bodies are taken to be *driven*: nothing changes unless somebody does something. What an agent does
is seen in its own variables (the speed of its wheel): these are regressed first, on the own
variables before, by action. Own variables reached, in units of their limits, are the drivers of the
agent's body; without own variables every action is a driver, and a constant. How the drivers move
all other variables is regressed on the rules of a fuzzy rule base, see `driven`: changes and values
both, and of each variable that is taken which leaves the smaller residual. Angles always change.

Bodies alike share weights: what each does to itself, and what to any other. Both regressions are
ridge regressions (Hoerl and Kennard 1970) on sums over all experience, so that memory and time do
not grow. What is predicted does not leave the range that has been seen, and several decisions ahead
what agents do in the first is held.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..interface.scenario import Scenario, Transition, rows_of
from ..numerics import BoolArray, FloatArray, IntArray
from ..values.partitions import Partition
from ..values.rule_base import RuleBase
from .adaptive import Adaptive, DynamicsModel
from .learned_prediction import LearnedPrediction, TabulatedPrediction
from .predictors import DrivenBodies, LearnedPredictorSettings, Mirror, driven_states

INTERVAL = 100
"""Decisions of an episode after which is regressed without waiting for its end."""
MOST_FEATURES = 4096
"""Of one regression: more take too long to be solved densely."""
MOST_TABULATED = 4**6
"""Joint actions up to which a prediction has tables of all."""
STEADY = 1e-6
"""Ridge of own variables: what has been seen of them is believed at once."""
PASSES = 3
"""How often a prediction by the middle of the way is computed, which follows from it in turn."""
GRAIN = 1e-3
"""Own variables that differ by less than this, in units of their range, are the same."""


class LearnedPredictor(DynamicsModel, Adaptive[LearnedPrediction]):
    """Regresses what agents' actions lead to; see the module.

    Parameters
    ----------
    settings
        How far it looks, and how it regresses.
    scenario
        What is predicted. Known of it are agents, bodies, roles, state variables, how many actions
        there are, and what a mirror does.

    Raises
    ------
    ValueError
        If there are no variables that agents share, there are too many features, or the experience
        of a mirror is wanted and there is none; one line.
    """

    def __init__(self, settings: LearnedPredictorSettings, scenario: Scenario) -> None:
        self.settings = settings
        self.space = scenario.state_space
        self.groups = scenario.groups
        self.n_actions = len(scenario.action_set)
        space = self.space
        if not space.shared:
            raise ValueError("learner.predictor: all state variables are an agent's own")
        self.horizon = settings.horizon or scenario.horizon
        if settings.mirrored and not space.n_own:
            raise ValueError("learner.predictor.mirrored: without own variables there is no mirror")
        mirrored = settings.mirrored
        if mirrored is None:
            # What an action is in the mirror is not known, only what own variables are.
            mirrored = space.n_own > 0 and scenario.partners() is not None
        self.mirror = Mirror.of(scenario) if mirrored else None
        self.bodies = DrivenBodies(
            scenario, products=settings.products, memberships=settings.memberships
        )
        self.kinds = rows_of(scenario, np.arange(len(scenario.agents)), shared=True)
        """``(n,)`` agents of one kind have own variables that change alike."""
        own = [Partition.of(variable) for variable in space.own]
        self.own_rules = RuleBase(own, [(j,) for j in range(len(own))]) if own else None
        low, high = np.array([(v.low, v.high) for v in space.variables]).T
        self.periods = np.where([v.periodic for v in space.variables], high - low, 0.0)
        self.limits = np.maximum(np.abs(low), np.abs(high))[: space.n_own]
        self.grains = GRAIN * (high - low)[: space.n_own]
        self._pending: list[tuple[FloatArray, IntArray, FloatArray]] = []
        self._tabulate()
        b, w = self.bodies.members.shape
        v = len(self.bodies.common)
        k = w * (space.n_own or self.n_actions + 1)
        rules = self.bodies.rules.n_rules
        if k * rules * min(b, 2) > MOST_FEATURES:
            raise ValueError(
                f"learner.predictor: {k * rules * min(b, 2)} features to regress on, allowed "
                f"{MOST_FEATURES}; take fewer products or memberships"
            )
        r = self.own_rules.n_rules if self.own_rules else 0
        of_own = (self.kinds.max() + 1, self.n_actions, r)
        f = k * rules
        self.memory: dict[str, FloatArray] = {
            "own_gram": np.zeros((*of_own, r)),
            "own_moment": np.zeros((*of_own, space.n_own)),
            "own_weights": np.zeros((*of_own, space.n_own)),
            "gram": np.zeros((3, f, f)),
            "moment": np.zeros((2, f, 2 * v)),
            "squares": np.zeros(2 * v),
            "weights": np.zeros((k, rules, 2 * v)),
            "keep": np.ones(v),
            "seen": np.where(self.periods > 0.0, [low, high], [[np.inf], [-np.inf]]),
        }
        """Sums over all experience and what follows from them: all that is remembered."""

    def _tabulate(self) -> None:
        """Write out the actions of a group, and of all agents if they are few."""
        a = self.n_actions
        n = len(self.kinds)
        sizes = {len(group) for group in self.groups}
        self.group_of = np.repeat(np.arange(len(self.groups)), [len(g) for g in self.groups])
        self.digits = self.joint = np.zeros((0, 0), dtype=np.int64)
        """``(A ** w, w)`` if groups are of equal size; ``(A ** n, n)`` if agents are few, too."""
        if len(sizes) == 1:
            (w,) = sizes
            self.digits = np.indices((a,) * w).reshape(w, -1).T
            if a**n <= MOST_TABULATED:
                self.joint = np.indices((a,) * n).reshape(n, -1).T
                self.divisors = a ** np.arange(n - w, -1, -w)
                self.local = np.arange(a**n)[:, None] // self.divisors % a**w

    def predict(self, states: FloatArray) -> LearnedPrediction:
        """Predict from states ``(n, d)``."""
        return (TabulatedPrediction if len(self.joint) else LearnedPrediction)(self, states)

    def adapt(
        self, prediction: LearnedPrediction, joint_action: IntArray, transition: Transition
    ) -> None:
        """Note what a joint action led to from the states of a prediction, as `observe`."""
        self.observe(prediction.present, joint_action, transition.states)

    def observe(self, before: FloatArray, joint_action: IntArray, after: FloatArray) -> None:
        """Take in what a joint action ``(n,)`` made of states ``(n, d)``."""
        self._pending.append((before.copy(), joint_action.copy(), after.copy()))
        if len(self._pending) == INTERVAL:
            self.end_episode()

    def end_episode(self) -> None:
        """Regress on all experience."""
        if not self._pending:
            return
        before, joint, after = map(np.array, zip(*self._pending, strict=True))
        self._pending = []
        if self.own_rules is not None:
            self._regress_own(before, joint, after)
        if self.mirror is not None:
            signs = self.mirror.signs
            partners = self.mirror.partners
            before = np.concatenate([before, signs * before[:, partners]])
            after = np.concatenate([after, signs * after[:, partners]])
        seen = self.memory["seen"]
        every = np.concatenate([before, after])
        seen[0] = np.minimum(seen[0], every.min(axis=(0, 1)))
        seen[1] = np.maximum(seen[1], every.max(axis=(0, 1)))
        self._regress(before, joint, after)

    def _regress_own(self, before: FloatArray, joint: IntArray, after: FloatArray) -> None:
        m = self.memory
        own = self.space.n_own
        assert self.own_rules is not None
        phi = self.own_rules.features(before[..., :own].reshape(-1, own))
        change = self._apart(after, before)[..., :own].reshape(-1, own)
        at = np.tile(self.kinds, len(before)), joint.ravel()
        np.add.at(m["own_gram"], at, phi[:, :, None] * phi[:, None])
        np.add.at(m["own_moment"], at, phi[:, :, None] * change[:, None])
        gram = m["own_gram"] + STEADY * np.eye(phi.shape[1])
        m["own_weights"] = np.linalg.solve(gram, m["own_moment"])

    def _regress(self, before: FloatArray, joint: IntArray, after: FloatArray) -> None:
        bodies = self.bodies
        m = self.memory
        b, v = bodies.agents.shape
        change = self._apart(after, before)[:, bodies.agents, bodies.columns]
        present = before[:, bodies.agents, bodies.columns]
        where = present + 0.5 * change if self.settings.midpoint else present
        phi = bodies.rules.features(where.reshape(-1, v)).reshape(len(before), b, 1, -1)
        features = self.drivers(after[..., : self.space.n_own], joint)[..., None] * phi
        features = features.reshape(len(before), b, -1)
        targets = np.concatenate([change, after[:, bodies.agents, bodies.columns]], axis=2)
        each = features.reshape(len(before) * b, -1)
        together = features.sum(axis=1)
        common = np.tile(bodies.common, 2)
        summed = np.where(common, targets[:, 0], targets.sum(axis=1))
        of_all = together.T @ together
        m["gram"] += np.stack([each.T @ each, of_all, (b - 2) * of_all])
        m["moment"] += np.stack([each.T @ targets.reshape(-1, 2 * v), together.T @ summed])
        squares = targets**2
        m["squares"] += np.where(common, squares[:, 0].sum(axis=0), squares.sum(axis=(0, 1)))
        own, others, explained = self._solved(common)
        left = m["squares"] - explained
        is_angle = self.periods[bodies.columns[0]] > 0.0
        by_value = ~is_angle & (left[v:] < left[:v])
        weights = [np.where(by_value, part[:, v:], part[:, :v]) for part in (own, others)]
        m["weights"] = np.concatenate(weights, axis=1).reshape(m["weights"].shape)
        m["keep"] = np.where(by_value, 0.0, 1.0)

    def _solved(self, common: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the weights ``(f, 2 v)`` of own features and of others', and what they explain.

        Of all variables, by change and by value; what they explain is a part of the ``squares``.
        """
        each, of_all, rest = self.memory["gram"]
        moment, summed = self.memory["moment"]
        f = len(each)
        own = np.zeros_like(moment)
        others = np.zeros_like(moment)
        explained: FloatArray = np.zeros(len(common))
        if len(self.bodies.members) == 1:
            own, explained = self._ridge(each, moment)
            return own, others, explained
        across = of_all - each
        gram = np.block([[each, across], [across, rest + each]])
        both = np.concatenate([moment, summed - moment])[:, ~common]
        weights, explained[~common] = self._ridge(gram, both)
        own[:, ~common] = weights[:f]
        others[:, ~common] = weights[f:]
        weights, explained[common] = self._ridge(of_all, summed[:, common])
        own[:, common] = others[:, common] = weights
        return own, others, explained

    def _ridge(self, gram: FloatArray, moment: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the weights of ridge regression, and what they explain of the squares."""
        from scipy.linalg import cho_factor, cho_solve

        ridge = self.settings.ridge
        regular = gram + ridge * np.eye(len(gram))
        weights = cho_solve(cho_factor(regular, overwrite_a=True, check_finite=False), moment)
        return weights, (weights * moment).sum(axis=0) + ridge * (weights**2).sum(axis=0)

    def drivers(self, own: FloatArray, joint_actions: IntArray) -> FloatArray:
        """Return the drivers ``(m, b, k)``: own variables reached ``(m, n, n_own)``, or actions."""
        if self.own_rules is not None:
            each = own / self.limits
        else:
            each = np.eye(self.n_actions, self.n_actions + 1)[joint_actions]
            each[..., -1] = 1.0
        members = self.bodies.members
        return each[:, members].reshape(len(each), len(members), -1)

    def reached(self, states: FloatArray) -> FloatArray:
        """Return the own variables ``(n, A, n_own)`` that every action leads to."""
        own = states[:, None, : self.space.n_own]
        if self.own_rules is None:
            return np.repeat(own, self.n_actions, axis=1)
        phi = self.own_rules.features(np.ascontiguousarray(own[:, 0]))
        change = np.einsum("nr,narx->nax", phi, self.memory["own_weights"][self.kinds])
        return np.round((own + change) / self.grains) * self.grains

    def after(self, states: FloatArray, drivers: FloatArray) -> FloatArray:
        """Return the shared variables ``(G, m, s)`` that drivers ``(m, b, k)`` lead to."""
        bodies = self.bodies
        m = self.memory
        columns = bodies.columns[0]
        present = states[bodies.agents, bodies.columns]
        ranges = np.ascontiguousarray(m["seen"][:, columns])
        # Before anything is learned the present is all that has been seen.
        ranges[0] = np.minimum(ranges[0], present.min(axis=0))
        ranges[1] = np.maximum(ranges[1], present.max(axis=0))
        passes = PASSES if self.settings.midpoint else 1
        moved = driven_states(
            present,
            np.ascontiguousarray(drivers),
            m["weights"],
            m["keep"],
            ranges,
            self.periods[columns],
            self.horizon,
            passes,
            bodies.rules.layout,
        )
        body, place = bodies.places
        return np.ascontiguousarray(np.moveaxis(moved[:, body, place], 0, 1))

    def arrays(self) -> dict[str, FloatArray]:
        """Return sums over all experience, and the weights that follow from them."""
        return self.memory

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        self.memory = {name: np.array(arrays[name]) for name in self.memory}

    def continue_from(self, former: LearnedPredictor) -> None:
        """Go on from what another one has learned, if its bodies are built alike; else anew."""
        theirs = former.memory
        if all(theirs[name].shape == array.shape for name, array in self.memory.items()):
            self.restore(theirs)

    def _apart(self, states: FloatArray, others: FloatArray) -> FloatArray:
        """Return the change of states ``(..., d)``, of periodic variables the shorter way round."""
        change = states - others
        turns = np.round(change / np.where(self.periods > 0.0, self.periods, np.inf))
        return change - self.periods * turns
