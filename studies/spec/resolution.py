"""Resolution of a spec into conditions: tables are merged as plain data, then validated once.

What the user wrote for a condition is merged first: the tables of the spec, those of an override,
the values of the sweeps. The result overrides the preset and the defaults of the scenario. A table
in which the user chose another ``kind`` replaces the one of the preset; keys that the user wrote
and the kind does not know are refused.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import reduce
from typing import NamedTuple

from pydantic import ValidationError

from ...core.plugins.models import tuples
from ...core.plugins.problems import explain, misplaced, several
from ...core.plugins.settings import Settings
from ...core.plugins.words import closest, show
from ...topologies.config import parse
from ..errors import SpecError, refused
from .conditions import Condition, ConditionSettings, Override, Stage, StageSettings
from .controls import LEARN_NOTHING, for_control
from .presets import PRESETS
from .tables import SWEEP, SpecTable, TomlTable, column_value, flat, label, merge, nested, override

SECTIONS = ("scenario", "topology", "learner")
"""Tables that describe a condition."""
Point = dict[str, object]
"""Swept values by dotted key."""


class UserTables(NamedTuple):
    """Tables of a spec that define its conditions."""

    preset: str
    """Preset of conditions that name no other."""
    unset: Sequence[str]
    """Dotted keys of the preset that return to their defaults."""
    sections: SpecTable
    """Scenario, topology and learner, which all conditions share."""
    sweep: Mapping[str, Sequence[object]]
    """Lists of values by dotted key."""
    overrides: Sequence[Override]
    """Named tables over the sections; crossed with the sweep."""
    evaluations: Mapping[str, SpecTable]
    """Changes of each condition for further evaluations, by name."""
    curriculum: Sequence[StageSettings]
    """Stages of training of conditions without stages of their own."""


def resolve(
    preset: object, user: SpecTable, where: str = "", unset: Sequence[str] = ()
) -> ConditionSettings:
    """Return the settings of a condition.

    Parameters
    ----------
    preset
        Name of the preset.
    user
        The merged tables of the user, which override the preset.
    where
        Name of the condition, which ends messages.
    unset
        Dotted keys of the preset that return to their defaults.

    Raises
    ------
    SpecError
        If the preset is unknown or a value is refused; one line.
    """
    own = _preset(preset, where)
    base: SpecTable = {name: own[name] for name in SECTIONS if name in own}
    table = override({"scenario": base["scenario"]}, {"scenario": user.get("scenario", {})})
    scenario = _validate(table, where).scenario
    if scenario.kind != base["scenario"]["kind"]:
        base = merge(base, own.get("other_scenarios", {}))
    base = override(base, expand_sections(scenario.scenario_defaults(str(preset))))
    for key in unset:
        base = _without(base, key, where)
    return _validate(override(base, user), where)


def _without(base: SpecTable, key: str, where: str) -> SpecTable:
    """Return the table of a preset without a dotted key and the keys below it."""
    entries = dict(flat(base))
    kept = {name: value for name, value in entries.items() if not f"{name}.".startswith(f"{key}.")}
    if len(kept) == len(entries):
        raise SpecError(f"unset: the preset does not set {key!r}; {closest(key, entries)}{where}")
    empty: TomlTable = {}
    return reduce(merge, (nested(name, value) for name, value in kept.items()), empty)


def conditions_of(spec: UserTables) -> tuple[Condition, ...]:
    """Return the conditions: override by override, the last key of the sweeps varying fastest.

    Raises
    ------
    SpecError
        If a condition is invalid, or two that learn are the same. Of equal controls the first is
        kept, see `Condition.same`.
    """
    conditions: dict[str, Condition] = {}
    points: dict[str, tuple[str, Point]] = {}
    keys = list(dict.fromkeys([*(key for o in spec.overrides for key in o.sweep), *spec.sweep]))
    for table, point in _points(spec.overrides, spec.sweep):
        condition = _condition(spec, table, point, keys)
        name = condition.label
        other, other_point = points.setdefault(condition.content, (name, point))
        is_same = other_point is not point
        if is_same and condition.settings.learner.kind in LEARN_NOTHING and other != name:
            kept = conditions[other]
            conditions[other] = kept._replace(same=(*kept.same, name))
        elif is_same or name in conditions:
            keys_of_both = _differing(point, other_point)
            raise SpecError(
                f"{keys_of_both or ('overrides' if spec.overrides else 'sweep')}: conditions "
                f"{other!r} and {name!r} are the same: leave one out, or give it other settings"
            )
        else:
            conditions[name] = condition
    return tuple(conditions.values())


NO_OVERRIDE = Override.model_construct(name="")
"""Override of a spec without any."""


def _points(
    overrides: Sequence[Override], sweep: Mapping[str, Sequence[object]]
) -> Iterator[tuple[Override, Point]]:
    for table in overrides or (NO_OVERRIDE,):
        crossed = {**table.sweep, **sweep}
        for values in itertools.product(*crossed.values()):
            yield table, dict(zip(crossed, values, strict=True))


def _condition(spec: UserTables, table: Override, point: Point, keys: Iterable[str]) -> Condition:
    """Return the condition of an override and a point of the sweeps."""
    name = label(point, table.name) or spec.preset
    where = f" (condition {name!r})" if point or table.name else ""
    preset = point.get("preset", table.preset or spec.preset)
    user = spec.sections
    if table.preset and "preset" not in point:
        user = for_control(_preset(preset, where)["learner"], user)
    sections = sections_of(table)
    points = (expand_sections(nested(key, v)) for key, v in point.items() if key != "preset")
    for layer in (sections, *points):
        user = merge(for_control(layer.get("learner", {}), user), layer)
    if "preset" in point:
        user = for_control(_preset(preset, where)["learner"], user)
    settings = resolve(preset, user, where, (*spec.unset, *table.unset))
    stages = []
    for stage in spec.curriculum if table.curriculum is None else table.curriculum:
        changed = _changed(
            settings, {"scenario": stage.scenario}, f" (stage {stage.name!r}){where}"
        )
        stages.append(Stage(stage.name, stage.episodes, changed.scenario))
    evaluations = [
        (other, _reevaluation(settings, changes, f" (evaluation {other!r}){where}"))
        for other, changes in spec.evaluations.items()
    ]
    columns: Point = {"name": table.name} if table.name else {}
    values = {**{key: value for key, value in flat(sections) if value != {}}, **point}
    columns |= {key: column_value(values[key]) if key in values else "" for key in keys}
    columns = columns or {"preset": spec.preset}
    return Condition(name, columns, settings, tuple(evaluations), tuple(stages))


def _preset(name: object, where: str) -> SpecTable:
    if not isinstance(name, str) or name not in PRESETS:
        raise SpecError(f"preset = {show(name)}: {closest(name, PRESETS)}{where}")
    return PRESETS[name]


def sections_of(own: Settings) -> TomlTable:
    """Return the tables of a spec or an override that describe a condition."""
    table = own.model_dump(include={"agents", *SECTIONS})
    return {key: value for key, value in table.items() if value is not None}


def _differing(point: Point, other: Point) -> str:
    """Return the swept keys in which two points differ."""
    texts, other_texts = ({k: show(v, width=None) for k, v in p.items()} for p in (point, other))
    keys = [key for key in texts if texts[key] != other_texts.get(key, texts[key])]
    return ", ".join(f"{SWEEP}.{key}" for key in keys)


def _changed(settings: ConditionSettings, changes: SpecTable, where: str) -> ConditionSettings:
    """Return settings with some tables changed."""
    return _validate(override(settings.model_dump(), changes), where)


def _reevaluation(settings: ConditionSettings, changes: SpecTable, where: str) -> ConditionSettings:
    """Return settings with a changed scenario, topology and decision."""
    tables: TomlTable = {"scenario": dict(changes)}
    for name in ("topology", "learner"):
        if name in changes:
            tables[name] = expand_section(name, tables["scenario"].pop(name))
    other = next((key for key in tables.get("learner", {}) if key != "decision"), None)
    if other is not None:
        raise SpecError(f"learner.{other}: a trained team may change its decision alone{where}")
    return _changed(settings, tables, where)


def _validate(table: SpecTable, where: str) -> ConditionSettings:
    try:
        return ConditionSettings.model_validate(tuples(table), strict=True)
    except ValidationError as error:
        raise SpecError(explain(error, ConditionSettings, table, swept_in=SWEEP) + where) from None


def expand_section(name: str, value: object) -> TomlTable:
    """Return the table of a section: the table itself, or what a topology's text stands for.

    Examples
    --------
    >>> expand_section("topology", "chain:reversed")
    {'kind': 'chain', 'order': 'reversed'}
    """
    if isinstance(value, Mapping):
        return dict(value)
    is_topology = name.rpartition(".")[2] == "topology"
    if not is_topology or not isinstance(value, str):
        allowed = "must be a name or a table" if is_topology else "must be a table"
        hint = several((name, "kind"), value, allowed, SWEEP) * is_topology
        raise SpecError(f"{name} = {show(value)}: {allowed}{hint}")
    with refused(name.removesuffix("topology")):
        settings = parse(value)
    return {"kind": settings.kind, **settings.model_dump(exclude_unset=True)}


def expand_sections(table: SpecTable) -> TomlTable:
    """Return a table with a table for each section."""
    return {key: expand_section(key, v) if key in SECTIONS else v for key, v in table.items()}


def expand(table: SpecTable, where: str) -> TomlTable:
    """Return the table of a spec or an override with tables as sections and dotted swept keys.

    Parameters
    ----------
    table
        The table of the user.
    where
        Prefix of its keys in messages; empty for a spec.

    Raises
    ------
    SpecError
        If a section is no table, or a swept key is unknown or has no distinct values.
    """
    table = dict(table)
    for name in SECTIONS:
        if name in table:
            table[name] = expand_section(f"{where}{name}", table[name])
    known = known_tables({} if where else table)
    for name in (SWEEP, "tune"):
        if isinstance(table.get(name), Mapping):
            table[name] = dict(_sweep(table[name], f"{where}{name}", known))
    return table


def known_tables(table: SpecTable) -> tuple[type[Settings], TomlTable]:
    """Return the model of conditions, and the tables that all conditions of a spec share.

    A misplaced key is searched in them. They are empty for an override, which has no known kinds.
    """
    preset = PRESETS.get(str(table.get("preset", "default")), PRESETS["default"])
    own = {name: table[name] for name in SECTIONS if isinstance(table.get(name), Mapping)}
    return ConditionSettings, override(preset, own) if table else {}


def _sweep(
    table: SpecTable, where: str, known: tuple[type[Settings], TomlTable]
) -> Iterator[tuple[str, object]]:
    """Yield dotted keys with their lists of values."""
    entries = [*flat(table)]
    keys_of_values = [key for key, _ in entries]
    for key, values in entries:
        if keys_of_values.count(key) > 1:
            raise SpecError(f"{where}.{key} = {show(values)}: the key stands twice")
        head, _, tail = key.partition(".")
        if key not in ("preset", "agents", "topology") and not (head in SECTIONS and tail):
            keys = [*(f"{name}.*" for name in SECTIONS), "preset", "agents", "topology"]
            hint = misplaced(key, *known) or closest(key, keys)
            raise SpecError(f"{where}.{key}: unknown key; {hint}")
        if not isinstance(values, list | tuple) or not values:
            raise SpecError(f"{where}.{key} = {show(values)}: must be a list of at least one value")
        (value, times) = Counter(show(value, width=None) for value in values).most_common(1)[0]
        if times > 1:
            raise SpecError(f"{where}.{key} = {show(values)}: holds the same value twice, {value}")
        yield key, values
