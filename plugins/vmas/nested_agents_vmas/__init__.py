"""Tasks of VMAS (Bettini et al. 2022), the tasks of BenchMARL, stepped in batches.

Agents have VMAS's discrete actions, observations and rewards. The seed alone determines how an
episode starts, whatever the batch. During an episode, VMAS decides for the whole batch which bodies
are near each other, and draws noise for all. In tasks with contacts or noise, an environment in a
batch therefore differs slightly from the same environment alone, and an interrupted trial may not
resume bit for bit. The same seed and number of environments give the same bits.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Sequence
from difflib import get_close_matches
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

import nested_agents as na

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

if TYPE_CHECKING:
    from vmas.simulator.environment import Environment

SUCCEEDED = na.Measure(
    na.SUCCESS.name, na.SUCCESS.title, source="succeeded", better="higher", is_rate=True
)
RANGE_ENVIRONMENTS = 64
"""Number of environments of random agents that give the ranges of the state variables."""
REPEAT_PROBABILITY = 0.7
"""Probability that a random agent repeats its action."""
RESERVED = {"continuous_actions": "VMAS's discrete actions", "dict_spaces": "", "num_envs": ""}
"""Options of VMAS that the scenario sets itself, and what it sets."""


class VmasSettings(na.ScenarioSettings):
    """Settings of the scenario `vmas`."""

    kind: Literal["vmas"] = "vmas"
    task: str
    """Name of the task, such as ``balance`` or ``navigation``."""
    options: dict[str, Any] = Field(default_factory=dict)
    """Options of the task, such as ``n_agents``."""
    most_decisions: Annotated[int, Field(ge=1, le=10_000)] = 100
    """Number of decisions after which an episode ends."""
    success_return: float | None = None
    """Minimum return of a successful episode, as the mean over agents; default: none is one."""

    factory: ClassVar[str] = f"{__name__}:VmasTask"

    def __hash__(self) -> int:
        return hash(repr(self))  # dictionaries are not hashable

    def warnings(self) -> tuple[str, ...]:
        """Return a remark if no episode can be a success."""
        nothing = "scenario.success_return: not set, so studies compare returns, not success"
        return () if self.success_return is not None else (nothing,)


class VmasTask(na.Scenario):
    """A task of VMAS.

    Parameters
    ----------
    settings
        The task and its options.

    Raises
    ------
    ValueError
        If the task is unknown, its options are wrong, its agents differ in observations or
        actions, or VMAS is not installed.
    """

    def __init__(self, settings: VmasSettings) -> None:
        self.settings = settings
        self.measures = (SUCCEEDED if settings.success_return is not None else na.NO_SUCCESS,)
        self._single = VmasEnvironments(settings, 1)
        self.agents = self._single.agents
        self.roles = ("agent",) * len(self.agents)
        names = tuple(map(str, range(self._single.n_actions)))
        n = len(names)
        self.action_set = na.ActionSet(names, (1.0,) * n, (0.0,) * n, neutral=0)
        low, high = ranges_of(settings)
        self.state_space = na.StateSpace(
            f"vmas {settings.task}",
            tuple(
                na.Variable(f"o{k}", "1", float(a), float(b))
                for k, (a, b) in enumerate(zip(low, high, strict=True))
            ),
        )
        self._return = 0.0

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode and return the states ``(n, d)``."""
        sequence = np.random.SeedSequence(seed) if isinstance(seed, int) else seed
        self._return = 0.0
        states: FloatArray = self._single.begin([0], [sequence], episode)[0]
        return states

    def step(self, joint_action: IntArray) -> na.Transition:
        """Step the task by a joint action ``(n,)``."""
        steps = self._single.step(np.asarray(joint_action)[None])
        self._return += float(steps.rewards[0].mean())
        least = self.settings.success_return
        info = {"succeeded": least is not None and self._return >= least}
        ends = bool(steps.terminated[0]), bool(steps.truncated[0])
        return na.Transition(steps.states[0], steps.rewards[0], *ends, info, absorbing=False)

    def environments(self, count: int) -> VmasEnvironments:
        """Return many environments of the task, stepped in one call."""
        return VmasEnvironments(self.settings, count)


class VmasEnvironments(na.Environments):
    """Environments of a task: the batch of one VMAS environment.

    Parameters
    ----------
    settings
        The task and its options.
    count
        Number of environments.

    Attributes
    ----------
    agents
        Names of the agents.
    n_actions
        Number of actions of every agent.
    """

    def __init__(self, settings: VmasSettings, count: int) -> None:
        self.count = count
        self._max_decisions = settings.most_decisions
        self._env = make(settings, count)
        self._done = np.zeros(count, dtype=np.int64)
        self.agents = tuple(agent.name for agent in self._env.agents)
        task = f"scenario.task = {settings.task!r}"
        actions = {space.n for space in self._env.action_space}
        shapes = {space.shape for space in self._env.observation_space}
        if len(actions) > 1 or len(shapes) > 1:
            spaces = f"actions {sorted(actions)}, observations {sorted(map(str, shapes))}"
            raise ValueError(f"{task}: agents must have equal spaces, found {spaces}")
        self.n_actions = int(actions.pop())

    def begin(
        self, places: Sequence[int], seeds: Sequence[np.random.SeedSequence], first_episode: int
    ) -> FloatArray:
        """Start an episode in some environments."""
        for place, seed in zip(places, seeds, strict=True):
            self._env.seed(int(seed.generate_state(1)[0]))
            self._env.reset_at(place, return_observations=False)
            self._done[place] = 0
        (observed,) = self._env.get_from_scenario(
            get_observations=True, get_rewards=False, get_infos=False, get_dones=False
        )
        return _stacked(observed)[list(places)]

    def step(self, joint_actions: IntArray) -> na.Transitions:
        """Step all environments by joint actions ``(E, n)``."""
        import torch

        actions = torch.from_numpy(np.array(joint_actions, dtype=np.int64))
        told = [actions[:, i : i + 1] for i in range(len(self.agents))]
        observed, paid, done, _ = self._env.step(told)
        self._done += 1
        terminated = done.numpy().astype(bool)
        late = ~terminated & (self._done >= self._max_decisions)
        rewards = _stacked(paid).reshape(self.count, -1)
        return na.Transitions(_stacked(observed), rewards, terminated, late)


def make(settings: VmasSettings, count: int) -> Environment:
    """Return the VMAS environment of a task.

    Raises
    ------
    ValueError
        If VMAS is not installed, or the task or its options are wrong.
    """
    try:
        with contextlib.redirect_stderr(io.StringIO()):  # Gym recommends Gymnasium
            import vmas
    except ImportError as error:
        raise ValueError(
            f"scenario.kind = 'vmas': VMAS is not installed; pip install vmas ({error})"
        ) from None
    known = [*vmas.scenarios, *vmas.debug_scenarios, *vmas.mpe_scenarios]
    if settings.task not in known:
        near = get_close_matches(settings.task, known, 1)
        hint = f"did you mean {near[0]!r}?" if near else f"allowed: {', '.join(known)}"
        raise ValueError(f"scenario.task = {settings.task!r}: {hint}")
    for name, value in RESERVED.items():
        if name in settings.options:
            reason = f"the scenario has {value}" if value else "the scenario sets it"
            raise ValueError(f"scenario.options.{name}: not allowed, {reason}")
    try:
        return vmas.make_env(
            settings.task, count, device="cpu", continuous_actions=False, seed=0,
            **settings.options,
        )  # fmt: skip
    except Exception as error:  # raised by the code of the task
        message = " ".join(f"{type(error).__name__}: {error}".split())
        raise ValueError(f"scenario.task = {settings.task!r}: cannot be made, {message}") from None


@lru_cache(maxsize=32)
def ranges_of(settings: VmasSettings) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds ``(d,)`` of the observations of random agents.

    Bounds are rounded outward to two digits; a constant variable has a range of 1 around it.
    """
    environments = VmasEnvironments(settings, RANGE_ENVIRONMENTS)
    rng = np.random.default_rng(0)
    seen = [environments.reset(np.random.SeedSequence(0).spawn(RANGE_ENVIRONMENTS))]
    action = rng.integers(
        environments.n_actions, size=(RANGE_ENVIRONMENTS, len(environments.agents))
    )
    for _ in range(settings.most_decisions):
        drawn = rng.integers(environments.n_actions, size=action.shape)
        action = np.where(rng.random(action.shape) < REPEAT_PROBABILITY, action, drawn)
        seen.append(environments.step(action).states)
    every = np.concatenate(seen).reshape(-1, seen[0].shape[-1])
    low = every.min(axis=0)
    high = every.max(axis=0)
    unit = 10.0 ** np.floor(np.log10(np.maximum(high - low, 1e-3)) - 1.0)
    low = np.floor(low / unit) * unit
    high = np.ceil(high / unit) * unit
    is_same = high - low < 1e-3
    return np.where(is_same, low - 0.5, low), np.where(is_same, low + 0.5, high)


def _stacked(by_agent: Sequence[Any]) -> FloatArray:
    """Return the tensors ``(E, ...)`` of all agents as one array ``(E, n, ...)``."""
    return np.stack([tensor.numpy() for tensor in by_agent], axis=1).astype(float)
