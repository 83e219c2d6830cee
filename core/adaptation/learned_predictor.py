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
from typing import Any, cast

import numpy as np

from ..interface.scenario import Scenario, groups_of, roles_of
from ..numerics.arrays import BoolArray, FloatArray, IntArray
from ..rules.kernels.fuzzy import Partition
from ..rules.rule_base import RuleBase
from .driven import Bodies, driven_states
from .learned_prediction import LearnedPrediction, TabulatedPrediction
from .mirror import Mirror
from .predictors import LearnedPredictorSettings

INTERVAL = 100
"""Decisions of an episode after which is regressed without waiting for its end."""
MOST_FEATURES = 4096
"""Of one regression: more take too long to be solved densely."""
MOST_TABULATED = 4**6
"""Joint actions up to which a prediction has tables of all."""
STEADY = 1e-6
"""Ridge of own variables: what has been seen of them is believed at once."""
GRAIN = 1e-3
"""Own variables that differ by less than this, in units of their range, are the same."""


class LearnedPredictor:
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
        self.settings, self.space = settings, scenario.state_space
        self.groups, self.n_actions = groups_of(scenario), len(scenario.action_set)
        space, roles = self.space, roles_of(scenario)
        if not space.shared:
            raise ValueError("learner.predictor: all state variables are an agent's own")
        self.horizon = settings.horizon or cast(Any, getattr(scenario, "horizon", 1))
        # What an action is in the mirror is not known, only what own variables are.
        known = hasattr(scenario, "partners") and space.n_own > 0
        if settings.mirrored and not space.n_own:
            raise ValueError("learner.predictor.mirrored: without own variables there is no mirror")
        mirrored = known if settings.mirrored is None else settings.mirrored
        self.mirror = Mirror.of(scenario) if mirrored else None
        self.bodies = Bodies(scenario, settings.products, settings.memberships)
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
        f, own, others = len(each), np.zeros_like(moment), np.zeros_like(moment)
        explained: FloatArray = np.zeros(len(common))
        if len(self.bodies.members) == 1:
            own, explained = self._ridge(each, moment)
            return own, others, explained
        across = of_all - each
        gram = np.block([[each, across], [across, rest + each]])
        both = np.concatenate([moment, summed - moment])[:, ~common]
        weights, explained[~common] = self._ridge(gram, both)
        own[:, ~common], others[:, ~common] = weights[:f], weights[f:]
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
        bodies, m = self.bodies, self.memory
        columns = bodies.columns[0]
        present, ranges = states[bodies.agents, bodies.columns], m["seen"][:, columns]
        # Before anything is learned the present is all that has been seen.
        ranges[0] = np.minimum(ranges[0], present.min(axis=0))
        ranges[1] = np.maximum(ranges[1], present.max(axis=0))
        moved = driven_states(
            present, drivers, m["weights"], m["keep"],
            ranges, self.periods[columns], self.horizon, bodies.rules.layout,
        )  # fmt: skip
        body, place = bodies.places
        return np.moveaxis(moved[:, body, place], 0, 1)

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
