"""A predictor learned online, without prior knowledge, from states and actions alone.

Bodies are assumed to be *driven*: nothing changes unless an agent acts. The effect of an action
appears in the agent's own variables (the speed of its wheel). These are regressed first, by action,
on their previous values. The predicted own variables, in units of their limits, are the drivers of
the agent's body. Without own variables, every action is a driver, and so is a constant. The effect
of the drivers on all other variables is regressed on the rules of a fuzzy rule base (see
`driven_states`), for changes and for values; each variable uses the one with the smaller residual.
Angles always use changes.

Bodies of one kind share weights: one set for the effect on itself, one for the effect on others.
Both are ridge regressions on sums over all experience. Predictions stay within the observed range.
Over several decisions, the first joint action is held.
"""

from __future__ import annotations

import numpy as np

from ..interface.abilities import horizon_of, partners_of
from ..interface.scenario import Scenario, Transition, rows_of
from ..numerics import BoolArray, FloatArray, IntArray
from ..search.enumeration import combinations
from ..values.partitions import Partition
from ..values.rule_base import RuleBase
from .adaptive import Adaptive
from .learned_prediction import LearnedPrediction
from .predictors import DrivenBodies, LearnedPredictorSettings, Mirror, driven_states
from .regression import INTERVAL, solve_ridge

MAX_FEATURES = 4096
"""Maximum number of features of a regression that is solved densely."""
OWN_RIDGE = 1e-6
"""Ridge of own variables, small since they are observed without noise."""
MIDPOINT_ITERATIONS = 3
"""Number of fixed-point iterations of a midpoint prediction."""
GRAIN = 1e-3
"""Own variables are rounded to this share of their range, so that equal outcomes are found."""


class LearnedPredictor(Adaptive[LearnedPrediction]):
    """Learns the outcome of actions by regression; see the module.

    Parameters
    ----------
    settings
        Horizon and regression.
    scenario
        The scenario to predict. The predictor uses its agents, bodies, roles, state variables,
        number of actions and mirror symmetry.

    Raises
    ------
    ValueError
        If there are no shared variables, too many features, or no mirror symmetry although
        mirrored experience is wanted.
    """

    def __init__(self, settings: LearnedPredictorSettings, scenario: Scenario) -> None:
        self.settings = settings
        self.space = scenario.state_space
        self.groups = scenario.groups
        self.n_actions = len(scenario.action_set)
        space = self.space
        if not space.shared:
            raise ValueError(
                "learner.predictor: the scenario has no shared variables to predict; use 'given'"
            )
        self.horizon = settings.horizon or horizon_of(scenario)
        if settings.mirrored and not space.n_own:
            raise ValueError(
                "learner.predictor.mirrored = true: needs own state variables; use false"
            )
        mirrored = settings.mirrored
        if mirrored is None:
            # The mirror image of an action is unknown, that of an own variable is known.
            mirrored = space.n_own > 0 and partners_of(scenario) is not None
        self.mirror = Mirror.of(scenario) if mirrored else None
        self.driven = DrivenBodies(
            scenario, products=settings.products, memberships=settings.memberships
        )
        self.kinds = rows_of(scenario, np.arange(len(scenario.agents)), shared=True)
        """``(n,)`` kind of every agent; agents of one kind share the model of own variables."""
        own = [Partition.of(variable) for variable in space.own]
        self.own_rules = RuleBase(own, [(j,) for j in range(len(own))]) if own else None
        low, high = np.array([(v.low, v.high) for v in space.variables]).T
        self.periods = np.where([v.periodic for v in space.variables], high - low, 0.0)
        self.limits = np.maximum(np.abs(low), np.abs(high))[: space.n_own]
        self.grains = GRAIN * (high - low)[: space.n_own]
        self._pending: list[tuple[FloatArray, IntArray, FloatArray]] = []
        sizes = [len(group) for group in self.groups]
        self.group_of = np.repeat(np.arange(len(self.groups)), sizes)
        self.joint_actions: IntArray | None = None
        """``(A ** w, w)`` joint actions of a group, if all groups have w agents."""
        if len({*sizes}) == 1:
            self.joint_actions = combinations(tuple(range(sizes[0])), self.n_actions)
        b, w = self.driven.members.shape
        v = len(self.driven.common)
        k = w * (space.n_own or self.n_actions + 1)
        rules = self.driven.rules.n_rules
        if k * rules * min(b, 2) > MAX_FEATURES:
            raise ValueError(
                f"learner.predictor: needs {k * rules * min(b, 2)} regression features, allowed "
                f"{MAX_FEATURES}; reduce products or memberships"
            )
        seen = np.where(self.periods > 0.0, [low, high], [[np.inf], [-np.inf]])
        self.memory = self._empty_memory(k, rules, v) | {"seen": seen}
        self.bodies = [np.array(array.shape) for array in self.memory.values()]

    def _empty_memory(self, k: int, rules: int, v: int) -> dict[str, FloatArray]:
        """Return sums and weights before any experience, for k inputs, rules and v variables."""
        n_own = self.space.n_own
        r = self.own_rules.n_rules if self.own_rules else 0
        of_own = (self.kinds.max() + 1, self.n_actions, r)
        f = k * rules
        return {
            "own_gram": np.zeros((*of_own, r)),
            "own_moment": np.zeros((*of_own, n_own)),
            "own_weights": np.zeros((*of_own, n_own)),
            "gram": np.zeros((3, f, f)),
            "moment": np.zeros((2, f, 2 * v)),
            "squares": np.zeros(2 * v),
            "weights": np.zeros((k, rules, 2 * v)),
            "keep": np.ones(v),
        }

    def predict(self, states: FloatArray) -> LearnedPrediction:
        """Predict from states ``(n, d)``."""
        return LearnedPrediction(self, states)

    def adapt(
        self, prediction: LearnedPrediction, joint_action: IntArray, transition: Transition
    ) -> None:
        """Observe the outcome of a joint action from the states of a prediction."""
        self.observe(prediction.present, joint_action, transition.states)

    def observe(self, before: FloatArray, joint_action: IntArray, after: FloatArray) -> None:
        """Record a joint action ``(n,)``, the states ``(n, d)`` before it and those after it."""
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
        gram = m["own_gram"] + OWN_RIDGE * np.eye(phi.shape[1])
        m["own_weights"] = np.linalg.solve(gram, m["own_moment"])

    def _regress(self, before: FloatArray, joint: IntArray, after: FloatArray) -> None:
        bodies = self.driven
        m = self.memory
        b, v = bodies.agents.shape
        change = self._apart(after, before)[:, bodies.agents, bodies.columns]
        present = before[:, bodies.agents, bodies.columns]
        where = present + 0.5 * change if self.settings.midpoint else present
        phi = bodies.rules.features(where.reshape(-1, v)).reshape(len(before), b, 1, -1)
        features = self.group_drivers(after[..., : self.space.n_own], joint)[..., None] * phi
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
        """Return weights ``(f, 2 v)`` of own and of other bodies' features, and explained squares.

        The columns are the changes of all variables, then their values.
        """
        each, of_all, rest = self.memory["gram"]
        moment, summed = self.memory["moment"]
        f = len(each)
        own = np.zeros_like(moment)
        others = np.zeros_like(moment)
        explained: FloatArray = np.zeros(len(common))
        if len(self.driven.members) == 1:
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
        """Return the weights of a ridge regression, and the sum of squares that they explain."""
        ridge = self.settings.ridge
        weights = solve_ridge(gram, moment, ridge)
        return weights, (weights * moment).sum(axis=0) + ridge * (weights**2).sum(axis=0)

    def group_drivers(self, own: FloatArray, joint_actions: IntArray) -> FloatArray:
        """Return the drivers ``(m, b, k)`` of bodies of w agents for m joint actions ``(m, n)``.

        They are the predicted next own variables ``(m, n, n_own)``, divided by their limits; k is
        ``w n_own``. Without own variables they are the actions, each as A zeros and ones, and a
        constant 1 for each agent; k is ``w (A + 1)``.
        """
        if self.own_rules is not None:
            each = own / self.limits
        else:
            each = np.eye(self.n_actions, self.n_actions + 1)[joint_actions]
            each[..., -1] = 1.0
        members = self.driven.members
        return each[:, members].reshape(len(each), len(members), -1)

    def reached(self, states: FloatArray) -> FloatArray:
        """Return the next own variables ``(n, A, n_own)`` for every action."""
        own = states[:, None, : self.space.n_own]
        if self.own_rules is None:
            return np.repeat(own, self.n_actions, axis=1)
        phi = self.own_rules.features(np.ascontiguousarray(own[:, 0]))
        change = np.einsum("nr,narx->nax", phi, self.memory["own_weights"][self.kinds])
        return np.round((own + change) / self.grains) * self.grains

    def after(self, states: FloatArray, drivers: FloatArray) -> FloatArray:
        """Return the next shared variables ``(G, m, s)`` for drivers ``(m, b, k)``."""
        bodies = self.driven
        m = self.memory
        columns = bodies.columns[0]
        present = states[bodies.agents, bodies.columns]
        ranges = np.ascontiguousarray(m["seen"][:, columns])
        # Before the first regression, only the present has been observed.
        ranges[0] = np.minimum(ranges[0], present.min(axis=0))
        ranges[1] = np.maximum(ranges[1], present.max(axis=0))
        passes = MIDPOINT_ITERATIONS if self.settings.midpoint else 1
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

    def _apart(self, states: FloatArray, others: FloatArray) -> FloatArray:
        """Return differences of states ``(..., d)``; those of periodic variables are wrapped."""
        change = states - others
        turns = np.round(change / np.where(self.periods > 0.0, self.periods, np.inf))
        return change - self.periods * turns
