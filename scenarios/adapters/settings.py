"""Settings of Gymnasium and PettingZoo environments: actions, state variables and predictions.

Reading settings imports no environment; it is imported when the scenario is built.
"""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from ...core.plugins.settings import ScenarioSettings, Settings

Range = Annotated[tuple[float, float], AfterValidator(lambda ends: _ordered(ends))]
Centers = Annotated[tuple[float, ...], Field(min_length=2)]
Index = Annotated[int, Field(ge=0)]
Entry = Index | str
"""A number of the observation, by index from 0 or by name."""
Entries = Entry | Annotated[tuple[Entry, ...], Field(min_length=1)]
"""A number of the observation, the same for all bodies or one for each."""
Success = Literal["terminated"] | dict[str, float | Range]
"""Condition for the success of an episode."""


def _ordered(ends: tuple[float, float]) -> tuple[float, float]:
    if ends[0] >= ends[1]:
        raise ValueError("must be a range, the lower end first")
    return ends


def _checked_success(success: Success) -> Success:
    for name, ends in success.items() if isinstance(success, dict) else ():
        if isinstance(ends, tuple) == (name == "return"):
            raise ValueError(f"{name} must be a {'number' if name == 'return' else 'range'}")
    return success


class Direction(Settings):
    """An angle given by its cosine and sine in the observation."""

    cos: Entries
    """Number that holds the cosine."""
    sin: Entries
    """Number that holds the sine."""

    @model_validator(mode="after")
    def _two(self) -> Self:
        if self.cos == self.sin:
            raise ValueError("cos and sin must be two numbers of the observation")
        return self


class EnvironmentSettings(ScenarioSettings):
    """Settings that Gymnasium and PettingZoo environments have in common."""

    factory: ClassVar[str] = f"{__package__}.scenario:EnvironmentScenario"
    id: str = ""
    """Id of the environment."""
    options: dict[str, Any] = Field(default_factory=dict)
    """Keyword arguments with which the environment is made."""
    actions: Annotated[int, Field(ge=2, le=99)] = 5
    """Number of evenly spaced levels of each dimension of a continuous action. Each dimension is an
    agent. Discrete actions remain as they are; agents with fewer actions than others repeat theirs
    from the first on."""
    neutral: Index | None = None
    """Action that an agent is assumed to take while nothing is known about it. By default the level
    nearest to 0, or the first discrete action."""
    hold: Annotated[int, Field(ge=1, le=10_000)] = 1
    """Number of environment steps for which a joint action is held. Their rewards are added."""
    predictor: Literal["none", "copy", "learned"] = "none"
    """Source of predictions. ``copy`` steps a copy of the simulator for every joint action tried,
    which is exact and includes the random numbers to come. ``learned`` lets the team learn a model,
    with the presets ``default`` and ``own-value``. ``none`` works only with model-free
    learners."""
    horizon: Annotated[int, Field(ge=1, le=10_000)] = 1
    """Number of decisions that copies look ahead while the joint action is held. The predicted
    reward is the mean over these decisions."""
    variables: dict[str, Entries] = Field(default_factory=dict)
    """State variables by name: a number of the observation, the same for all bodies or a list with
    one for each. By default all numbers that change and are not used by `angles`. They are named
    o0, o1 and so on, or after the keys of a Dict: ``height``, ``position0``, ``position1``."""
    angles: dict[str, Entries | Direction] = Field(default_factory=dict)
    """State variables that are angles [rad], given as a number of the observation or as its ``cos``
    and ``sin``."""
    ranges: dict[str, Range] = Field(default_factory=dict)
    """Ranges of state variables. By default the bounds of the observation space, or what random
    episodes reach where it has none."""
    centers: dict[str, Centers] = Field(default_factory=dict)
    """Increasing centers of the membership functions of state variables, evenly spaced by default.
    ``learner.rule_base.memberships`` spaces all of them evenly."""
    rewards: Literal["joint", "own"] = "joint"
    """Reward of an agent: the mean of all players, or that of its own player."""
    success: Annotated[Success, AfterValidator(_checked_success)] = Field(default_factory=dict)
    """Condition for the success of an episode: ``"terminated"``, or a table with the minimum
    ``return`` and ranges in which state variables of all agents must end. By default no episode is
    a success, and returns are compared."""

    def __hash__(self) -> int:
        return hash(repr(self))  # dicts have no hash

    def bodies(self) -> tuple[tuple[int, ...], ...]:
        """Return the agents of each body of a single player; empty if each agent is a body."""
        return ()

    def warnings(self) -> tuple[str, ...]:
        """Return a warning if no success is defined."""
        return () if self.success else ("scenario.success is not set: returns are compared",)

    def scenario_defaults(self, preset: str) -> Mapping[str, Any]:
        """Return defaults of the learner that follow from the predictor."""
        if self.predictor == "learned" and preset in ("default", "own-value"):
            return {"learner": {"predictor": {"kind": "learned"}}}
        if self.predictor == "copy" and preset in ("default", "own-value", "frozen"):
            # Copies are slow: try few joint actions.
            return {"learner": {"decision": {"evaluator": "best-response"}}}
        return {}


class GymnasiumSettings(EnvironmentSettings):
    """A Gymnasium environment. Each dimension of its action is an agent."""

    kind: Literal["gymnasium"] = "gymnasium"
    id: str
    """Id as in ``gymnasium.make``, such as ``Pendulum-v1`` or ``module:name``, or ``file.py:Name``
    for a class or function in your file that makes an environment."""
    groups: tuple[tuple[Index, ...], ...] = ()
    """Agents of each body, numbered from 0 in order. Agents at the same place of their bodies have
    the same role. By default each agent is a body with its own role."""

    def bodies(self) -> tuple[tuple[int, ...], ...]:
        """Return the agents of each body."""
        return self.groups


class PettingZooSettings(EnvironmentSettings):
    """A PettingZoo environment. Each of its agents is a body."""

    kind: Literal["pettingzoo"] = "pettingzoo"
    id: str
    """Id as in ``pettingzoo.make``, such as ``sisl/multiwalker-v9``, a module with
    ``parallel_env``, such as ``mpe2/simple_spread_v3``, or ``file.py:name`` for a class or function
    in your file that makes an environment."""
