"""Environments of Gymnasium and PettingZoo in one form: players that act and observe.

A player acts and observes: the one of Gymnasium, an agent of PettingZoo. Its identity may be of any
type that a table can have as a key. Who has left an episode before its end observes what it last
observed, and is paid nothing. An episode ends when each of those who act has terminated or has been
truncated, or the key `ALL` of terminations or truncations says so.

What an environment returns is checked here once, step by step, so that nothing is read where it is
not: who must observe does, a reward is one finite number, an ending is true or false.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable, Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils.conversions import aec_to_parallel_wrapper

from ...core.plugins.printing import printable

Player = Hashable
"""Who acts and observes: `ONLY`, or the id of an agent of PettingZoo."""
Space = gymnasium.Space[Any]
Environment = Any
"""Of Gymnasium or PettingZoo, or somebody's that is used alike."""
Observations = Mapping[Player, object]
TABLES = ("observations", "rewards", "terminations", "truncations", "infos")
"""What a step of a parallel environment returns, in order, each by player."""
MASKS = ("action_mask", "action_masks", "avail_actions", "available_actions", "legal_moves")
"""Keys under which environments say which actions are legal."""


ALL = "__all__"
"""Key of terminations and truncations that stands for all agents, a convention of RLlib."""


@dataclass(frozen=True)
class OnlyPlayer:
    """The player of an environment of Gymnasium, which has no name there."""

    def __str__(self) -> str:
        return ""


ONLY = OnlyPlayer()


def of_player(what: str, player: Player) -> str:
    """Return what a player has, in words.

    Examples
    --------
    >>> of_player("observations", ONLY), of_player("reward", 0), of_player("reward", "")
    ('observations', 'reward of 0', "reward of ''")
    """
    return what if player == ONLY else f"{what} of {printable(str(player)) or repr(player)}"


def at(step: int) -> str:
    """Return when in an episode a step is, in words."""
    return "at the start" if step == 0 else f"at step {step}"


class Played(NamedTuple):
    """What an environment told at the start of an episode or after a step, by player."""

    observations: Observations
    rewards: Mapping[Player, float]
    """Of all players, after a step."""
    terminated: bool
    truncated: bool
    step: int
    """Steps since the start."""

    @property
    def is_over(self) -> bool:
        """Whether the episode has ended."""
        return self.terminated or self.truncated


class Simulator(ABC):
    """An environment that players act in.

    Its methods raise a `ValueError` of one line where an environment returns what none may return.
    """

    env: Environment
    """The environment; `reset` and `step` modify it."""
    players: tuple[Player, ...]
    """All who may act in it."""
    observation_spaces: Mapping[Player, Space]
    action_spaces: Mapping[Player, Space]

    @abstractmethod
    def reset(self, seed: int) -> Played:
        """Start an episode."""

    @abstractmethod
    def step(self, actions: Mapping[Player, object]) -> Played:
        """Carry out the actions of those who are still there for one step."""


class GymnasiumSimulator(Simulator):
    """An environment of Gymnasium, of one player.

    Parameters
    ----------
    env
        The environment; `reset` and `step` modify it.
    """

    def __init__(self, env: Environment) -> None:
        self.env = env
        self.players = (ONLY,)
        self.observation_spaces = {ONLY: env.observation_space}
        self.action_spaces = {ONLY: env.action_space}
        self._step = 0

    def reset(self, seed: int) -> Played:
        """Start an episode."""
        observed, _ = _parts_of_reset(self.env.reset(seed=seed))
        self._step = 0
        return Played({ONLY: observed}, {}, False, False, 0)

    def step(self, actions: Mapping[Player, object]) -> Played:
        """Carry out an action for one step."""
        parts = _parts_of_step(self.env.step(actions[ONLY]))
        observed, reward, terminated, truncated, _ = parts
        self._step += 1
        return Played(
            {ONLY: observed},
            {ONLY: _number(reward, f"reward {at(self._step)}")},
            _flag(terminated, f"terminated {at(self._step)}"),
            _flag(truncated, f"truncated {at(self._step)}"),
            self._step,
        )


class ParallelSimulator(Simulator):
    """A parallel environment of PettingZoo.

    Parameters
    ----------
    env
        The environment; `reset` and `step` modify it.

    Raises
    ------
    ValueError
        If it does not say who may act; one line.
    """

    def __init__(self, env: Environment) -> None:
        self.env = env
        self.players = _possible_agents(env)
        self.observation_spaces = {p: env.observation_space(p) for p in self.players}
        self.action_spaces = {p: env.action_space(p) for p in self.players}
        self._step = 0
        # What follows is replaced, never changed: copies of a simulator may share it.
        self._observed: Observations = {}
        self._terminated: frozenset[Player] = frozenset()
        self._ended: frozenset[Player] = frozenset()

    def reset(self, seed: int) -> Played:
        """Start an episode."""
        observed, infos = _parts_of_reset(self.env.reset(seed=seed))
        observations = _table(observed, "reset returns observations")
        _refuse_masks(_table(infos, "reset returns infos"))
        for player in self.players:
            if player not in observations:
                raise ValueError(
                    f"{player!r} observes nothing at the start, allowed: environments in which all "
                    "possible_agents are there; wrap it so that reset returns what each observes"
                )
        self._check_known(observations)
        self._step = 0
        self._observed = {player: observations[player] for player in self.players}
        self._terminated = frozenset()
        self._ended = frozenset()
        return Played(self._observed, {}, False, False, 0)

    def step(self, actions: Mapping[Player, object]) -> Played:
        """Carry out the actions of those who are still there for one step."""
        acting = tuple(self.env.agents)
        self._check_known(acting)
        parts = _parts_of_step(self.env.step({player: actions[player] for player in acting}))
        self._step += 1
        tables = {
            name: _table(part, f"step returns {name}")
            for name, part in zip(TABLES, parts, strict=True)
        }
        observed = tables["observations"]
        self._check_known(observed)
        _refuse_masks(tables["infos"])
        for name in ("terminations", "truncations"):
            tables[name] = flags_by_agent(tables[name], set(self.players) - self._ended)
        for name in ("rewards", "terminations", "truncations"):
            self._check_known(tables[name], f" in {name}")
        asked = [player for player in acting if player not in self._ended]
        self._check_told(asked, tables, ("rewards", "terminations", "truncations"))
        self._terminated |= self._flagged("terminated", tables["terminations"])
        self._ended |= self._terminated | self._flagged("truncated", tables["truncations"])
        going_on = [player for player in asked if player not in self._ended]
        self._check_told(going_on, tables, ("observations",))
        # What those observed last who have ended is kept as it is now.
        last = {player: deepcopy(observed[player]) for player in self._ended & observed.keys()}
        self._observed = {**self._observed, **observed, **last}
        paid = {player: self._paid(player, tables["rewards"]) for player in self.players}
        present = frozenset(self.env.agents)
        anew = present.difference(acting)  # who enters has not ended
        self._terminated -= anew
        self._ended -= anew
        is_over = self._ended >= present
        has_terminated = is_over and self._terminated.issuperset(self.players)
        is_cut = is_over and not has_terminated
        return Played(self._observed, paid, has_terminated, is_cut, self._step)

    def _check_known(self, players: Iterable[Player], where: str = "") -> None:
        for player in players:
            if player not in self.observation_spaces:
                raise ValueError(f"{player!r}{where} {at(self._step)} is none of possible_agents")

    def _check_told(
        self,
        players: Iterable[Player],
        tables: Mapping[str, Mapping[Player, object]],
        names: Iterable[str],
    ) -> None:
        """Refuse that players who act are missing in some tables of a step."""
        for player, name in product(players, names):
            if player not in tables[name]:
                raise ValueError(f"{player!r} acts, and {name} {at(self._step)} do not have it")

    def _flagged(self, what: str, flags: Mapping[Player, object]) -> frozenset[Player]:
        """Return of whom a table of flags says that it is so."""
        known = (player for player in self.players if player in flags)
        return frozenset(p for p in known if _flag(flags[p], self._of(what, p)))

    def _paid(self, player: Player, rewards: Mapping[Player, object]) -> float:
        if player not in rewards:
            return 0.0
        return _number(rewards[player], self._of("reward", player))

    def _of(self, what: str, player: Player) -> str:
        return f"{of_player(what, player)} {at(self._step)}"


def flags_by_agent(flags: Mapping[Player, object], agents: Iterable[Player]) -> dict[Player, Any]:
    """Return terminations or truncations by agent, without the key `ALL`.

    Parameters
    ----------
    flags
        By agent. `ALL` may stand beside them, or alone: if it is true, it overrides the flags of
        all `agents`; if it is false, the agents without a flag go on.
    agents
        Those who have not ended before.

    Examples
    --------
    >>> flags_by_agent({"a": False, "__all__": True}, ["a", "b"])
    {'a': True, 'b': True}
    """
    own = dict(flags)
    if ALL not in own or ALL in (agents := list(agents)):
        return own
    everyone = dict.fromkeys(agents, own.pop(ALL))
    return own | everyone if _flag(flags[ALL], ALL) else everyone | own


class TurnsAtOnce(aec_to_parallel_wrapper[Any, Any, Any]):
    """An environment whose agents take turns, in which all act at once; ids are of any type.

    PettingZoo's own conversion takes ids that are text alone.
    """

    def reset(self, seed: int | None = None, options: object = None) -> tuple[object, object]:
        """Start an episode; return observations and infos."""
        env = self.aec_env
        env.reset(seed=seed, options=options)
        self.agents = list(env.agents)
        return {agent: env.observe(agent) for agent in self.agents}, dict(env.infos)

    def step(self, actions: Mapping[Player, object]) -> tuple[object, ...]:
        """Let each agent take its turn; return what all are told after the last."""
        env = self.aec_env
        rewards: dict[Player, float] = {}
        for agent in list(env.agents):
            if env.agent_selection != agent:
                raise ValueError(
                    f"it is the turn of {env.agent_selection!r} where {agent!r} is next, allowed: "
                    "agents that act in a cycle and leave at its end"
                )
            env.step(actions[agent])
            for paid in env.agents:
                rewards[paid] = rewards.get(paid, 0) + env.rewards[paid]
        terminated = dict(env.terminations)
        truncated = dict(env.truncations)
        infos = dict(env.infos)
        observed = {agent: env.observe(agent) for agent in env.agents}
        while env.agents and self._has_ended(env.agent_selection):
            env.step(None)
        self.agents = list(env.agents)
        return observed, rewards, terminated, truncated, infos

    def _has_ended(self, agent: Player) -> bool:
        return bool(self.aec_env.terminations[agent] or self.aec_env.truncations[agent])


def simulator_of(env: object) -> Simulator:
    """Return the simulator of an environment of Gymnasium, or of PettingZoo, parallel or not.

    Raises
    ------
    ValueError
        If it is none, or many at once, or its agents do not act in cycles, as those of board games.
    """
    if isinstance(env, gymnasium.vector.VectorEnv):
        raise ValueError("is a vector of environments, allowed: one")
    if isinstance(env, AECEnv):
        if not (env.metadata or {}).get("is_parallelizable", False):
            raise ValueError("its agents act in turns, allowed: those that act at the same time")
        return ParallelSimulator(TurnsAtOnce(env))
    if isinstance(env, ParallelEnv) or hasattr(env, "possible_agents"):
        return ParallelSimulator(env)
    if not (hasattr(env, "observation_space") and hasattr(env, "step")):
        raise ValueError(f"is {type(env).__name__}, allowed: environments of Gymnasium, PettingZoo")
    return GymnasiumSimulator(env)


def _possible_agents(env: object) -> tuple[Player, ...]:
    """Return who may act in an environment."""
    players = tuple(getattr(env, "possible_agents", None) or ())
    if not players:
        raise ValueError(
            "possible_agents is missing or empty: let __init__ set it to a list of all agents that "
            "may ever act"
        )
    return players


def _parts_of_reset(returned: object) -> tuple[object, object]:
    """Return what is observed and infos, or refuse what `reset` returned."""
    if isinstance(returned, tuple | list) and len(returned) == 2:
        observed, infos = returned
        if isinstance(infos, Mapping):
            return observed, infos
    raise ValueError(
        "reset returns no pair of what is observed and infos: the old interface, before Gymnasium "
        "0.26 and PettingZoo 1.23; let it return both"
    )


def _parts_of_step(returned: object) -> tuple[object, ...]:
    """Return what is observed, rewards, whether terminated, truncated, and infos, or refuse."""
    if isinstance(returned, tuple | list) and len(returned) == 5:
        return tuple(returned)
    count = len(returned) if isinstance(returned, tuple | list) else 1
    old = ": the old interface, before Gymnasium 0.26 and PettingZoo 1.23" if count == 4 else ""
    raise ValueError(
        f"step returns {count} values{old}; allowed: 5, what is observed, reward, whether "
        "terminated, whether truncated, info"
    )


def _table(part: object, what: str) -> Mapping[Player, object]:
    if not isinstance(part, Mapping):
        raise ValueError(f"{what} as {type(part).__name__}, allowed: a dict by agent")
    return part


def _number(value: object, what: str) -> float:
    """Return a reward, which may stand in an array of one number.

    Examples
    --------
    >>> _number(np.array([[2.0]], np.float32), "reward")
    2.0
    """
    array = np.asarray(value)
    if array.size != 1 or array.dtype.kind not in "biuf":
        held = f"of shape {array.shape}" if array.size != 1 else f"= {value!r:.40}"
        raise ValueError(f"{what} {held}, allowed: one number")
    number = float(array.item())
    if not np.isfinite(number):
        raise ValueError(f"{what} is {number}, allowed: a finite number")
    return number


def _flag(value: object, what: str) -> bool:
    array = np.asarray(value)
    if array.size != 1 or array.dtype.kind not in "biuf":
        raise ValueError(f"{what} = {value!r:.40}, allowed: true or false")
    return bool(array.item())


def _refuse_masks(infos: Mapping[Player, object]) -> None:
    """Refuse that infos say which actions are legal."""
    for player, info in infos.items():
        keys = [key for key in MASKS if key in info] if isinstance(info, Mapping) else []
        if keys:
            raise masked(player, f"infos have {keys[0]}")


def masked(player: Player, where: str) -> ValueError:
    """Return the refusal of actions that are not always legal."""
    return ValueError(
        f"{of_player('actions', player)}: {where}, so that some may be illegal, allowed: actions "
        "that are always legal; wrap it so that an illegal one does something legal, and leave "
        "the mask out"
    )
