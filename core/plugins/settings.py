"""Base classes of settings, and types of their fields.

Settings are the tables of a spec. Each model refuses unknown keys and values outside the stated
ranges when it is built. The docstring below a field documents it with its unit. `problems` has the
messages about mistakes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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
    model_validator,
)
from pydantic.fields import FieldInfo

from ..numerics import BoolArray
from .problems import explain

NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0, le=1)]


def names(value: object) -> object:
    """Return one or several names as a tuple of text; numbers become text."""
    several = value if isinstance(value, list | tuple) else (value,)
    return tuple(str(one) if isinstance(one, int | np.integer) else one for one in several)


Name = str | int
Names = Annotated[
    tuple[str, ...],
    Field(min_length=1),
    BeforeValidator(names, json_schema_input_type=Name | tuple[Name, ...]),
]
"""One or several names, patterns or numbers."""


def mask_of(named: Sequence[str], agents: Sequence[str], key: str) -> BoolArray:
    """Return which of the agents ``(n,)`` are named, by name or pattern.

    Raises
    ------
    ValueError
        If a name is unknown; one line that begins with the key.
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
"""Maximum memory of a worker [bytes]."""
MOST_SECONDS = 5
"""Maximum time of a decision of the whole team [s]."""


def team_size(seconds_per_pair: float, agents: int = 1) -> AfterValidator:
    """Return a validator that refuses teams that are too large by an estimate.

    A worker holds 28 bytes for every pair of agents, and 0.2 GB without them, as measured with
    chains of up to 4,096 agents (``python -m benchmarks.decisions``).

    Parameters
    ----------
    seconds_per_pair
        Estimated time of a decision divided by the squared number of agents [s].
    agents
        Number of agents for each counted thing.

    Examples
    --------
    >>> team_size(5e-9).func(10_000)
    Traceback (most recent call last):
    ValueError: needs an estimated 3 GB per worker and 0.50 s per decision, allowed: up to 1 GB and
    5 s
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
            f"needs an estimated {held / 10**9:.2g} GB per worker and {seconds:.2g} s per "
            f"decision, allowed: up to {MOST_BYTES // 10**9} GB and {MOST_SECONDS} s"
        )


FailureSpan: TypeAlias = tuple[int, int | None]
"""Episodes in which a failure begins and ends; None if it lasts."""


class SettingsError(ValueError):
    """Invalid settings: one line that names the field, the value and what is allowed.

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
    """Metaclass that turns errors of pydantic into one line when settings are constructed."""

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

    @model_validator(mode="before")
    @classmethod
    def _fill_tables(cls, table: object) -> object:
        """Add the default's keys to each inner table that names no kind of its own."""
        if not isinstance(table, Mapping):
            return table
        return {key: _fill(cls.model_fields.get(key), value) for key, value in table.items()}

    @classmethod
    def made(cls, **table: Any) -> Any:
        """Return the settings for keywords."""
        return type(BaseModel).__call__(cls, **table)


def changed_values(settings: Settings) -> dict[str, object]:
    """Return the kind of settings and their values that differ from the defaults, fit for JSON.

    Examples
    --------
    >>> class Cart(Settings):
    ...     wheels: int = 2
    ...     mass: float = 1.0
    >>> changed_values(Cart(wheels=4, mass=1.0))
    {'wheels': 4}
    """
    table = settings.model_dump(mode="json")
    values = dict(settings)
    changed = {}
    for name, field in type(settings).model_fields.items():
        value = values[name]
        default = None if field.is_required() else field.get_default(call_default_factory=True)
        if name == "kind" or field.is_required() or value != default:
            changed[name] = _without_defaults(value, table[name])
    return changed


def _without_defaults(value: object, dumped: object) -> object:
    """Return a value of a settings field for JSON; nested settings are without their defaults."""
    if isinstance(value, Settings):
        return changed_values(value)
    if isinstance(value, tuple) and isinstance(dumped, list):
        return [_without_defaults(item, own) for item, own in zip(value, dumped, strict=True)]
    return dumped


def _fill(field: FieldInfo | None, value: object) -> object:
    """Return a table over the default of its field; other values are unchanged."""
    if field is None or not isinstance(value, Mapping) or "kind" in value:
        return value
    default = None if field.is_required() else field.get_default(call_default_factory=True)
    return {**default.model_dump(), **value} if isinstance(default, Settings) else value


class PartSettings(Settings):
    """Base class of the settings of registered things."""

    kind: str = ""
    factory: ClassVar[str | Callable[..., object]] = ""
    """Class or function that builds the thing from the settings, or its place, which is imported
    on first use."""
    player: ClassVar[str] = ""
    """Module that replays recordings in a report, see `studies.report.replays`; empty if recordings
    are drawn as films."""

    def build(self, *given: Any) -> Any:
        """Build the thing from the settings and further arguments.

        Raises
        ------
        ValueError
            If it cannot be built; one line.
        """
        if not self.factory:
            raise TypeError(
                f"{type(self).__name__}: no factory; set `kind` or the class attribute `factory`"
            )
        factory = self.factory
        return (resolve_name(factory) if isinstance(factory, str) else factory)(self, *given)


class PerceptionSettings(Settings):
    """Perception of some agents: one table ``[[scenario.perception]]`` of a spec.

    See `nested_agents.scenarios.faults.perception`.
    """

    agents: Names
    """Agents by name, pattern or number, one or a list."""
    noise: Fraction = 0.0
    """Standard deviation of the noise of every state variable, as a fraction of its range; drawn
    for every decision."""
    delay: Annotated[int, Field(ge=0, le=1000)] = 0
    """Delay of perceived states in decisions. At first, agents perceive the first state."""
    reach: Annotated[int, Field(ge=0)] | None = None
    """Maximum distance in links of perceived bodies, see
    `nested_agents.scenarios.faults.perception.distances_of`. By default, all bodies."""
    lost: Annotated[
        tuple[str, ...], BeforeValidator(names, json_schema_input_type=Name | tuple[Name, ...])
    ] = ()
    """Agents, by name, pattern or number, with bodies that are not perceived."""


class ScenarioSettings(PartSettings):
    """Base class of the settings of scenarios."""

    perception: tuple[PerceptionSettings, ...] = ()
    """Perception of single agents. By default, all agents know all states and predict alike."""

    def warnings(self) -> tuple[str, ...]:
        """Return a line for each suspicious value, such as a size in another unit."""
        return ()

    def scenario_defaults(self, preset: str) -> Mapping[str, Any]:
        """Return the ``learner`` and ``topology`` tables that override those of a preset.

        Presets are tuned for box pushing, and other scenarios may need other values. The spec
        overrides both. By default, nothing is overridden.
        """
        return {}

    @property
    def period(self) -> float | None:
        """Duration of a decision [s]; None if it has none."""
        return None

    @property
    def task_size(self) -> float | None:
        """Size of the task relative to that of the smallest team; None if it is unknown."""
        return None

    @property
    def failure_spans(self) -> tuple[FailureSpan, ...]:
        """Episode in which each failure begins, and the first one without it."""
        return tuple(f.span for f in dict(self).get("failures", ()))

    @property
    def onset(self) -> int | None:
        """Episode in which the first failure begins; None without failures."""
        return min((begin for begin, _ in self.failure_spans), default=None)
