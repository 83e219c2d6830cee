"""Settings of worlds of Gymnasium and PettingZoo: what their agents do, perceive and look ahead to.

Reading them needs no simulator; it is imported when a world is built.
"""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from ...core.plugins.settings import ScenarioSettings, Settings, unwritten

Range = Annotated[tuple[float, float], AfterValidator(lambda ends: _ordered(ends))]
Centres = Annotated[tuple[float, ...], Field(min_length=2)]
Index = Annotated[int, Field(ge=0)]
Entry = Index | str
"""Which number of an observation: counted from 0, or by name."""
Entries = Entry | Annotated[tuple[Entry, ...], Field(min_length=1)]
"""Which number of an observation: one for all bodies, or one for each body."""


def _ordered(ends: tuple[float, float]) -> tuple[float, float]:
    if ends[0] >= ends[1]:
        raise ValueError("must be a range, the lower end first")
    return ends


Success = Literal["terminated"] | dict[str, float | Range]
"""When an episode is a success."""


def _measurable(success: Success) -> Success:
    for name, ends in success.items() if isinstance(success, dict) else ():
        if isinstance(ends, tuple) == (name == "return"):
            needed = "a number, the least" if name == "return" else "a range"
            raise ValueError(f"{name} must be {needed}")
    return success


class Direction(Settings):
    """An angle that an observation tells by its cosine and sine."""

    cos: Entries
    """Where the cosine is."""
    sin: Entries
    """Where the sine is."""

    @model_validator(mode="after")
    def _two(self) -> Self:
        if self.cos == self.sin:
            raise ValueError("cos and sin must be two numbers of the observation")
        return self


class AdaptedSettings(ScenarioSettings):
    """What the worlds of Gymnasium and PettingZoo have in common."""

    factory: ClassVar[str] = f"{__package__}.adapted:AdaptedWorld"
    id: str = ""
    """Which environment."""
    options: dict[str, Any] = Field(default_factory=dict)
    """What the environment is made with, by name."""
    actions: Annotated[int, Field(ge=2, le=99)] = 5
    """Levels, evenly spaced over its range, of each dimension of a continuous action; each is an
    agent. Discrete actions stay as they are; of agents with fewer than others the last are the
    first again."""
    neutral: Index | None = None
    """The action that an agent is taken to do where nothing is known of it; none: the level nearest
    to 0, of discrete actions the first."""
    hold: Annotated[int, Field(ge=1, le=10_000)] = 1
    """Steps of the environment for which a decision is held; their rewards are added."""
    predictor: Literal["none", "copy", "learned"] = "none"
    """What predicts: nothing; copies of the simulator, which are stepped for every joint action
    that is tried and know it exactly, its random numbers too; or, with the presets ``default`` and
    ``own-value``, what the team learns, as ``learner.predictor.kind = "learned"`` says."""
    horizon: Annotated[int, Field(ge=1, le=10_000)] = 1
    """Decisions that copies look ahead, the joint action being held; the reward predicted is the
    mean of theirs."""
    variables: dict[str, Entries] = Field(default_factory=dict)
    """State variables by name: which number of the observation each is, one for all bodies or a
    list of one for each. None: all that `angles` leaves and that change, called o0, o1 and so on,
    or those of a Dict by its keys: ``height``, ``position0``, ``position1``."""
    angles: dict[str, Entries | Direction] = Field(default_factory=dict)
    """State variables that are angles [rad], whose ends are the same point: where the observation
    has them, or their ``cos`` and ``sin``."""
    ranges: dict[str, Range] = Field(default_factory=dict)
    """Ranges of state variables; of others they are those of the environment, and where it has
    none, what random episodes meet."""
    centres: Annotated[dict[str, Centres], unwritten({})] = Field(default_factory=dict)
    """Centres of the membership functions of state variables, increasing: close together where
    little decides. Of others they are spread evenly, and ``learner.rule_base.memberships`` spreads
    all evenly."""
    rewards: Literal["joint", "own"] = "joint"
    """Whether all agents receive the mean reward, or those of each body its own."""
    success: Annotated[Success, AfterValidator(_measurable)] = Field(default_factory=dict)
    """When an episode is a success: if it ``terminated``, as where a goal ends it; or the least
    ``return``, and ranges of state variables in which all agents are at the end. None: never."""

    def __hash__(self) -> int:
        return hash(repr(self))  # tables have no hash of their own

    def bodies(self) -> tuple[tuple[int, ...], ...]:
        """Return the agents of each body of an only player; none: each is its own."""
        return ()

    def warnings(self) -> tuple[str, ...]:
        """Return that nothing is a success, if it is so."""
        nothing = "scenario.success: nothing is said to be one, returns are compared"
        return () if self.success else (nothing,)

    def scenario_defaults(self, preset: str) -> Mapping[str, Any]:
        """Return that predictions are learned, or few joint actions tried where each is played."""
        if self.predictor == "learned" and preset in ("default", "own-value"):
            return {"learner": {"predictor": {"kind": "learned"}}}
        is_slow = self.predictor == "copy" and preset in ("default", "own-value", "frozen")
        return {"learner": {"decision": {"evaluator": "best-response"}}} if is_slow else {}


class GymnasiumSettings(AdaptedSettings):
    """An environment of Gymnasium, each dimension of its action an agent."""

    kind: Literal["gymnasium"] = "gymnasium"
    id: str
    """As ``gymnasium.make`` takes it: ``Pendulum-v1``, or ``module:name``; or ``file.py:Name`` of
    your own, a class or function that makes an environment."""
    groups: tuple[tuple[Index, ...], ...] = ()
    """Numbers of the agents of every body, from 0 on, in order: those who have the same place in
    their bodies are of one role. None: each is its own body and role."""

    def bodies(self) -> tuple[tuple[int, ...], ...]:
        """Return the agents of each body."""
        return self.groups


class PettingZooSettings(AdaptedSettings):
    """An environment of PettingZoo, each of whose agents is a body."""

    kind: Literal["pettingzoo"] = "pettingzoo"
    id: str
    """As ``pettingzoo.make`` takes it: ``sisl/multiwalker-v9``; or its module, such as
    ``mpe2/simple_spread_v3``, which has ``parallel_env``, or an ``env`` whose agents act in cycles;
    or ``file.py:name`` of your own, a class or function that makes an environment."""
