"""The door for plain classes of users: scenarios and predictions that inherit nothing of ours.

What they may have is asked for by name here, once, and nowhere else. Bodies that are open to
self-models inherit `Scenario`.
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

NECESSARY = ("agents", "state_space", "action_set", "reset", "step")
"""What a scenario cannot do without."""
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
"""What a scenario says of itself."""
MISSING = object()
"""What an object has not."""


def offered(thing: object, name: str, otherwise: Any = None) -> Any:
    """Return what an object of a user has by a name, or something else if it has not."""
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
    """Return a scenario: the thing itself if it is one, else one that plays it.

    Raises
    ------
    ValueError
        If the thing lacks what is necessary; one line.
    """
    missing = ", ".join(name for name in NECESSARY if offered(thing, name) is None)
    if missing:
        hint = ""
        if offered(thing, "action_space") is not None:
            kind = "gymnasium" if offered(thing, "possible_agents") is None else "pettingzoo"
            hint = f"; a spec names it by scenario.id, with scenario.kind = {kind!r}"
        raise ValueError(f"scenario.kind: {type(thing).__name__} lacks {missing}{hint}")
    return thing if isinstance(thing, Scenario) else PlainScenario(thing)


def as_prediction(thing: Any) -> Prediction | None:
    """Return a prediction: the thing itself if it is one, else one that asks it."""
    if thing is None or isinstance(thing, Prediction):
        return thing
    return PlainPrediction(thing)


class PlainScenario(Scenario):
    """A scenario of a user's plain class.

    Parameters
    ----------
    plain
        An object that has what is `NECESSARY`; whatever else it has can be reached through this.
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain
        for name in DECLARED:
            own = offered(plain, name)
            if own is not None:
                setattr(self, name, own)

    def __getattr__(self, name: str) -> Any:
        """Return what the user's object has by this name."""
        if name == "plain":  # not there yet: an object that is being copied or unpickled
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
        """Carry out a joint action ``(n,)``."""
        transition: Transition = self.plain.step(joint_action)
        return transition

    @property
    def predicts(self) -> bool:
        """Whether the user's object has a method predict."""
        return offered(self.plain, "predict") is not None

    @property
    def lacks_prediction(self) -> str:
        """Why it predicts nothing, in the user's words if there are any."""
        unnamed = f"the scenario {type(self.plain).__name__} has no method predict"
        return str(offered(self.plain, "lacks_prediction", unnamed))

    def predict(self) -> Prediction | None:
        """Return the prediction of the user's object."""
        return as_prediction(self.plain.predict()) if self.predicts else None

    def with_exact_prediction(self) -> Scenario | None:
        """Return the user's exactly predicting scenario, if there is one."""
        own_way = offered(self.plain, "with_exact_prediction")
        if own_way is None:
            return None
        exact = own_way()
        return self if exact is self.plain else as_scenario(exact)

    def partners(self) -> Sequence[int] | None:
        """Return who stands in whose place in the mirror, if the user's object knows."""
        own_way = offered(self.plain, "partners")
        return None if own_way is None else own_way()

    def measure(self) -> Mapping[str, Any]:
        """Return the measurements of the present state, if the user's object takes them."""
        own_way = offered(self.plain, "measure")
        return {} if own_way is None else own_way()

    def constants_of_episode(self) -> Mapping[str, Any]:
        """Return what the user's object keeps once an episode."""
        own_way = offered(self.plain, "constants_of_episode")
        return {} if own_way is None else own_way()

    @property
    def draws(self) -> bool:
        """Whether the user's object draws recordings."""
        return bool(self.recorded) and offered(self.plain, "animate") is not None

    def animate(self, recording: Mapping[str, Any], path: Path) -> None:
        """Let the user's object draw a recording."""
        if not self.draws:
            super().animate(recording, path)
        self.plain.animate(recording, path)


class PlainPrediction(Prediction, Tables):
    """A prediction of a user's plain class.

    Parameters
    ----------
    plain
        An object that has ``states(agent, joint_actions)``, and perhaps methods of the names that
        `Prediction` and `Tables` have.
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain
        self._has_tables = offered(plain, "blocks") is not None
        self.alike = offered(plain, "alike", None)

    @property
    def rewarded(self) -> bool:  # type: ignore[override]  # of users' classes it is not known before
        """Whether there is a table of rewards."""
        return offered(self.plain, "reward_table") is not None

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent`."""
        return real_copy(self.plain.states(agent, joint_actions), "predicted states")

    def states_by_group(self, joint_actions: IntArray) -> tuple[FloatArray, FloatArray] | None:
        """Return own and shared variables of all, if the user's object knows a way."""
        own_way = offered(self.plain, "states_by_group", None)
        if own_way is None or (parts := own_way(joint_actions)) is None:
            return None
        own, shared = parts
        return real_copy(own, "predicted states"), real_copy(shared, "predicted states")

    def rewards(self, joint_actions: IntArray) -> FloatArray | None:
        """Return rewards, if the user's object predicts them."""
        own_way = offered(self.plain, "rewards", None)
        if own_way is None or (rewards := own_way(joint_actions)) is None:
            return None
        return real_copy(rewards, "predicted rewards")

    def after(self, joint_action: IntArray) -> Prediction | None:
        """Return the prediction from where a joint action leads, if it goes on."""
        own_way = offered(self.plain, "after", None)
        return None if own_way is None else as_prediction(own_way(joint_action))

    def tables(self) -> Tables | None:
        """Return its tables, if it has such."""
        return self if self._has_tables else None

    def blocks(self, agent: int) -> Blocks:
        """Return the next states of an agent for all joint actions."""
        blocks: Blocks = self.plain.blocks(agent)
        return blocks

    def reward_table(self) -> FloatArray:
        """Return the rewards of all joint actions."""
        return real_copy(self.plain.reward_table(), "predicted rewards")
