"""Conditions: what a study compares, as a preset, tables, overrides and sweeps span it.

Every override by name is crossed with its own sweep and with the spec's; without overrides the
spec's tables alone are. Layers, each over the one before: the defaults of the settings, the preset,
what the scenario lays over it, the spec's tables, the override's tables, the point of the sweeps.

A curriculum is what a team is trained on before the scenario of its condition. A stage of it is a
number of episodes in a scenario, described by changes of the condition's own: what a sweep or an
override says of it holds in the stages, too, unless they say otherwise.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Any, NamedTuple, cast

from pydantic import AfterValidator, Field, ValidationError

from ...core.agents.joint import Granularity, join_agents
from ...core.hierarchy.hierarchy import Hierarchy
from ...core.interface.scenario import Scenario
from ...core.learners import LEARNERS, LearnerSettings, TeamSettings
from ...core.learners.batch import BatchTDSettings
from ...core.plugins.registry import Plugged
from ...core.plugins.settings import (
    ScenarioSettings,
    Settings,
    check_team,
    closest,
    tuples,
    unwritten,
)
from ...scenarios import DEFAULT, SCENARIOS
from ...topologies import build
from ...topologies.config import Topology, parse
from ..errors import SpecError, refused, show
from .presets import PRESETS
from .tables import TomlTable, explain, flat, label, misplaced, nested, overlay, scalar

SECONDS_PER_PAIR = 1e-8
"""What a decision takes at least for every pair of agents, of whatever scenario [s]."""
SECTIONS = ("scenario", "topology", "learner")


Length = Annotated[int, Field(ge=1, le=1_000_000)]
"""A number of episodes, or of steps."""


def _printable(name: str) -> str:
    if not name.strip() or not name.isprintable():
        raise ValueError("must be a name that can be printed")
    return name


Name = Annotated[str, AfterValidator(_printable)]
"""How users call something of theirs."""


class StageSettings(Settings):
    """A stage of a curriculum, as it stands in a spec."""

    name: Name
    """How its episodes are called."""
    episodes: Length
    """Training episodes in it."""
    scenario: Mapping[str, Any] = Field(default_factory=dict)
    """Laid over the condition's scenario."""


def _distinct(stages: tuple[StageSettings, ...]) -> tuple[StageSettings, ...]:
    if len({stage.name for stage in stages}) < len(stages):
        raise ValueError("must be stages of distinct names")
    return stages


Curriculum = Annotated[tuple[StageSettings, ...], AfterValidator(_distinct)]
"""Stages in the order in which they are trained."""


class Stage(NamedTuple):
    """A stage of a curriculum, resolved for a condition."""

    name: str
    episodes: int
    scenario: ScenarioSettings

    def table(self) -> dict[str, Any]:
        """Return it as a table, fit for JSON."""
        return {**self._asdict(), "scenario": self.scenario.model_dump(mode="json")}


class ConditionSettings(Settings):
    """All that a trial depends on besides its seed and its length."""

    scenario: Annotated[ScenarioSettings, Plugged(SCENARIOS)] = Field(
        default_factory=lambda: cast(ScenarioSettings, SCENARIOS.parsed(DEFAULT))
    )
    agents: Annotated[Granularity, unwritten("actuator")] = "actuator"
    topology: Topology = parse("chain")
    learner: Annotated[TeamSettings, Plugged(LEARNERS)] = BatchTDSettings()

    def arrange(self, world: Scenario) -> tuple[Scenario, Hierarchy]:
        """Return a world as the agents see it, and their hierarchy.

        Raises
        ------
        ValueError
            If agents or topology do not fit the world, or agents are too many by an estimate; one
            line that names the culprit.
        """
        scenario = join_agents(world, self.agents)
        try:
            check_team(len(scenario.agents), SECONDS_PER_PAIR)
        except ValueError as error:
            raise ValueError(f"scenario: has {len(scenario.agents)} agents: {error}") from None
        own = scenario.interactions
        return scenario, build(self.topology, scenario.agents, scenario.groups, own)

    def acts_as(self, other: ConditionSettings) -> bool:
        """Return whether topology and learner are those of `other`."""
        return (self.topology, self.learner) == (other.topology, other.learner)

    def warnings(self) -> tuple[str, ...]:
        """Return what of its topology says nothing to its learner, a line each."""
        learner, topology = f"learner.kind = {self.learner.kind!r}", self.topology
        if isinstance(self.learner, LearnerSettings) and not self.learner.values_actions:
            return ()
        if not self.learner.uses_hierarchy:
            ignored = topology != parse("chain")
            return (f"topology: left out, {learner} passes no actions down",) if ignored else ()
        ignored = topology.considers != "descendants"
        return (f"topology.considers: left out, {learner} considers nobody",) if ignored else ()

    def canonical(self) -> str:
        """Return the JSON text that equal settings share, whatever wrote them."""
        return json.dumps(
            self.model_dump(mode="json"), sort_keys=True, separators=(",", ":"), allow_nan=False
        )


class Override(Settings):
    """A named set of tables laid over those of a spec."""

    name: Name
    """How its conditions are called."""
    preset: str | None = None
    """The preset under its tables; none: the spec's."""
    scenario: Mapping[str, Any] = Field(default_factory=dict)
    """Laid over the spec's scenario."""
    agents: Granularity | None = None
    """In place of the spec's; none: the spec's."""
    topology: Mapping[str, Any] = Field(default_factory=dict)
    """Laid over the spec's topology."""
    learner: Mapping[str, Any] = Field(default_factory=dict)
    """Laid over the spec's learner."""
    sweep: Mapping[str, tuple[Any, ...]] = Field(default_factory=dict)
    """Lists of values by dotted key, for this override alone."""
    curriculum: Curriculum | None = None
    """Stages in place of the spec's; none: the spec's."""


class Condition(NamedTuple):
    """What one part of a study's trials have in common."""

    label: str
    """Short name, unique within its study."""
    columns: Mapping[str, Any]
    """What tells it from the others, as the columns of a result: `name` if there are overrides, the
    swept keys (empty where an override does not sweep), `preset` if there is neither."""
    settings: ConditionSettings
    """The resolved settings."""
    evaluations: tuple[tuple[str, ConditionSettings], ...] = ()
    """Names and settings under which its trained teams are evaluated beside its own: other
    scenarios, topologies, decisions."""
    curriculum: tuple[Stage, ...] = ()
    """What its teams are trained on before."""

    @property
    def tables(self) -> list[Any]:
        """Its settings and those of its evaluations and stages, as tables."""
        others = [other.model_dump(mode="json") for _, other in self.evaluations]
        stages = [stage.table() for stage in self.curriculum]
        return [self.settings.model_dump(mode="json"), *others, *stages]


def layer_of(settings: Settings) -> TomlTable:
    """Return what a spec or an override lays over what is below it: its sections and agents."""
    layer: TomlTable = {name: dict(getattr(settings, name)) for name in SECTIONS}
    agents = getattr(settings, "agents", None)
    return layer if agents is None else layer | {"agents": agents}


def below(table: Mapping[str, Any]) -> tuple[type[Settings], TomlTable]:
    """Return the model of conditions, and what they have at least of a spec's table and preset.

    Nothing is known of the kinds of an override's, whose table is empty here.
    """
    preset = PRESETS.get(str(table.get("preset", "default")), PRESETS["default"])
    own = {name: table[name] for name in SECTIONS if isinstance(table.get(name), Mapping)}
    return ConditionSettings, _laid([preset.table, own]) if table else {}


def grid(
    preset: str,
    spec: Settings,
    sweep: Mapping[str, Sequence[Any]],
    overrides: Sequence[Override] = (),
    evaluations: Mapping[str, Mapping[str, Any]] | None = None,
    curriculum: Sequence[StageSettings] = (),
) -> tuple[Condition, ...]:
    """Return the conditions: override by override, the last key of the sweeps varying fastest.

    Parameters
    ----------
    preset
        Name of the preset under conditions that name none.
    spec
        What has sections of its own, which lie over the preset, see `layer_of`.
    sweep
        Lists of values by dotted key.
    overrides
        Crossed with `sweep`; none: the tables as they are.
    evaluations
        By name, what is laid over each condition's scenario, and under ``topology`` and
        ``learner.decision`` over those.
    curriculum
        Stages before the training of conditions whose override names none.

    Raises
    ------
    SpecError
        If a condition is invalid, or two are the same.
    """
    conditions: list[Condition] = []
    seen: dict[str, str] = {}
    labels: set[str] = set()
    keys = list(dict.fromkeys([*(key for o in overrides for key in o.sweep), *sweep]))
    source = "overrides" if overrides else "sweep"
    for override, point in _points(overrides, sweep):
        name = label(point, override.name if override else "") or preset
        where = f" (condition {name!r})" if point or override else ""
        settings = resolve(preset, layer_of(spec), point, where, override)
        own = override.curriculum if override else None
        stages = tuple(
            Stage(s.name, s.episodes, _stage(settings, s.scenario, f" (stage {s.name!r}){where}"))
            for s in (curriculum if own is None else own)
        )
        content = json.dumps([settings.canonical(), *(stage.table() for stage in stages)])
        other = seen.setdefault(content, name)
        if other != name or name in labels:
            raise SpecError(f"{source}: conditions {other!r} and {name!r} are the same")
        labels.add(name)
        columns: dict[str, Any] = {"name": override.name} if override else {}
        columns |= {key: scalar(point[key]) if key in point else "" for key in keys}
        others = tuple(
            (other, _reevaluation(settings, changes, f" (evaluation {other!r}){where}"))
            for other, changes in (evaluations or {}).items()
        )
        columns = columns or {"preset": preset}
        conditions.append(Condition(name, columns, settings, others, stages))
    return tuple(conditions)


def _points(
    overrides: Sequence[Override], sweep: Mapping[str, Sequence[Any]]
) -> Iterator[tuple[Override | None, dict[str, Any]]]:
    for override in overrides or (None,):
        crossed = {**(override.sweep if override else {}), **sweep}
        for values in itertools.product(*crossed.values()):
            yield override, dict(zip(crossed, values, strict=True))


def resolve(
    preset: str,
    tables: Mapping[str, Any],
    point: Mapping[str, Any],
    where: str = "",
    override: Override | None = None,
) -> ConditionSettings:
    """Return the settings of one condition, layer by layer."""
    own = override.preset if override else None
    name = point.get("preset", preset if own is None else own)
    if not isinstance(name, str) or name not in PRESETS:
        raise SpecError(f"preset = {show(name)}: {closest(name, PRESETS)}{where}")
    if own is not None or "preset" in point:
        tables = _for_preset(name, tables)
    own_layers = [tables, layer_of(override) if override else {}]
    own_layers += [nested(key, value) for key, value in point.items() if key != "preset"]
    table = _laid([PRESETS[name].table, *own_layers])
    scenario = _validated({"scenario": table["scenario"]}, where).scenario
    if scenario_defaults := scenario.scenario_defaults(name):
        table = _laid([PRESETS[name].table, scenario_defaults, *own_layers])
    return _validated(table, where)


def _for_preset(name: str, tables: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a spec's tables without what tunes learning, if a preset is a control: it has not."""
    learner = tables.get("learner", {})
    if "kind" in learner or PRESETS[name].table["learner"]["kind"] != "frozen":
        return tables
    kept = {key: v for key, v in learner.items() if key in LearnerSettings.model_fields}
    return {**tables, "learner": kept}


def _laid(layers: Sequence[Mapping[str, Any]]) -> TomlTable:
    """Return the table of layers, each over the one before, the first over the defaults."""
    table = ConditionSettings().model_dump()
    for layer in layers:
        expanded = {k: section(k, v) if k in SECTIONS else v for k, v in layer.items()}
        table = overlay(table, expanded, ConditionSettings)
    return table


def _stage(settings: ConditionSettings, changes: Mapping[str, Any], where: str) -> ScenarioSettings:
    """Return a condition's scenario with changes laid over it."""
    table = overlay(settings.model_dump(), {"scenario": dict(changes)}, ConditionSettings)
    return _validated(table, where).scenario


def _reevaluation(
    settings: ConditionSettings, changes: Mapping[str, Any], where: str
) -> ConditionSettings:
    """Return a condition's settings with changes laid over scenario, topology and decision."""
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
        raise SpecError(explain(error, ConditionSettings, table) + where) from None


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
        allowed = "a name or a table" if is_topology else "a table"
        raise SpecError(f"{name} = {show(value)}: must be {allowed}")
    with refused(name.removesuffix("topology")):
        return parse(value).model_dump()


def expand(table: Mapping[str, Any], where: str) -> TomlTable:
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
    table: Mapping[str, Any], where: str, reach: tuple[type[Settings], TomlTable]
) -> Iterable[tuple[str, Any]]:
    for key, values in flat(table):
        head, _, tail = key.partition(".")
        if key not in ("preset", "agents", "topology") and not (head in SECTIONS and tail):
            known = [*(f"{name}.*" for name in SECTIONS), "preset", "agents", "topology"]
            hint = misplaced(key, *reach) or closest(key, known)
            raise SpecError(f"{where}.{key}: unknown key; {hint}")
        if not isinstance(values, list | tuple) or not values:
            raise SpecError(f"{where}.{key} = {show(values)}: must be a list of at least one value")
        yield key, values
