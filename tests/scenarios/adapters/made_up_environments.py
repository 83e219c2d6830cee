"""Small environments of PettingZoo and Gymnasium, each with a trait that gave trouble elsewhere."""

from __future__ import annotations

import sys
from collections import OrderedDict
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict, Discrete
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils import AgentSelector

LENGTH = 10
"""Steps of an episode."""


class Walkers(ParallelEnv[Any, Any, Any]):
    """Walkers on a line, who see where they are and the time; they are truncated at the end."""

    metadata = {"name": "walkers", "render_modes": []}  # noqa: RUF012 - as PettingZoo has it
    ids: tuple[Any, ...] = ("agent_0", "agent_1")

    def __init__(self, render_mode: str | None = None) -> None:
        self.possible_agents = list(self.ids)
        self.render_mode = render_mode

    def observation_space(self, agent: Any) -> Any:
        return Box(-1.0, 1.0, (2,), np.float64)

    def action_space(self, agent: Any) -> Any:
        return Discrete(3)

    def look(self, agent: Any) -> Any:
        return np.array([self.x[agent], self.t / LENGTH])

    def pay(self, agent: Any) -> Any:
        return -abs(self.x[agent])

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        rng = np.random.default_rng(seed)
        self.agents = list(self.ids)
        self.x = {agent: rng.uniform(-0.5, 0.5) for agent in self.agents}
        self.t = 0
        return {agent: self.look(agent) for agent in self.agents}, {a: {} for a in self.agents}

    def step(self, actions: Any) -> Any:
        self.t += 1
        acting = list(self.agents)
        for agent, action in actions.items():
            self.x[agent] = float(np.clip(self.x[agent] + 0.1 * (int(action) - 1), -1, 1))
        is_over = self.t >= LENGTH
        if is_over:
            self.agents = []
        return (
            {agent: self.look(agent) for agent in acting},
            {agent: self.pay(agent) for agent in acting},
            dict.fromkeys(acting, False),
            dict.fromkeys(acting, is_over),
            {agent: {} for agent in acting},
        )


class Wide(Walkers):
    """The second walker sees numbers ten times as large, as its space says."""

    def observation_space(self, agent: Any) -> Any:
        most = 1.0 if agent == "agent_0" else 10.0
        return Box(-most, most, (2,), np.float64)

    def look(self, agent: Any) -> Any:
        return super().look(agent) * (1.0 if agent == "agent_0" else 10.0)


class WideUnsaid(Wide):
    """As before, and the spaces give no bounds."""

    def observation_space(self, agent: Any) -> Any:
        return Box(-np.inf, np.inf, (2,), np.float64)


class Keyed(Walkers):
    """Walkers see tables of the same keys, each in another order."""

    def parts(self, agent: Any) -> list[tuple[str, Any]]:
        parts = [("place", Box(-1.0, 1.0, (), np.float64)), ("time", Box(0.0, 1.0, (1,)))]
        return parts if agent == "agent_0" else parts[::-1]

    def observation_space(self, agent: Any) -> Any:
        return Dict(OrderedDict(self.parts(agent)))

    def look(self, agent: Any) -> Any:
        return {"time": np.array([self.t / LENGTH]), "place": np.array(self.x[agent])}


class KeyedApart(Keyed):
    """The second walker has another key in place of one."""

    def parts(self, agent: Any) -> list[tuple[str, Any]]:
        parts = super().parts(agent)
        return parts if agent == "agent_0" else [("hour", parts[0][1]), parts[1]]


class Lacking(Keyed):
    """What is seen lacks a key at some step."""

    def look(self, agent: Any) -> Any:
        seen = super().look(agent)
        if self.t == 2:
            del seen["time"]
        return seen


class Blind(Walkers):
    """What is seen is once not a number."""

    def look(self, agent: Any) -> Any:
        seen = super().look(agent)
        if self.t == 4 and agent == "agent_1":
            seen[1] = np.nan
        return seen


class BlindUnsaid(Blind):
    """As before, and the spaces give no bounds."""

    def observation_space(self, agent: Any) -> Any:
        return Box(-np.inf, np.inf, (2,), np.float64)


class MixedEnd(Walkers):
    """At step 5 one walker terminates and the other is truncated; both stay listed."""

    def step(self, actions: Any) -> Any:
        if self.t >= 5:
            raise RuntimeError("a step after the end")
        observed, rewards, terminated, truncated, infos = super().step(actions)
        if self.t == 5:
            terminated["agent_0"] = True
            truncated["agent_1"] = True
        return observed, rewards, terminated, truncated, infos


class EndsApart(Walkers):
    """One walker terminates at step 2 and the other at step 4; both stay listed."""

    def step(self, actions: Any) -> Any:
        observed, rewards, terminated, truncated, infos = super().step(actions)
        terminated["agent_0"] = self.t == 2
        terminated["agent_1"] = self.t == 4
        return observed, rewards, terminated, truncated, infos


class StrayEnd(Walkers):
    """Terminations name an agent that nobody knows."""

    def step(self, actions: Any) -> Any:
        observed, paid, ends, *rest = super().step(actions)
        return observed, paid, {**ends, "agent_2": False}, *rest


class Numbered(Walkers):
    """Ids are numbers, and 0 is one."""

    ids = (0, 1, 2)


class Unnamed(Walkers):
    """Ids are texts, and the empty one is one."""

    ids = ("", "other")


class Ambiguous(Walkers):
    """Two ids are shown alike."""

    ids = (1, "1")


class Late(Walkers):
    """The second walker is not there at the start."""

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        observed, infos = super().reset(seed)
        self.agents = ["agent_0"]
        return {"agent_0": observed["agent_0"]}, infos


class LateButSeeing(Walkers):
    """The second walker observes from the start, and acts from step 3 on."""

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        observed, infos = super().reset(seed)
        self.agents = ["agent_0"]
        return observed, infos

    def step(self, actions: Any) -> Any:
        assert set(actions) == set(self.agents)
        result = super().step(actions)
        if self.t == 2:
            self.agents = ["agent_0", "agent_1"]
        return result


class Uninvited(Walkers):
    """A walker comes who is none of the possible ones."""

    def step(self, actions: Any) -> Any:
        result = super().step(actions)
        self.agents = ["agent_0", "agent_1", "agent_9"]
        self.x["agent_9"] = 0.0
        return result


class Unseeing(Walkers):
    """A walker who acts observes nothing after a step."""

    def step(self, actions: Any) -> Any:
        result = super().step(actions)
        if self.t == 3:
            del result[0]["agent_1"]
        return result


class Unpaid(Walkers):
    """A walker who acts is missing in the rewards."""

    def step(self, actions: Any) -> Any:
        result = super().step(actions)
        del result[1]["agent_1"]
        return result


class Nameless(Walkers):
    """Nobody says who may act."""

    def __init__(self) -> None:
        self.render_mode = None


class Masked(Walkers):
    """Observations say which actions are legal."""

    def observation_space(self, agent: Any) -> Any:
        seen = super().observation_space(agent)
        return Dict({"observation": seen, "action_mask": Box(0, 1, (3,), np.int8)})

    def look(self, agent: Any) -> Any:
        return {"observation": super().look(agent), "action_mask": np.ones(3, np.int8)}


class MaskedBeside(Walkers):
    """Infos say which actions are legal."""

    def step(self, actions: Any) -> Any:
        result = super().step(actions)
        return (*result[:4], {agent: {"action_mask": np.ones(3, np.int8)} for agent in actions})


class PaidInArrays(Walkers):
    """Rewards are arrays of one number."""

    def pay(self, agent: Any) -> Any:
        return np.array([super().pay(agent)], np.float32)


class PaidTwice(Walkers):
    """Rewards are arrays of two numbers."""

    def pay(self, agent: Any) -> Any:
        return np.zeros(2)


class PaidNothing(Walkers):
    """A reward is once not a number."""

    def pay(self, agent: Any) -> Any:
        return np.nan if self.t == 3 else 0.0


class OldParallel(Walkers):
    """A step returns four tables."""

    def step(self, actions: Any) -> Any:
        observed, rewards, _, truncated, infos = super().step(actions)
        return observed, rewards, truncated, infos


class OldParallelStart(Walkers):
    """The start returns observations alone."""

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        return super().reset(seed)[0]


class Outside(Walkers):
    """What is seen leaves the bounds that the spaces give."""

    def look(self, agent: Any) -> Any:
        return super().look(agent) * 50


class Chosen(Walkers):
    """What is seen is a choice, and once none of those that there are."""

    def observation_space(self, agent: Any) -> Any:
        return Dict({"side": Discrete(2)})

    def look(self, agent: Any) -> Any:
        return {"side": -1 if self.t == 3 else int(self.x[agent] > 0)}


class Truncating(Walkers):
    """The space has whole numbers, and what is seen are fractions."""

    def observation_space(self, agent: Any) -> Any:
        return Box(-1, 1, (2,), np.int8)


class Reusing(Walkers):
    """Hands out the same array at every step, and to all."""

    def __init__(self) -> None:
        super().__init__()
        self.buffers = {agent: np.zeros(2) for agent in self.ids}

    def look(self, agent: Any) -> Any:
        self.buffers[agent][:] = super().look(agent)
        return self.buffers[agent]


class ReusingAfterwards(Reusing):
    """The first walker leaves after step 3; its array is written to by and by."""

    def step(self, actions: Any) -> Any:
        observed, rewards, terminated, truncated, infos = super().step(actions)
        if self.t == 3:
            terminated["agent_0"] = True
            self.agents = ["agent_1"]
        elif self.t > 3:
            self.buffers["agent_0"][:] = 99.0
        return observed, rewards, terminated, truncated, infos


class Huge(Walkers):
    """Bounds that are none, as some spaces have them; and actions of such."""

    def observation_space(self, agent: Any) -> Any:
        return Box(-3e38, 3e38, (2,), np.float32)


class HugeActions(Walkers):
    """Actions between bounds that are none."""

    def action_space(self, agent: Any) -> Any:
        return Box(-3e38, 3e38, (1,), np.float32)


class Leaving(Walkers):
    """Ends the process that plays it."""

    def step(self, actions: Any) -> Any:
        sys.exit(0)


class Ordering(Walkers):
    """Has an id, and says words, that a terminal obeys."""

    ids = ("\x1b[31m", "b")

    def step(self, actions: Any) -> Any:
        raise RuntimeError("\x1b[2J")


class Turns(AECEnv[Any, Any, Any]):
    """Two walkers that take turns and move together after the last turn."""

    metadata = {"name": "turns", "render_modes": [], "is_parallelizable": True}  # noqa: RUF012

    def __init__(self) -> None:
        self.possible_agents = ["first", "second"]
        self.render_mode = None

    def observation_space(self, agent: Any) -> Any:
        return Box(-1.0, 1.0, (1,), np.float64)

    def action_space(self, agent: Any) -> Any:
        return Discrete(3)

    def observe(self, agent: Any) -> Any:
        return np.array([self.x[agent]])

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        rng = np.random.default_rng(seed)
        self.agents = ["first", "second"]
        self.x = {agent: rng.uniform(-0.5, 0.5) for agent in self.agents}
        self.t = 0
        self.rewards = dict.fromkeys(self.agents, 0.0)
        self._cumulative_rewards = dict(self.rewards)
        self.terminations = dict.fromkeys(self.agents, False)
        self.truncations = dict.fromkeys(self.agents, False)
        self.infos = {agent: {} for agent in self.agents}
        self.selector = AgentSelector(self.agents)
        self.agent_selection = self.selector.next()
        self.chosen: dict[Any, int] = {}

    def step(self, action: Any) -> Any:
        agent = self.agent_selection
        if self.terminations[agent] or self.truncations[agent]:
            self._was_dead_step(action)
            return
        self.chosen[agent] = action
        self.rewards = dict.fromkeys(self.agents, 0.0)
        if self.selector.is_last():
            self.t += 1
            for one, move in self.chosen.items():
                self.x[one] = float(np.clip(self.x[one] + 0.1 * (move - 1), -1, 1))
                self.rewards[one] = 1.0 + self.possible_agents.index(one)
            self.truncations = dict.fromkeys(self.agents, self.t >= LENGTH)
        self.agent_selection = self.selector.next()


class NumberedTurns(Turns):
    """Its players are numbered, which PettingZoo cannot make parallel."""

    def __init__(self) -> None:
        super().__init__()
        self.possible_agents = [0, 1]


class Cart(gymnasium.Env[Any, Any]):
    """A cart on a line, which sees where it is and the time."""

    metadata = {"render_modes": []}  # noqa: RUF012
    observation_space: Any = Box(-1.0, 1.0, (2,), np.float64)
    action_space: Any = Discrete(3)

    def __init__(self, render_mode: str | None = None) -> None:
        self.render_mode = render_mode

    def look(self) -> Any:
        return np.array([self.x, self.t / LENGTH])

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        super().reset(seed=seed)
        self.t = 0
        self.x = self.np_random.uniform(-0.5, 0.5)
        return self.look(), {}

    def step(self, action: Any) -> Any:
        self.t += 1
        self.x = float(np.clip(self.x + 0.1 * (int(action) - 1), -1, 1))
        return self.look(), -abs(self.x), abs(self.x) < 0.05, self.t >= LENGTH, {}


class OldCart(Cart):
    """A step returns four things."""

    def step(self, action: Any) -> Any:
        observed, reward, terminated, truncated, info = super().step(action)
        return observed, reward, terminated or truncated, info


class OldStartCart(Cart):
    """The start returns what is observed alone."""

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        return super().reset(seed=seed)[0]


class CartPaidInArrays(Cart):
    """The reward is an array of one number."""

    def step(self, action: Any) -> Any:
        observed, reward, *rest = super().step(action)
        return observed, np.array([[reward]]), *rest


class UndecidedCart(Cart):
    """Whether it has terminated is not said."""

    def step(self, action: Any) -> Any:
        observed, reward, _, *rest = super().step(action)
        return observed, reward, None, *rest
