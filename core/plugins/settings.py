"""What all settings share, the numbers that they hold, and what is said of those that are wrong.

Settings are the tables of a spec. Each model refuses unknown keys and values outside the stated
ranges when it is built; every field is documented beside it, with its unit. What is wrong is said
in the words of the command line rather than pydantic's, see `problems`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal
from fnmatch import fnmatchcase
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeAlias

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
)

from ..numerics import BoolArray
from .problems import explain

NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0, le=1)]


def names(value: object) -> object:
    """Return what is named as a tuple of texts, one name or several, of numbers, too."""
    several = value if isinstance(value, list | tuple) else (value,)
    return tuple(str(one) if isinstance(one, int | np.integer) else one for one in several)


Names = Annotated[tuple[str, ...], Field(min_length=1), BeforeValidator(names)]
"""Names, patterns or numbers of something, one or a list."""


def mask_of(named: Sequence[str], agents: Sequence[str], key: str) -> BoolArray:
    """Return which of the agents ``(n,)`` are named, by name or pattern.

    Raises
    ------
    ValueError
        If one is named that there is not; the line begins with the key and calls them by it.
    """
    mask = np.zeros(len(agents), dtype=bool)
    for name in named:
        hit = np.array([fnmatchcase(agent, name) for agent in agents])
        if not hit.any():
            shown = ", ".join(agents[:8]) + (", ..." if len(agents) > 8 else "")
            head, dot, _ = agents[0].rpartition(".")
            part = key.rpartition(".")[2].removesuffix("s") if key.endswith("s") else "agent"
            raise ValueError(
                f"{key} = {name!r}: no such {part}, allowed {shown} or a pattern such as "
                f"{head}{dot}*"
            )
        mask |= hit
    return mask


MOST_BYTES = 10**9
"""What a worker may hold."""
MOST_SECONDS = 5
"""What a decision of the whole team may take."""


def team_size(seconds_per_pair: float, agents: int = 1) -> AfterValidator:
    """Return what refuses a team that is too large by an estimate, before anything is allocated.

    A worker holds 28 bytes for every pair of agents, and 0.2 GB without them, as measured with
    chains of up to 4,096 agents (``python -m benchmarks.decisions``).

    Parameters
    ----------
    seconds_per_pair
        What a decision is estimated to take, over the square of the number of agents [s].
    agents
        How many agents each of those has that are counted.

    Examples
    --------
    >>> team_size(5e-9).func(10_000)
    Traceback (most recent call last):
    ValueError: a worker would hold 3 GB, and a decision take 0.50 s, by estimate, allowed up to
    1 GB and 5 s
    """

    def check_number(number: int) -> int:
        check_team(number * agents, seconds_per_pair)
        return number

    return AfterValidator(check_number)


def check_team(agents: int, seconds_per_pair: float) -> None:
    """Raise `ValueError` if a team is too large by an estimate, see `team_size`."""
    pairs = Decimal(agents) ** 2  # of numbers too large for floats, too
    held = 2 * 10**8 + 28 * pairs
    seconds = Decimal(seconds_per_pair) * pairs
    if held > MOST_BYTES or seconds > MOST_SECONDS:
        raise ValueError(
            f"a worker would hold {held / 10**9:.2g} GB, and a decision take {seconds:.2g} s, "
            f"by estimate, allowed up to {MOST_BYTES // 10**9} GB and {MOST_SECONDS} s"
        )


def unwritten(default: Any) -> Any:
    """Return the field of a key that is not written where it has its default.

    So a new key leaves the identities of trials, and what is kept of them, as they were.
    """
    return Field(exclude_if=lambda value: value == default)


FailureSpan: TypeAlias = tuple[int, int | None]
"""Episodes in which a failure begins and ends; None if it lasts."""


class SettingsError(ValueError):
    """Settings that cannot be made: one line that names the field, the value, what is allowed.

    Attributes
    ----------
    problem
        The line without the name of the settings.
    """

    def __init__(self, name: str, problem: str) -> None:
        super().__init__(f"{name}: {problem}")
        self.problem = problem


if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)


class _Made(ModelMetaclass):
    """What calling a settings class does: errors are one line of ours, not several of pydantic.

    Tables are validated without being called, so nothing changes there.
    """

    def __call__(cls: Any, *args: Any, **table: Any) -> Any:  # noqa: N805 - of a metaclass
        try:
            return cls.made(*args, **table)
        except ValidationError as error:
            raise SettingsError(cls.__name__, explain(error, cls, table)) from None


class Settings(BaseModel, metaclass=_Made):
    """A frozen model that refuses unknown keys.

    Examples
    --------
    >>> class Cart(Settings):
    ...     wheels: int = 2
    >>> Cart(wheel=4)
    Traceback (most recent call last):
    nested_agents.core.plugins.settings.SettingsError: Cart: wheel = 4: unknown key; did you mean
    'wheels'?
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    @classmethod
    def made(cls, **table: Any) -> Any:
        """Return the settings that calling the class with keywords makes."""
        return type(BaseModel).__call__(cls, **table)


class PartSettings(Settings):
    """What the settings of all things of a registry inherit."""

    kind: str = ""
    factory: ClassVar[str] = ""
    """Where the class is that is built of them, imported when it is wanted."""
    player: ClassVar[str] = ""
    """Where the module is that plays recordings on a page, see `studies.report.replays`; empty:
    recordings are drawn as films."""

    def build(self, *given: Any) -> Any:
        """Return what these are the settings of, built of them and of what else is given.

        Raises
        ------
        ValueError
            If there can be none of these settings; one line.
        """
        if not self.factory:
            raise TypeError(f"{type(self).__name__} {self.kind!r} says not how it is built")
        return resolve_name(self.factory)(self, *given)


class PerceptionSettings(Settings):
    """How some agents perceive a scenario: one of the ``[[scenario.perception]]`` of a spec.

    See `nested_agents.scenarios.faults.perception`.
    """

    agents: Names
    """Agents by name, pattern or number, one or a list."""
    noise: Fraction = 0.0
    """Standard deviation of what they perceive, of every state variable, as a fraction of its
    range; drawn anew for every decision."""
    delay: Annotated[int, Field(ge=0, le=1000)] = 0
    """Decisions by which they perceive states late; in the first ones they perceive the first."""
    reach: Annotated[int, Field(ge=0)] | None = None
    """How many links away bodies are perceived at most, see
    `nested_agents.scenarios.faults.perception.distances_of`; none: however far."""
    lost: Annotated[tuple[str, ...], BeforeValidator(names)] = ()
    """Agents by name, pattern or number whose bodies they do not perceive."""


class ScenarioSettings(PartSettings):
    """What the settings of all scenarios inherit; a scenario is built of nothing else."""

    perception: Annotated[tuple[PerceptionSettings, ...], unwritten(())] = ()
    """How agents perceive it, each for itself; empty: all know all states, and predict alike."""

    def warnings(self) -> tuple[str, ...]:
        """Return what looks wrong and is not refused, a line each: a size in another unit."""
        return ()

    def scenario_defaults(self, preset: str) -> Mapping[str, Any]:
        """Return what this scenario lays over a preset: its ``learner`` and ``topology`` tables.

        A preset is made for box pushing; what learns best in another scenario may be something
        else, and depend on the settings. What a spec says itself lies over both. Nothing by
        default.
        """
        return {}

    @property
    def period(self) -> float | None:
        """Seconds of a decision, if it has a duration."""
        return None

    @property
    def task_size(self) -> float | None:
        """Size of the task relative to that of the smallest team; None if it is unknown."""
        return None

    @property
    def failure_spans(self) -> tuple[FailureSpan, ...]:
        """When its ``failures``, if it has any, begin and end."""
        return tuple((f.episode, f.end_episode) for f in dict(self).get("failures", ()))

    @property
    def onset(self) -> int | None:
        """Episode in which the first failure begins, if any does."""
        return min((begin for begin, _ in self.failure_spans), default=None)


def tuples(value: Any) -> Any:
    """Return `value` with every list in it as a tuple, which strict validation asks for."""
    if isinstance(value, Mapping):
        return {key: tuples(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return tuple(tuples(inner) for inner in value)
    return value
