"""Adapters for classes of users that do not inherit from `Scenario` or `Prediction`.

This is the only module that looks up optional members by name. Scenarios with bodies for
self-models must inherit from `Scenario`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from inspect import isfunction, signature
from pathlib import Path
from typing import Any

import numpy as np

from ..numerics import FloatArray, IntArray
from .prediction import Blocks, Prediction, Tables
from .scenario import Scenario, Transition
from .spaces import real_copy

REQUIRED = ("agents", "state_space", "action_set", "reset", "step")
"""Required members of a scenario."""
DECLARED = (
    "agents",
    "state_space",
    "action_set",
    "measures",
    "interactions",
    "horizon",
    "repeats",
    "recorded",
    "groups",
    "roles",
    "bounds",
)
"""Attributes that describe a scenario."""
MISSING = object()
"""Default that marks a missing member."""


def offered(thing: object, name: str, otherwise: Any = None) -> Any:
    """Return a member of a user's object, or a default."""
    return getattr(thing, name, otherwise)


def decides(thing: object) -> bool:
    """Return whether a user's function decides for agents.

    >>> decides(lambda observation, received, rng: 0), decides(lambda rules, rows: 0)
    (True, False)
    """
    if not isfunction(thing):
        return False
    return bool({"observation", "observations"} & signature(thing).parameters.keys())


def as_scenario(thing: object) -> Scenario:
    """Return an object as a scenario, with an adapter if it does not inherit from `Scenario`.

    Raises
    ------
    ValueError
        If it lacks a required member; one line.
    """
    missing = ", ".join(name for name in REQUIRED if offered(thing, name) is None)
    if missing:
        hint = ""
        if offered(thing, "action_space") is not None:
            kind = "gymnasium" if offered(thing, "possible_agents") is None else "pettingzoo"
            hint = f"; a spec names it by scenario.id, with scenario.kind = {kind!r}"
        raise ValueError(f"scenario.kind: {type(thing).__name__} lacks {missing}{hint}")
    return thing if isinstance(thing, Scenario) else PlainScenario(thing)


def as_prediction(thing: Any) -> Prediction | None:
    """Return an object as a prediction, with an adapter if it does not inherit from it."""
    if thing is None or isinstance(thing, Prediction):
        return thing
    return PlainPrediction(thing)


class PlainScenario(Scenario):
    """Adapter for a scenario that does not inherit from `Scenario`.

    Parameters
    ----------
    plain
        Object with the `REQUIRED` members; its other members are attributes of the adapter, too.
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain
        for name in DECLARED:
            own = offered(plain, name)
            if own is not None:
                setattr(self, name, own)

    def __getattr__(self, name: str) -> Any:
        """Return a member of the user's object."""
        if name == "plain":  # missing while an object is copied or unpickled
            raise AttributeError(name)
        value = offered(self.plain, name, MISSING)
        if value is MISSING:
            raise AttributeError(name)
        return value

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode and return states ``(n, d)``."""
        states: FloatArray = self.plain.reset(seed, episode)
        return states

    def step(self, joint_action: IntArray) -> Transition:
        """Execute a joint action ``(n,)``."""
        transition: Transition = self.plain.step(joint_action)
        return transition

    @property
    def predicts(self) -> bool:
        """Whether the user's object has a method `predict`."""
        return offered(self.plain, "predict") is not None

    @property
    def lacks_prediction(self) -> str:
        """Reason why the scenario has no prediction."""
        unnamed = f"the scenario {type(self.plain).__name__} has no method predict"
        return str(offered(self.plain, "lacks_prediction", unnamed))

    def predict(self) -> Prediction | None:
        """Return the prediction of the user's object."""
        return as_prediction(self.plain.predict()) if self.predicts else None

    def with_exact_prediction(self) -> Scenario | None:
        """Return the user's scenario with exact predictions, if there is one."""
        method = offered(self.plain, "with_exact_prediction")
        if method is None:
            return None
        exact = method()
        return self if exact is self.plain else as_scenario(exact)

    def partners(self) -> Sequence[int] | None:
        """Return the mirror image of every agent, if the user's object defines it."""
        method = offered(self.plain, "partners")
        return None if method is None else method()

    def measure(self) -> Mapping[str, Any]:
        """Return the measurements of the present state, if the user's object has them."""
        method = offered(self.plain, "measure")
        return {} if method is None else method()

    def constants_of_episode(self) -> Mapping[str, Any]:
        """Return recorded constants of the episode, if the user's object has them."""
        method = offered(self.plain, "constants_of_episode")
        return {} if method is None else method()

    @property
    def draws(self) -> bool:
        """Whether the user's object can animate recordings."""
        return bool(self.recorded) and offered(self.plain, "animate") is not None

    def animate(self, recording: Mapping[str, Any], path: Path) -> None:
        """Write an animation."""
        if not self.draws:
            super().animate(recording, path)
        self.plain.animate(recording, path)


class PlainPrediction(Prediction, Tables):
    """Adapter for a prediction that does not inherit from `Prediction`.

    Parameters
    ----------
    plain
        Object with ``states(agent, joint_actions)``, and optionally the other methods of
        `Prediction` and `Tables`.
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain
        self._has_tables = offered(plain, "blocks") is not None
        self.alike = offered(plain, "alike", None)

    @property
    def rewarded(self) -> bool:  # type: ignore[override]  # depends on the object
        """Whether there is a table of rewards."""
        return offered(self.plain, "reward_table") is not None

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent`."""
        return real_copy(self.plain.states(agent, joint_actions), "predicted states")

    def states_by_group(self, joint_actions: IntArray) -> tuple[FloatArray, FloatArray] | None:
        """Return own and shared variables, if the user's object has the method."""
        method = offered(self.plain, "states_by_group", None)
        if method is None or (parts := method(joint_actions)) is None:
            return None
        own, shared = parts
        return real_copy(own, "predicted states"), real_copy(shared, "predicted states")

    def rewards(self, joint_actions: IntArray) -> FloatArray | None:
        """Return rewards, if the user's object predicts them."""
        method = offered(self.plain, "rewards", None)
        if method is None or (rewards := method(joint_actions)) is None:
            return None
        return real_copy(rewards, "predicted rewards")

    def after(self, joint_action: IntArray) -> Prediction | None:
        """Return the prediction from the states after a joint action, if there is one."""
        method = offered(self.plain, "after", None)
        return None if method is None else as_prediction(method(joint_action))

    def tables(self) -> Tables | None:
        """Return tables, if the user's object has them."""
        return self if self._has_tables else None

    def blocks(self, agent: int) -> Blocks:
        """Return the next states of an agent for all joint actions."""
        blocks: Blocks = self.plain.blocks(agent)
        return blocks

    def reward_table(self) -> FloatArray:
        """Return the rewards of all joint actions."""
        return real_copy(self.plain.reward_table(), "predicted rewards")
