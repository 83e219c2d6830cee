"""Tasks of VMAS (Bettini et al. 2022), whose worlds are stepped in batches: those of BenchMARL.

Agents have VMAS's discrete actions, what each observes is its state, and each is paid what VMAS
pays it. An episode begins by its seed alone, in whatever batch. In its steps VMAS asks of a batch
together which bodies are near each other, and draws noise for all, so that in tasks with contacts
or noise a world at once with others is not quite the world by itself, and a checkpoint may not be
repeated; at the same number of worlds the same seed gives the same bits. Needs the extra vmas.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..core.interface.environments import Environments, Transitions
from ..core.interface.measures import NO_SUCCESS, SUCCESS, Measure
from ..core.interface.scenario import Scenario, Transition
from ..core.interface.spaces import ActionSet, StateSpace, Variable
from ..core.numerics import FloatArray, IntArray
from ..core.plugins.settings import ScenarioSettings
from ..core.plugins.sources import format_error
from ..core.plugins.words import closest

if TYPE_CHECKING:
    from vmas.simulator.environment import Environment

SUCCEEDED = Measure(SUCCESS.name, SUCCESS.title, source="succeeded", better="higher", is_rate=True)
MET = 64
"""Worlds in which it is seen what random agents observe."""
HELD = 0.7
"""Probability that they do the same again."""
OURS = {"continuous_actions": "VMAS's discrete actions", "dict_spaces": "", "num_envs": ""}
"""Options of VMAS that are not a user's."""


class VmasSettings(ScenarioSettings):
    """A task of VMAS."""

    kind: Literal["vmas"] = "vmas"
    task: str
    """Its name, as ``balance`` or ``navigation``."""
    options: dict[str, Any] = Field(default_factory=dict)
    """What the task is made with, by name, such as ``n_agents``."""
    most_decisions: Annotated[int, Field(ge=1, le=10_000)] = 100
    """Decisions after which an episode ends."""
    success_return: float | None = None
    """Least return of an episode, the mean of the agents, that counts as a success; none: nothing
    does."""

    factory: ClassVar[str] = f"{__name__}:VmasTask"

    def __hash__(self) -> int:
        return hash(repr(self))  # tables have no hash of their own

    def warnings(self) -> tuple[str, ...]:
        """Return that nothing is a success, if it is so."""
        nothing = "scenario.success_return: nothing is said to be one, returns are compared"
        return () if self.success_return is not None else (nothing,)


class VmasTask(Scenario):
    """A task of VMAS.

    Parameters
    ----------
    settings
        See `VmasSettings`.

    Raises
    ------
    ValueError
        If there is no such task, its options do not fit, its agents differ in what they observe or
        do, or VMAS is not installed; one line.
    """

    def __init__(self, settings: VmasSettings) -> None:
        self.settings = settings
        self.measures = (SUCCEEDED if settings.success_return is not None else NO_SUCCESS,)
        self._single = VmasEnvironments(settings, 1)
        self.agents = self._single.agents
        self.roles = ("agent",) * len(self.agents)
        names = tuple(map(str, range(self._single.n_actions)))
        n = len(names)
        self.action_set = ActionSet(names, (1.0,) * n, (0.0,) * n, neutral=0)
        low, high = ranges_of(settings)
        self.state_space = StateSpace(
            f"vmas {settings.task}",
            tuple(
                Variable(f"o{k}", "1", float(a), float(b))
                for k, (a, b) in enumerate(zip(low, high, strict=True))
            ),
        )
        self._return = 0.0

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Let VMAS begin an episode; return states ``(n, d)``."""
        sequence = np.random.SeedSequence(seed) if isinstance(seed, int) else seed
        self._return = 0.0
        states: FloatArray = self._single.begin([0], [sequence], episode)[0]
        return states

    def step(self, joint_action: IntArray) -> Transition:
        """Let VMAS carry out a joint action ``(n,)``."""
        steps = self._single.step(np.asarray(joint_action)[None])
        self._return += float(steps.rewards[0].mean())
        least = self.settings.success_return
        info = {"succeeded": least is not None and self._return >= least}
        ends = bool(steps.terminated[0]), bool(steps.truncated[0])
        return Transition(steps.states[0], steps.rewards[0], *ends, info, absorbing=False)

    def environments(self, count: int) -> VmasEnvironments:
        """Return many worlds of the task, stepped in one call."""
        return VmasEnvironments(self.settings, count)


class VmasEnvironments(Environments):
    """Worlds of a task, in the batch of one environment of VMAS.

    Parameters
    ----------
    settings
        Of the task.
    count
        How many worlds.

    Attributes
    ----------
    agents
        Their names.
    n_actions
        How many actions each has.
    """

    def __init__(self, settings: VmasSettings, count: int) -> None:
        self.count = count
        self._most = settings.most_decisions
        self._env = make(settings, count)
        self._done = np.zeros(count, dtype=np.int64)
        self.agents = tuple(agent.name for agent in self._env.agents)
        task = f"scenario.task = {settings.task!r}"
        actions = {space.n for space in self._env.action_space}
        shapes = {space.shape for space in self._env.observation_space}
        if len(actions) > 1 or len(shapes) > 1:
            kinds = f"actions: {sorted(actions)}, observations: {sorted(map(str, shapes))}"
            raise ValueError(f"{task}: its agents differ, allowed: all alike ({kinds})")
        self.n_actions = int(actions.pop())

    def begin(
        self, places: Sequence[int], seeds: Sequence[np.random.SeedSequence], first_episode: int
    ) -> FloatArray:
        """Start an episode in some worlds."""
        for place, seed in zip(places, seeds, strict=True):
            self._env.seed(int(seed.generate_state(1)[0]))
            self._env.reset_at(place, return_observations=False)
            self._done[place] = 0
        (observed,) = self._env.get_from_scenario(
            get_observations=True, get_rewards=False, get_infos=False, get_dones=False
        )
        return _stacked(observed)[list(places)]

    def step(self, joint_actions: IntArray) -> Transitions:
        """Carry out joint actions in all worlds."""
        import torch

        actions = torch.from_numpy(np.array(joint_actions, dtype=np.int64))
        told = [actions[:, i : i + 1] for i in range(len(self.agents))]
        observed, paid, done, _ = self._env.step(told)
        self._done += 1
        terminated = done.numpy().astype(bool)
        late = ~terminated & (self._done >= self._most)
        rewards = _stacked(paid).reshape(self.count, -1)
        return Transitions(_stacked(observed), rewards, terminated, late)


def make(settings: VmasSettings, count: int) -> Environment:
    """Return the environment of a task.

    Raises
    ------
    ValueError
        If there is none; one line.
    """
    try:
        with contextlib.redirect_stderr(io.StringIO()):  # gym tells everybody to use Gymnasium
            import vmas
    except ImportError as error:
        raise ValueError(
            "scenario.kind = 'vmas': needs the extra vmas, pip install 'nested-agents[vmas]' "
            f"({error})"
        ) from None
    known = [*vmas.scenarios, *vmas.debug_scenarios, *vmas.mpe_scenarios]
    if settings.task not in known:
        raise ValueError(f"scenario.task = {settings.task!r}: {closest(settings.task, known)}")
    for name, ours in OURS.items():
        if name in settings.options:
            allowed = f"has {ours}" if ours else "is set by the package"
            raise ValueError(f"scenario.options.{name}: scenario.kind = 'vmas' {allowed}")
    try:
        return vmas.make_env(
            settings.task, count, device="cpu", continuous_actions=False, seed=0,
            **settings.options,
        )  # fmt: skip
    except Exception as error:  # a task may be anybody's
        raise ValueError(
            f"scenario.task = {settings.task!r}: cannot be made, {format_error(error)}"
        ) from None


@lru_cache(maxsize=32)
def ranges_of(settings: VmasSettings) -> tuple[FloatArray, FloatArray]:
    """Return what random agents observe at least and at most ``(d,)``, to two digits, outward.

    Numbers that stay the same have a range of 1 about them.
    """
    worlds = VmasEnvironments(settings, MET)
    rng = np.random.default_rng(0)
    seen = [worlds.reset(np.random.SeedSequence(0).spawn(MET))]
    action = rng.integers(worlds.n_actions, size=(MET, len(worlds.agents)))
    for _ in range(settings.most_decisions):
        drawn = rng.integers(worlds.n_actions, size=action.shape)
        action = np.where(rng.random(action.shape) < HELD, action, drawn)
        seen.append(worlds.step(action).states)
    every = np.concatenate(seen).reshape(-1, seen[0].shape[-1])
    low = every.min(axis=0)
    high = every.max(axis=0)
    unit = 10.0 ** np.floor(np.log10(np.maximum(high - low, 1e-3)) - 1.0)
    low = np.floor(low / unit) * unit
    high = np.ceil(high / unit) * unit
    is_same = high - low < 1e-3
    return np.where(is_same, low - 0.5, low), np.where(is_same, low + 0.5, high)


def _stacked(by_agent: Sequence[Any]) -> FloatArray:
    """Return tensors ``(W, ...)`` of agents as one array ``(W, n, ...)``."""
    return np.stack([tensor.numpy() for tensor in by_agent], axis=1).astype(float)
