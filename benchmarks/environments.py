"""Environments of PettingZoo with hostile traits, as `benchmarks.adversary` draws them.

Each environment knows what its players truly see and are paid. The scenario made of it must be
refused in one line, or be right at every step: states, rewards and the end of an episode.
"""

from __future__ import annotations

import random
import traceback
from collections import Counter
from sys import stderr
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete, Space, Text
from pettingzoo import ParallelEnv

from nested_agents.scenarios.adapters.scenario import EnvironmentScenario, from_pettingzoo

LENGTH = 9
"""Steps of an episode; one more than are rehearsed when a scenario is built."""
SEEDS = 3
PLAYERS: dict[str, tuple[Any, ...]] = {
    "two": ("a", "b"), "one": ("a",), "twelve": tuple(f"a_{i}" for i in range(12)),
    "numbers": (1, 0), "empty": ("", "b"), "pairs": (("x", 1), ("x", 2)), "alike": (1, "1"),
    "raw": ("\x1b[31m", "b\n"), "numpy": (np.int64(3), np.int64(4)),
}  # fmt: skip
SEEN = (
    "array", "scales", "unbounded", "huge", "dict", "swapped", "other keys", "number", "counted",
    "bits", "text", "nested", "mask", "sizes", "float32", "no space",
)  # fmt: skip
ACTIONS: dict[str, Space[Any] | None] = {
    "three": Discrete(3), "from -1": Discrete(3, start=-1), "numbers": Box(-1.0, 1.0, (2,)),
    "several": MultiDiscrete([2, 3]), "bits": MultiBinary(2), "text": Text(3), "one": Discrete(1),
    "endless": Box(-np.inf, np.inf, (1,)), "none": None, "huge": Box(-3e38, 3e38, (1,)),
}  # fmt: skip
FAULTS = (
    "nan", "inf", "outside", "same array", "list", "missing player", "unknown player", "nothing",
    "shape", "raises", "exits", "is late", "numbers are text", "after the rehearsal",
)  # fmt: skip
PAID = ("array", "arrays", "scalar", "nothing", "nan", "text", "missing", "bool", "inf")
ENDS = ("mixed", "listed", "dies", "empties", "late", "old", "numpy", "nothing", "at once", "keys")
FACES = ("no possible_agents", "no agents", "no seed", "no infos", "infos None", "no reset")


class Drawn(ParallelEnv[Any, Any, Any]):
    """Two numbers, a place and the time, seen in a hostile way.

    Parameters
    ----------
    traits
        One of each of the lists above, or ``""`` where it is as usual.

    Attributes
    ----------
    truth
        What every player sees, in the order of its names, how it is paid, and whether all ended.
    """

    metadata = {"name": "drawn", "render_modes": []}  # noqa: RUF012

    def __init__(self, traits: dict[str, str]) -> None:
        self.traits = traits
        self.ids = PLAYERS[traits["players"] or "two"]
        self.render_mode = None
        if traits["face"] != "no possible_agents":
            self.possible_agents = list(self.ids)
        if traits["face"] != "no agents":
            self.agents = list(self.ids)
        self.buffers = {a: np.zeros(2) for a in self.ids}
        self.truth: dict[Any, list[float]] = {}
        self.paid: dict[Any, float] = {}
        self.is_over = False

    def observation_space(self, agent: Any) -> Space[Any]:
        """Return what a player may see."""
        is_first, box = agent == self.ids[0], Box(-1.0, 1.0, (), np.float64)
        ends = {"scales": 1.0 if is_first else 50.0, "unbounded": np.inf, "huge": 3e38}
        end = ends.get(self.traits["seen"], 1.0)
        of = {"place": box, "time": box}
        spaces: dict[str, Any] = {
            "dict": Dict(of), "swapped": Dict(of if is_first else dict(reversed(of.items()))),
            "other keys": Dict(of if is_first else {"place": box, "hour": box}),
            "number": Box(-1.0, 1.0, (), np.float64), "counted": Discrete(21, start=-10),
            "bits": MultiBinary(2), "text": Text(5), "nested": Dict({"of": Dict(of)}),
            "mask": Dict({"observation": box, "action_mask": Box(0, 1, (3,), np.int8)}),
            "sizes": Box(-1.0, 1.0, (2 if is_first else 3,), np.float64),
            "float32": Box(-1.0, 1.0, (2,), np.float32), "no space": None,
        }  # fmt: skip
        return spaces.get(self.traits["seen"], Box(-end, end, (2,), np.float64))

    def action_space(self, agent: Any) -> Space[Any]:
        """Return what a player may do."""
        return ACTIONS[self.traits["actions"] or "three"]  # type: ignore[return-value]

    def reset(self, seed: int | None = None, options: object = None) -> Any:
        """Begin an episode."""
        if self.traits["face"] == "no reset":
            raise RuntimeError("two\nlines \x1b[2J")
        self.rng = np.random.default_rng(None if self.traits["face"] == "no seed" else seed)
        self.time, self.agents = 0, list(self.ids)
        self.place = {a: float(self.rng.uniform(-0.9, 0.9)) for a in self.ids}
        if self.traits["ends"] == "late":
            self.agents = self.agents[:1]
        if self.traits["ends"] == "at once":
            self.agents = []
        seen = {a: self.look(a) for a in self.agents}
        return seen if self.traits["face"] == "no infos" else (seen, {a: {} for a in self.agents})

    def look(self, agent: Any) -> Any:
        """Return what a player sees; note what it is."""
        x, t, kind = self.place[agent], self.time / LENGTH, self.traits["seen"]
        scale = 50.0 if kind == "scales" and agent != self.ids[0] else 1.0
        pair = np.array([x, t]) * scale
        counted = round(10 * x)
        bits = np.array([x > 0, self.time % 2], np.int8)
        third = {} if kind == "other keys" and agent != self.ids[0] else {"time": np.array(t)}
        forms: dict[str, tuple[Any, list[float]]] = {
            "dict": ({"time": np.array(t), "place": np.array(x)}, [x, t]),
            "swapped": ({"place": np.array(x), "time": np.array(t)}, [x, t]),
            "other keys": ({"place": x, "hour": t} | third, [x, t]),
            "number": (np.array(x), [x]), "counted": (counted, [float(counted)]),
            "bits": (bits, bits.tolist()), "text": ("words", []),
            "nested": ({"of": {"place": x, "time": t}}, [x, t]),
            "mask": ({"observation": x, "action_mask": np.ones(3, np.int8)}, [x]),
            "sizes": (pair if agent == self.ids[0] else np.append(pair, 0.5), [x, t]),
            "float32": (pair.astype(np.float32), pair.astype(np.float32).tolist()),
        }  # fmt: skip
        seen, self.truth[agent] = forms.get(kind, (pair, pair.tolist()))
        return self.harmed(agent, seen)

    def harmed(self, agent: Any, seen: Any) -> Any:
        """Return what is seen as the fault makes it."""
        fault = self.traits["fault"]
        if fault == "list" and isinstance(seen, np.ndarray):
            return seen.tolist()
        if fault == "same array" and isinstance(seen, np.ndarray) and seen.shape == (2,):
            self.buffers[agent][:] = seen
            return self.buffers[agent]
        if self.time != (LENGTH if fault == "after the rehearsal" else 4):
            return seen
        number = {"nan": np.nan, "after the rehearsal": np.nan, "inf": np.inf, "outside": 77.0}
        if fault in number and isinstance(seen, np.ndarray):
            seen = np.array(seen, dtype=np.float64)
            seen.flat[0] = self.truth[agent][0] = number[fault]
        others = {"nothing": None, "shape": np.zeros((3, 3))}
        if fault == "numbers are text" and isinstance(seen, np.ndarray):
            return seen.astype(str)
        return others.get(fault, seen)

    def step(self, actions: dict[Any, Any]) -> Any:
        """Let a step pass."""
        fault, acting = self.traits["fault"], list(self.agents)
        self.time += 1
        if self.time == 4 and fault in ("raises", "exits"):
            raise (RuntimeError("two\nlines \x1b[2J") if fault == "raises" else SystemExit(0))
        for agent in self.ids:
            self.place[agent] = float(self.rng.uniform(-0.9, 0.9))
        seen = {a: self.look(a) for a in acting}
        if self.time == 4 and fault == "missing player" and len(acting) > 1:
            del seen[acting[-1]]
        if self.time == 4 and fault == "unknown player":
            seen["nobody"] = seen[acting[0]]
        self.paid = {a: -abs(self.place[a]) for a in acting}
        paid = {a: self.pay(self.paid[a]) for a in acting}
        if self.traits["paid"] == "missing" and self.time == 4:
            del paid[acting[0]]
        ended, cut = self.end(acting)
        self.is_over = all(ended.get(a) or cut.get(a) for a in acting) and not (
            self.traits["ends"] == "late" and self.time < 4
        )
        self.is_over |= not self.agents
        infos = None if self.traits["face"] == "infos None" else {a: {} for a in acting}
        if self.traits["ends"] == "old":
            return seen, paid, ended, infos
        return seen, paid, ended, cut, infos

    def pay(self, reward: float) -> Any:
        """Return a reward in the form of the trait."""
        if self.time != 4 and self.traits["paid"] in ("nan", "inf", "nothing", "text"):
            return reward
        forms: dict[str, Any] = {
            "array": np.array([reward], np.float64), "arrays": np.array([reward, reward]),
            "scalar": np.float64(reward), "nothing": None, "nan": np.nan, "text": str(reward),
            "bool": reward < -0.4, "inf": -np.inf,
        }  # fmt: skip
        return forms.get(self.traits["paid"], reward)

    def end(self, acting: list[Any]) -> tuple[dict[Any, Any], dict[Any, Any]]:
        """Return who is terminated and who truncated, and note who is left."""
        kind, is_over = self.traits["ends"], self.time >= LENGTH
        ended: dict[Any, Any] = dict.fromkeys(acting, False)
        cut: dict[Any, Any] = dict.fromkeys(acting, is_over)
        if kind == "mixed" and is_over:
            ended[acting[0]], cut[acting[0]] = True, False
        if kind == "numpy":
            cut = {a: np.bool_(is_over) for a in acting}
        if kind == "nothing" and self.time == 4:
            cut = dict.fromkeys(acting, None)
        if kind == "keys" and self.time == 4:
            del cut[acting[-1]]
        if kind == "dies" and self.time == 3 and len(acting) > 1:
            ended[acting[0]] = True
            self.agents = acting[1:]
        if kind == "late" and self.time == 3:
            self.agents = list(self.ids)
        if is_over and kind != "listed":
            self.agents = []
        if kind == "empties" and self.time == 5:
            self.agents, cut = [], dict.fromkeys(acting, False)
        return ended, cut


def draw(rng: random.Random) -> dict[str, str]:
    """Return traits, of which a few are hostile."""
    lists = {
        "players": tuple(PLAYERS), "seen": SEEN, "actions": tuple(ACTIONS), "fault": FAULTS,
        "paid": PAID, "ends": ENDS, "face": FACES,
    }  # fmt: skip
    hostile = set(rng.sample(list(lists), rng.choice([1, 1, 2, 2, 3])))
    return {name: rng.choice(kinds) if name in hostile else "" for name, kinds in lists.items()}


def attack(number: int, rng: random.Random) -> Counter[str]:
    """Make scenarios of environments; return what became of them."""
    tally = Counter[str]()
    for _ in range(number):
        traits = draw(rng)
        tally["environments"] += 1
        try:
            became = _played(traits)
        except BaseException:
            print(f"{traits}:\n{traceback.format_exc()}", file=stderr)
            became = "traceback"
        if "wrong" in became or "length" in became:
            print(f"{traits}: {became}", file=stderr)
        tally[f"environments: {became}"] += 1
    return tally


def _played(traits: dict[str, str]) -> str:
    """Return what became of an environment."""
    environment = Drawn(traits)
    try:
        world = from_pettingzoo(environment, rewards="own")
        world.reset(0)
    except ValueError as refusal:
        return _refused(refusal)
    rng = np.random.default_rng(0)
    for seed in range(SEEDS):
        states = world.reset(seed)
        if wrong := _wrong_states(world, environment, states):
            return wrong
        for _ in range(LENGTH):
            try:
                step = world.step(rng.integers(len(world.action_set), size=len(world.agents)))
            except ValueError as refusal:
                return _refused(refusal)
            if wrong := _wrong_states(world, environment, step.states):
                return wrong
            paid = np.broadcast_to(step.reward, len(world.agents))[[g[0] for g in world.groups]]
            expected = [environment.paid.get(player, 0.0) for player in environment.ids]
            if traits["paid"] not in ("bool", "inf") and not np.allclose(paid, expected):
                return f"wrong reward: {paid}, of {expected}"
            if (step.terminated or step.truncated) != environment.is_over:
                return f"wrong end at {environment.time}"
            if environment.is_over:
                break
    return "right"


def _refused(refusal: ValueError) -> str:
    text = str(refusal)
    return "refused in one line" if text.isprintable() else f"refused at length: {text!r}"


def _wrong_states(world: EnvironmentScenario, environment: Drawn, states: np.ndarray) -> str:
    """Return how states differ from what players see; nothing if they do not."""
    names = [variable.name for variable in world.state_space.variables]
    # The actuators of a single player are bodies of their own.
    for group, player in zip(world.groups, environment.ids, strict=len(environment.ids) > 1):
        if player not in environment.agents and not environment.is_over:
            continue  # it has left
        seen = environment.truth[player]
        order = {"place": 0, "time": 1, "hour": 1, "o0": 0, "o1": 1}
        expected = [seen[order[name]] for name in names if name in order]
        values = [states[group[0], i] for i, name in enumerate(names) if name in order]
        if not np.isfinite(states).all() or not np.allclose(values, expected):
            return f"wrong states of {player!r}: {values}, of {expected}"
    return ""
