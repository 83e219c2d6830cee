"""Layers of settings: defaults, preset, scenario, spec, override and sweep make a condition.

Each override is combined with its own sweep and with that of the spec. Each layer overrides the one
before: the defaults of the settings, the preset, the changes of the preset by the scenario, the
tables of the spec, the tables of the override, the point of the sweeps.

Keys of the preset and of the scenario are dropped if a kind that the user has chosen does not have
or refuses them. Keys that the user wrote are refused instead.
"""

from __future__ import annotations

import itertools
import json
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple, Protocol

from pydantic import ValidationError

from ...core.agents.joint import Granularity
from ...core.learners import LEARNERS, LearnerSettings, TeamSettings
from ...core.learners.batch import MOST_RULES, BatchTDSettings
from ...core.learners.fitted_q import FittedQSettings
from ...core.plugins.problems import explain, misplaced, problems_of, several
from ...core.plugins.settings import ScenarioSettings, Settings, tuples
from ...core.plugins.words import closest, show
from ...core.search.best_response import BestResponseSettings
from ...core.search.coordination import MaxPlusSettings, VariableEliminationSettings
from ...core.search.settings import DecisionSettings
from ...scenarios import DEFAULT
from ...topologies.config import parse
from ..errors import SpecError, refused
from .conditions import Condition, ConditionSettings, Override, Stage, StageSettings
from .controls import LEARN_NOTHING
from .presets import PRESETS
from .tables import SWEEP, SpecTable, TomlTable, flat, label, nested, overlay, scalar, without

SECTIONS = ("scenario", "topology", "learner")

Layer = SpecTable
"""A table or a point of a sweep that overrides the layers below."""
Layers = Sequence[Layer]
"""Layers; each overrides the one before."""


class Sections(Protocol):
    """A spec or an override, which have these tables."""

    @property
    def scenario(self) -> Layer:
        """Changes of the scenario."""

    @property
    def topology(self) -> Layer:
        """Changes of the topology."""

    @property
    def learner(self) -> Layer:
        """Changes of the learner."""

    @property
    def agents(self) -> Granularity | None:
        """Granularity; None for that of the layers below."""


def layer_of(own: Sections) -> TomlTable:
    """Return the layer of a spec or an override: its sections and agents."""
    layer: TomlTable = {
        "scenario": dict(own.scenario),
        "topology": dict(own.topology),
        "learner": dict(own.learner),
    }
    return layer if own.agents is None else layer | {"agents": own.agents}


def below(table: Layer) -> tuple[type[Settings], TomlTable]:
    """Return the model of conditions, and the table that all conditions of a spec share.

    The table is empty for an override, because its kinds are unknown here.
    """
    preset = PRESETS.get(str(table.get("preset", "default")), PRESETS["default"])
    own = {name: table[name] for name in SECTIONS if isinstance(table.get(name), Mapping)}
    return ConditionSettings, _lay([preset.table, own]) if table else {}


def grid(
    preset: str,
    spec: Sections,
    sweep: Mapping[str, Sequence[object]],
    overrides: Sequence[Override] = (),
    evaluations: Mapping[str, Layer] | None = None,
    curriculum: Sequence[StageSettings] = (),
) -> tuple[Condition, ...]:
    """Return the conditions: override by override, the last key of the sweeps varying fastest.

    Parameters
    ----------
    preset
        Name of the preset of conditions that do not name one.
    spec
        The spec, which overrides the preset.
    sweep
        Lists of values by dotted key.
    overrides
        Crossed with `sweep`; none: the tables as they are.
    evaluations
        Changes of the scenario of each condition by name; under ``topology`` and
        ``learner.decision``, changes of these.
    curriculum
        Stages before the training of conditions without stages in their override.

    Raises
    ------
    SpecError
        If a condition is invalid, or two that learn are the same. Of controls that are the same
        the first one stands, see `Condition.same`.
    """
    conditions: list[Condition] = []
    points: dict[str, tuple[str, Layer]] = {}
    labels: set[str] = set()
    keys = list(dict.fromkeys([*(key for o in overrides for key in o.sweep), *sweep]))
    for override, point in _points(overrides, sweep):
        name = label(point, override.name if override else "") or preset
        where = f" (condition {name!r})" if point or override else ""
        resolved = resolve(preset, layer_of(spec), point, where, override)
        settings = resolved.settings
        own = override.curriculum if override else None
        stages = tuple(
            Stage(s.name, s.episodes, _stage(settings, s.scenario, f" (stage {s.name!r}){where}"))
            for s in (curriculum if own is None else own)
        )
        content = json.dumps([settings.canonical(), *(stage.table() for stage in stages)])
        other, other_point = points.setdefault(content, (name, point))
        is_same = other_point is not point
        if is_same and settings.learner.kind in LEARN_NOTHING and other != name:
            _leave_out(name, other, conditions)
            continue
        if is_same or name in labels:
            raise SpecError(
                f"{_differing(point, other_point) or ('overrides' if overrides else 'sweep')}: "
                f"conditions {other!r} and {name!r} are the same: leave one out, or give it other "
                "settings"
            )
        labels.add(name)
        columns: dict[str, object] = {"name": override.name} if override else {}
        columns |= {key: scalar(point[key]) if key in point else "" for key in keys}
        evaluated = tuple(
            (other, _reevaluation(settings, changes, f" (evaluation {other!r}){where}"))
            for other, changes in (evaluations or {}).items()
        )
        columns = columns or {"preset": preset}
        left_out = resolved.left_out, resolved.other_kinds
        conditions.append(Condition(name, columns, settings, evaluated, stages, *left_out))
    return tuple(conditions)


def _leave_out(name: str, other: str, conditions: list[Condition]) -> None:
    """Record in a control the name of an equal control, which is left out."""
    at = [condition.label for condition in conditions].index(other)
    same = (*conditions[at].same, name)
    conditions[at] = conditions[at]._replace(same=same)


def _differing(point: Layer, other: Layer) -> str:
    """Return the keys of a sweep in which two points of it differ."""
    texts, other_texts = ({k: show(v, width=None) for k, v in p.items()} for p in (point, other))
    keys = [key for key in texts if texts[key] != other_texts.get(key, texts[key])]
    return ", ".join(f"sweep.{key}" for key in keys)


def _points(
    overrides: Sequence[Override], sweep: Mapping[str, Sequence[object]]
) -> Iterator[tuple[Override | None, dict[str, object]]]:
    for override in overrides or (None,):
        crossed = {**(override.sweep if override else {}), **sweep}
        for values in itertools.product(*crossed.values()):
            yield override, dict(zip(crossed, values, strict=True))


class Resolved(NamedTuple):
    """Settings of a condition, and ignored keys of its preset."""

    settings: ConditionSettings
    left_out: tuple[str, ...] = ()
    """See `Condition`."""
    other_kinds: tuple[str, ...] = ()
    """See `Condition`."""


def resolve(
    preset: str,
    tables: Layer,
    point: Layer,
    where: str = "",
    override: Override | None = None,
) -> Resolved:
    """Return the settings of one condition, layer by layer."""
    own_preset = override.preset if override else None
    name = point.get("preset", preset if own_preset is None else own_preset)
    if not isinstance(name, str) or name not in PRESETS:
        raise SpecError(f"preset = {show(name)}: {closest(name, PRESETS)}{where}")
    own = [tables, layer_of(override) if override else {}]
    own += [nested(key, value) for key, value in point.items() if key != "preset"]
    own = [_expand(layer) for layer in own]
    if "preset" in point:
        own = [for_control(name, layer) for layer in own]
    elif own_preset is not None:  # the keys next to a preset are meant for it
        own[0] = for_control(name, own[0])
    given = PRESETS[name].table
    parts = _settle([_part("scenario", given)], [_part("scenario", t) for t in own], where)
    scenario = parts.settings.scenario
    is_of_another_kind = scenario.kind != given.get("scenario", {}).get("kind", DEFAULT)
    defaults = [PRESETS[name].other_scenarios] if is_of_another_kind else []
    return _settle([given, *defaults, _expand(scenario.scenario_defaults(name))], own, where)


def _part(name: str, table: Layer) -> TomlTable:
    """Return a section of a layer alone."""
    return {name: table[name]} if name in table else {}


def for_control(preset: str, layer: Layer) -> Layer:
    """Return a user's layer without the keys that tune learning, if the preset is a control.

    A control that is defined by its rule of decision, as ``random`` and ``planner`` are, keeps it.
    """
    own = PRESETS[preset].table["learner"]
    if own["kind"] not in LEARN_NOTHING or "learner" not in layer:
        return layer
    fields = LEARNERS.model(own["kind"]).model_fields.keys() - {"kind"}
    kept: TomlTable = {key: value for key, value in layer["learner"].items() if key in fields}
    if "rule" in own.get("decision", {}) and isinstance(kept.get("decision"), Mapping):
        kept["decision"] = {k: v for k, v in kept["decision"].items() if k != "rule"}
    return {**layer, "learner": kept}


def without_learning(point: Mapping[str, object]) -> dict[str, object]:
    """Return values by dotted key without those that tune learning.

    Examples
    --------
    >>> without_learning({"learner.ridge": 3.0, "learner.decision.rule": "reward-and-value"})
    {'learner.decision.rule': 'reward-and-value'}
    """
    return {key: value for key, value in point.items() if not _tunes_learning(key)}


def tuning_keys(keys: Iterable[str]) -> list[str]:
    """Return which dotted keys tune learning, sorted."""
    return sorted({key for key in keys if _tunes_learning(key)})


def _tunes_learning(key: str) -> bool:
    section, _, rest = key.partition(".")
    return section == "learner" and rest.partition(".")[0] not in LearnerSettings.model_fields


def _settle(given: Layers, own: Layers, where: str) -> Resolved:
    """Return the settings of layers, without given keys that the kinds refuse.

    Parameters
    ----------
    given
        Layers of the preset and the scenario.
    own
        Layers of the user, which override the given ones.
    where
        Name of the condition in messages.

    Raises
    ------
    SpecError
        If a key of the user is refused or missing.
    """
    dropped: set[str] = set()
    while True:
        table = _lay([*(without(layer, dropped) for layer in given), *own])
        try:
            settings = ConditionSettings.model_validate(tuples(table), strict=True)
        except ValidationError as error:
            refused_keys = [_key(problem.keys) for problem in problems_of(error, table)]
            line = explain(error, ConditionSettings, table, swept_in=SWEEP) + where
        else:
            refused_keys = [*_refused(settings.learner)]
            line = ""
        giving_way = {k for k in refused_keys if _says(given, k) and not _says(own, k)} - dropped
        if giving_way:
            dropped |= giving_way
        elif line:
            raise SpecError(line)
        else:
            return Resolved(settings, *_left_out(given, table, dropped))


def _key(keys: Sequence[int | str]) -> str:
    """Return the dotted key of a value, or of the list that contains it."""
    names = itertools.takewhile(lambda key: isinstance(key, str), keys)
    return ".".join(map(str, names))


def _says(layers: Layers, key: str) -> bool:
    """Return whether any layer sets a key, a key of its table, or a table around it."""
    written = (other for layer in layers for other, value in flat(layer) if value != {})
    return any(f"{key}.".startswith(f"{k}.") or f"{k}.".startswith(f"{key}.") for k in written)


def _refused(learner: TeamSettings) -> Iterator[str]:
    """Yield the keys of a learner with values that its kinds refuse when a team is built."""
    if not isinstance(learner, LearnerSettings):
        return
    usual = dict(DecisionSettings())
    for key, value in learner.decision:
        if key in _refused_of_decision(learner) and value != usual[key]:
            yield f"learner.decision.{key}"
    order = learner.rule_base.order
    memberships = learner.rule_base.memberships
    is_batch = isinstance(learner, BatchTDSettings | FittedQSettings)
    if is_batch and isinstance(order, int) and (memberships or 0) ** order > MOST_RULES:
        yield "learner.rule_base.order"


def _refused_of_decision(learner: LearnerSettings) -> tuple[str, ...]:
    """Return the keys of a learner's decision that must have their defaults."""
    decision = learner.decision
    if isinstance(learner, FittedQSettings):
        rule = () if decision.rule == "random" else ("rule",)
        return (*rule, "teammates", "value_of", "plan", "evaluator")
    if decision.rule == "random":  # nothing is evaluated
        return ()
    if isinstance(decision.evaluator, MaxPlusSettings | VariableEliminationSettings):
        return ("rule", "teammates", "value_of")
    return ("teammates",) if isinstance(decision.evaluator, BestResponseSettings) else ()


def _left_out(
    given: Layers, table: Layer, dropped: Container[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the keys of given layers that a table is without, and the kinds that are why.

    Ignored keys of a preset's scenario of another kind are expected and not reported.
    """
    written = {key for layer in given for key, value in flat(layer) if value != {}}
    there = dict(flat(table))
    # A word that stands for a table, such as that of an evaluator, is there with all of its keys.
    stands = {*there, *(key.rpartition(".")[0] for key in there)}
    keys = sorted(key for key in written if key in dropped or key not in stands)
    usual = dict(flat(_lay(given))) if keys else {}
    changed = [k for k, v in there.items() if k.endswith(".kind") and usual.get(k, v) != v]
    causes = {key: _cause(key, changed) for key in keys}
    unexpected = {key: kind for key, kind in causes.items() if kind != "scenario.kind"}
    kinds = dict.fromkeys(kind for kind in unexpected.values() if kind is not None)
    return tuple(unexpected), tuple(f"{kind} = {there[kind]!r}" for kind in kinds)


def _cause(key: str, kinds: Iterable[str]) -> str | None:
    """Return the kind that makes a key ignored: that of its table, or of its section."""
    enclosing = [kind for kind in kinds if key.startswith(kind.removesuffix("kind"))]
    section_of_key = key.partition(".")[0]
    same_section = [kind for kind in kinds if kind.partition(".")[0] == section_of_key]
    return max(enclosing or same_section, key=len, default=None)


def _expand(layer: Layer) -> TomlTable:
    """Return a layer with tables as sections."""
    return {key: section(key, v) if key in SECTIONS else v for key, v in layer.items()}


def _lay(layers: Layers) -> TomlTable:
    """Return the merged table of layers over the defaults."""
    table = ConditionSettings().model_dump()
    for layer in layers:
        table = overlay(table, layer, ConditionSettings)
    return table


def _stage(settings: ConditionSettings, changes: Layer, where: str) -> ScenarioSettings:
    """Return the changed scenario of a condition."""
    table = overlay(settings.model_dump(), {"scenario": dict(changes)}, ConditionSettings)
    return _validated(table, where).scenario


def _reevaluation(settings: ConditionSettings, changes: Layer, where: str) -> ConditionSettings:
    """Return the settings of a condition with a changed scenario, topology and decision."""
    parts: TomlTable = {"scenario": dict(changes)}
    for name in ("topology", "learner"):
        if name in parts["scenario"]:
            parts[name] = section(name, parts["scenario"].pop(name))
    other = next((key for key in parts.get("learner", {}) if key != "decision"), None)
    if other is not None:
        raise SpecError(f"learner.{other}: a trained team may change its decision alone{where}")
    return _validated(overlay(settings.model_dump(), parts, ConditionSettings), where)


def _validated(table: TomlTable, where: str) -> ConditionSettings:
    try:
        return ConditionSettings.model_validate(tuples(table), strict=True)
    except ValidationError as error:
        raise SpecError(explain(error, ConditionSettings, table, swept_in=SWEEP) + where) from None


def section(name: str, value: object) -> TomlTable:
    """Return the table of a section: from a table, or for a topology a string.

    Examples
    --------
    >>> section("topology", "chain:reversed")
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
        return parse(value).model_dump()


def expand(table: Layer, where: str) -> TomlTable:
    """Return a spec's or an override's table with its sections and sweep spelled out."""
    table = dict(table)
    for name in SECTIONS:
        if name in table:
            table[name] = section(f"{where}{name}", table[name])
    reach = below({} if where else table)
    for name in ("sweep", "tune"):
        if isinstance(table.get(name), Mapping):
            table[name] = dict(_sweep(table[name], f"{where}{name}", reach))
    return table


def _sweep(
    table: Layer, where: str, reach: tuple[type[Settings], TomlTable]
) -> Iterable[tuple[str, object]]:
    for key, values in flat(table):
        head, _, tail = key.partition(".")
        if key not in ("preset", "agents", "topology") and not (head in SECTIONS and tail):
            known = [*(f"{name}.*" for name in SECTIONS), "preset", "agents", "topology"]
            hint = misplaced(key, *reach) or closest(key, known)
            raise SpecError(f"{where}.{key}: unknown key; {hint}")
        if not isinstance(values, list | tuple) or not values:
            raise SpecError(f"{where}.{key} = {show(values)}: must be a list of at least one value")
        times = Counter(show(value, width=None) for value in values)
        twice = next((value for value, number in times.items() if number > 1), None)
        if twice is not None:
            raise SpecError(f"{where}.{key} = {show(values)}: holds the same value twice, {twice}")
        yield key, values
