"""Exploration: choice of an action given the values of all actions (Section V).

An explorer serves all agents of a team, one action at a time, and is notified of the beginning of
an episode and of the end of a decision. All random numbers come from the generator passed in. Exact
ties are broken at random, because they are common (maintaining and zeroing a resting wheel lead to
the same state).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from ..interface.prediction import Exploring
from ..numerics import FloatArray, greatest
from ..plugins.registry import SettingsRegistry
from ..plugins.settings import Fraction, NonNegative, PartSettings, Positive


def boltzmann(values: FloatArray, temperature: float) -> FloatArray:
    """Return the Boltzmann distribution over actions (Eq. 14).

    >>> boltzmann(np.array([0.0, np.log(3.0)]), 1.0).round(2).tolist()
    [0.25, 0.75]
    """
    weights = np.exp((values - values.max()) / temperature)
    return weights / weights.sum()


def warm_start_refusal(key: str, part: object) -> str:
    """Return the message that a part cannot be warm-started from another team."""
    return (
        f"{key}: {type(part).__name__} has no warm_start, which starting from another team requires"
    )


class Explorer(ABC):
    """Chooses actions. Its complete state is one array."""

    memory: FloatArray

    @property
    def exploring(self) -> Exploring | None:
        """State and probabilities of exploration by held random actions; None for other kinds."""
        return None

    def begin_episode(self) -> None:  # noqa: B027 - optional
        """Prepare for an episode of learning."""

    @abstractmethod
    def choose(self, agent: int, values: FloatArray, rng: np.random.Generator) -> int:
        """Return the action of `agent` given the values ``(A,)`` of its actions."""

    def advance(self) -> None:  # noqa: B027
        """Prepare for the next step, after all agents have decided."""

    def warm_start(self, former: Self) -> None:
        """Start from the state of an explorer with the same settings that served other agents.

        Raises
        ------
        ValueError
            If this kind of exploration does not support it.
        """
        raise ValueError(warm_start_refusal("learner.exploration.kind", self))


class ExplorationSettings(PartSettings):
    """Base class of settings of exploration; `build` takes the number of agents."""


class BoltzmannExploration(ExplorationSettings):
    """Actions sampled from the Boltzmann distribution (Eq. 14) with a falling temperature.

    ``T(t) = 1 + T_max exp(-s t)`` after t steps; the defaults are those of Kapetanakis and Kudenko
    (2002) for games of 1,000 plays.
    """

    kind: Literal["boltzmann"] = "boltzmann"
    factory: ClassVar[str] = f"{__name__}:Boltzmann"
    max_temperature: Positive = 500.0
    """Initial temperature above 1, T_max."""
    decay: NonNegative = 0.006
    """Decay of the temperature per step, s."""


class Boltzmann(Explorer):
    """Samples the Boltzmann distribution. The clock counts the steps of the whole run."""

    def __init__(self, settings: Any, n_agents: int) -> None:
        self.settings = settings
        self.memory: FloatArray = np.zeros(1)  # t, the steps counted by the clock

    @property
    def temperature(self) -> float:
        """T(t) = 1 + T_max exp(-s t)."""
        s = self.settings
        return 1.0 + s.max_temperature * float(np.exp(-s.decay * self.memory[0]))

    def warm_start(self, former: Self) -> None:
        """Continue the clock."""
        self.memory[:] = former.memory

    def advance(self) -> None:
        """Advance the clock by one step."""
        self.memory[0] += 1.0

    def choose(self, agent: int, values: FloatArray, rng: np.random.Generator) -> int:
        """Sample an action."""
        return int(rng.choice(len(values), p=boltzmann(values, self.temperature)))


class PaperExploration(ExplorationSettings):
    """Epsilon-decreasing with a diminishing temperature (Section V).

    The temperature is ``T(t) = 1 + T_max exp(-s t)``; with probability
    ``epsilon (T(t) - 1) / (T_max - 1)``, cut off at 1, an agent explores.
    """

    kind: Literal["paper"] = "paper"
    factory: ClassVar[str] = f"{__name__}:EpsilonDecreasingBoltzmann"
    epsilon: Fraction = 1.0
    """Initial exploration rate; not given in the paper."""
    max_temperature: Annotated[float, Field(gt=1)] = 100.0
    """T_max; not given in the paper."""
    decay: NonNegative = 0.005
    """Decay of the temperature per step, s (Section IX)."""
    clock: Literal["episode", "run"] = "run"
    """Whether t counts the steps of the episode or of the run; not given in the paper."""
    exploit: Literal["greatest", "sample"] = "greatest"
    """Take the action of greatest probability (Section V), or sample Eq. 14."""
    explore: Literal["uniform", "boltzmann"] = "uniform"
    """Distribution of the "random action" otherwise; not given in the paper."""


class EpsilonDecreasingBoltzmann(Boltzmann):
    """The paper's epsilon-decreasing exploration with a diminishing temperature (Section V)."""

    @property
    def rate(self) -> float:
        """Exploration probability epsilon (T(t) - 1) / (T_max - 1), at most 1."""
        s = self.settings
        return min(1.0, s.epsilon * (self.temperature - 1.0) / (s.max_temperature - 1.0))

    def begin_episode(self) -> None:
        """Restart the clock if it counts the steps of the episode."""
        if self.settings.clock == "episode":
            self.memory[0] = 0.0

    def choose(self, agent: int, values: FloatArray, rng: np.random.Generator) -> int:
        """Exploit with probability 1 - rate, otherwise explore."""
        if rng.random() < self.rate:
            if self.settings.explore == "uniform":
                return int(rng.integers(len(values)))
        elif self.settings.exploit == "greatest":
            # Eq. 14 is increasing in the value: the greatest probability is the greatest value.
            return greatest(values, rng)
        return super().choose(agent, values, rng)


class BurstExploration(ExplorationSettings):
    """Random actions, each held for some decisions, at a rate that falls with every episode.

    The fraction of explorative decisions of an agent in episode ``k`` is ``max(floor, rate * decay
    ** k)``, and at most `team_limit` divided by the number of agents.
    """

    kind: Literal["burst"] = "burst"
    factory: ClassVar[str] = f"{__name__}:Bursts"
    rate: Fraction = 0.3
    """Fraction of explorative decisions in the first episode."""
    decay: Fraction = 0.75
    """Factor on that fraction from episode to episode."""
    floor: Fraction = 0.02
    """Minimum fraction of explorative decisions."""
    team_limit: Positive | None = None
    """Maximum mean number of agents that explore at the same time. Without a limit, some agent of a
    large team always disturbs the others."""
    length: Annotated[float, Field(ge=1)] = 4.0
    """Mean number of decisions for which a random action is held."""


class Bursts(Explorer):
    """Random actions held for a geometric number of decisions."""

    def __init__(self, settings: BurstExploration, n_agents: int) -> None:
        self.settings = settings
        limit = settings.team_limit
        self._most = 1.0 if limit is None else min(1.0, limit / n_agents)
        # The episode; then, by agent, the remaining decisions of its burst and the held action.
        self.memory: FloatArray = np.zeros(1 + 2 * n_agents)
        self.memory[0] = -1.0

    @property
    def rate(self) -> float:
        """Fraction of explorative decisions in this episode."""
        s = self.settings
        return min(self._most, max(s.floor, s.rate * s.decay ** max(0.0, self.memory[0])))

    @property
    def exploring(self) -> Exploring:
        """The state, and the probabilities that a burst begins and ends.

        If bursts of mean length l begin with probability p, the share l p / (1 - p + l p) of all
        decisions is explorative. This is solved for p.
        """
        rate, length = self.rate, self.settings.length
        return Exploring(self.memory, rate / (length - rate * (length - 1.0)), 1.0 / length)

    def begin_episode(self) -> None:
        """Count the episode and end all bursts."""
        self.memory[0] += 1.0
        self.memory[1:] = 0.0

    def warm_start(self, former: Self) -> None:
        """Continue the count of episodes."""
        self.memory[0] = former.memory[0]

    def choose(self, agent: int, values: FloatArray, rng: np.random.Generator) -> int:
        """Return the held action, begin a burst, or return the greedy action."""
        at = 1 + 2 * agent
        if self.memory[at] > 0:
            self.memory[at] -= 1.0
            return int(self.memory[at + 1])
        _, chance, stop = self.exploring
        if rng.random() < chance:
            action = int(rng.integers(len(values)))
            self.memory[at] = rng.geometric(stop) - 1
            self.memory[at + 1] = action
            return action
        return greatest(values, rng)


EXPLORATIONS = SettingsRegistry(
    "exploration",
    {
        "burst": f"{__name__}:BurstExploration",
        "paper": f"{__name__}:PaperExploration",
        "boltzmann": f"{__name__}:BoltzmannExploration",
    },
    ExplorationSettings,
)
"""Kinds of exploration by name."""
