"""Conditions: what a study compares, as the grid that a preset, tables and a sweep span."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from ..core.config import BatchTDSettings, Learner, Settings
from ..scenarios.config import ScenarioSettings
from ..topologies.config import ChainSettings, Topology, parse
from .overlay import Table, nested, overlay
from .presets import PRESETS
from .spec_errors import SpecError, closest, explain, show

SECTIONS = ("scenario", "topology", "learner")


class ConditionSettings(Settings):
    """All that a trial depends on besides its seed and its length."""

    scenario: ScenarioSettings = ScenarioSettings()
    topology: Topology = ChainSettings()
    learner: Learner = BatchTDSettings()

    def canonical(self) -> str:
        """Return the JSON text that equal settings share, whatever wrote them."""
        return json.dumps(
            self.model_dump(mode="json"), sort_keys=True, separators=(",", ":"), allow_nan=False
        )


@dataclass(frozen=True)
class Condition:
    """One point of the grid.

    Attributes
    ----------
    label
        Short name, unique within its study.
    columns
        The swept keys and their values, as the columns of a result; `preset` if nothing is swept.
    settings
        The resolved settings.
    """

    label: str
    columns: Mapping[str, Any]
    settings: ConditionSettings


def grid(
    preset: str, tables: Mapping[str, Table], sweep: Mapping[str, Sequence[Any]]
) -> tuple[Condition, ...]:
    """Return the conditions in the order of the sweep, its last key varying fastest.

    Parameters
    ----------
    preset
        Name of the preset under conditions whose sweep names none.
    tables
        The spec's own `scenario`, `topology` and `learner` tables.
    sweep
        Lists of values by dotted key.

    Raises
    ------
    SpecError
        If a condition is invalid, or two are the same.
    """
    conditions: list[Condition] = []
    seen: dict[str, str] = {}
    for values in itertools.product(*sweep.values()):
        point = dict(zip(sweep, values, strict=True))
        name = label(point) if point else preset
        settings = resolve(preset, tables, point, f" (condition {name!r})" if point else "")
        twin = seen.setdefault(settings.canonical(), name)
        if twin != name or any(c.label == name for c in conditions):
            raise SpecError(f"sweep: conditions {twin!r} and {name!r} are the same")
        columns = {key: _scalar(value) for key, value in point.items()} or {"preset": preset}
        conditions.append(Condition(name, columns, settings))
    return tuple(conditions)


def resolve(
    preset: str, tables: Mapping[str, Table], point: Mapping[str, Any], where: str = ""
) -> ConditionSettings:
    """Return the settings of one condition: defaults, preset, tables, point of the sweep."""
    name = point.get("preset", preset)
    if name not in PRESETS:
        raise SpecError(f"preset = {show(name)}: {closest(name, PRESETS)}")
    layers = [PRESETS[name].table, tables]
    layers += [nested(key, value) for key, value in point.items() if key != "preset"]
    table = ConditionSettings().model_dump()
    for layer in layers:
        expanded = {key: section(key, value) for key, value in layer.items()}
        table = overlay(table, expanded, ConditionSettings)
    try:
        return ConditionSettings.model_validate(tuples(table), strict=True)
    except ValidationError as error:
        raise SpecError(explain(error, ConditionSettings, table) + where) from None


def section(name: str, value: object) -> Table:
    """Return the table of a section; a topology may be written as ``"kind"`` or ``"kind:option"``.

    Examples
    --------
    >>> section("topology", "chain:reversed")
    {'kind': 'chain', 'order': 'reversed'}
    """
    if isinstance(value, Mapping):
        return dict(value)
    if name != "topology" or not isinstance(value, str):
        allowed = "a name or a table" if name == "topology" else "a table"
        raise SpecError(f"{name} = {show(value)}: must be {allowed}")
    try:
        return parse(value).model_dump()
    except ValueError as error:
        raise SpecError(str(error)) from None


def label(point: Mapping[str, Any]) -> str:
    """Return a short name for a point of the sweep.

    Examples
    --------
    >>> label({"preset": "frozen"}), label({"preset": "default", "learner.rule_base.order": 2})
    ('frozen', 'default, order=2')
    """
    if len(point) == 1:
        return str(_scalar(next(iter(point.values()))))
    last = [key.rpartition(".")[2] for key in point]
    parts = []
    for key, short in zip(point, last, strict=True):
        name = short if last.count(short) == 1 else key
        value = _scalar(point[key])
        parts.append(str(value) if key == "preset" else f"{name}={value}")
    return ", ".join(parts)


def tuples(value: Any) -> Any:
    """Return `value` with every list in it as a tuple, which strict validation asks for."""
    if isinstance(value, Mapping):
        return {key: tuples(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return tuple(tuples(inner) for inner in value)
    return value


def _scalar(value: object) -> object:
    is_scalar = isinstance(value, int | float | str) and not isinstance(value, bool)
    return value if is_scalar else show(value)
