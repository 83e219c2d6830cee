"""Conditions of a study: validated settings on which a trial depends besides its seed and length.

A curriculum is a list of stages in which a team is trained before the scenario of its condition. A
stage is a number of episodes in a scenario, described by changes of the condition's own scenario.
Values of sweeps and overrides therefore hold in the stages, too, unless a stage changes them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple, cast

from pydantic import AfterValidator, Field

from ...core.agents.joint import Granularity, join_agents
from ...core.agents.mixed import MixedSettings
from ...core.hierarchy.failures import LeftAgents
from ...core.hierarchy.hierarchy import Hierarchy
from ...core.interface.abilities import interactions_of
from ...core.interface.scenario import Scenario
from ...core.learners import LEARNERS, LearnerSettings, TeamSettings
from ...core.learners.batch import BatchTDSettings
from ...core.learners.written import WrittenSettings
from ...core.plugins.models import Plugged
from ...core.plugins.settings import (
    FailureSpan,
    ScenarioSettings,
    Settings,
    check_team,
)
from ...scenarios import DEFAULT, SCENARIOS
from ...scenarios.faults.perception import perceived
from ...topologies import build
from ...topologies.config import Topology, parse
from .tables import SpecTable

SECONDS_PER_PAIR = 1e-8
"""Minimum time of a decision per pair of agents, in any scenario [s]."""

Length = Annotated[int, Field(ge=1, le=1_000_000)]
"""Number of episodes or steps."""


def _printable(name: str) -> str:
    if not name.strip() or not name.isprintable():
        raise ValueError("must be a name that can be printed")
    if name != name.strip():
        raise ValueError("must not begin or end with a blank")
    return name


Name = Annotated[str, AfterValidator(_printable)]
"""Name given by the user."""


class StageSettings(Settings):
    """A stage of a curriculum, as it stands in a spec."""

    name: Name
    """Name of the stage, which is also the phase of its episodes."""
    episodes: Length
    """Number of training episodes."""
    scenario: SpecTable = Field(default_factory=dict)
    """Changes of the condition's scenario."""


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
    """Validated settings of a condition."""

    scenario: Annotated[ScenarioSettings, Plugged(SCENARIOS)] = Field(
        default_factory=lambda: cast(ScenarioSettings, SCENARIOS.parsed(DEFAULT))
    )
    agents: Granularity = "actuator"
    topology: Topology = parse("chain")
    learner: Annotated[TeamSettings, Plugged(LEARNERS)] = BatchTDSettings()

    def arrange(self, scenario: Scenario) -> tuple[Scenario, Hierarchy]:
        """Return a scenario as the agents perceive it, and their hierarchy.

        Raises
        ------
        ValueError
            If agents or topology do not fit the scenario, or there are too many agents by an
            estimate; one line.
        """
        scenario = perceived(join_agents(scenario, self.agents), self.scenario.perception)
        try:
            check_team(len(scenario.agents), SECONDS_PER_PAIR)
        except ValueError as error:
            raise ValueError(f"scenario: has {len(scenario.agents)} agents: {error}") from None
        pairs = interactions_of(scenario)
        return scenario, build(self.topology, scenario.agents, scenario.groups, pairs)

    @property
    def failure_spans(self) -> tuple[FailureSpan, ...]:
        """Episode in which each failure begins or agents leave, and the first one after it."""
        left = [f for f in self.topology.failures if isinstance(f, LeftAgents)]
        return (*self.scenario.failure_spans, *(f.span for f in left))

    @property
    def onset(self) -> int | None:
        """Episode in which the first failure begins; None without failures."""
        return min((begin for begin, _ in self.failure_spans), default=None)

    def acts_as(self, other: ConditionSettings) -> bool:
        """Return whether topology, learner and perception equal those of `other`."""
        own = self.topology, self.learner, self.scenario.perception
        return own == (other.topology, other.learner, other.scenario.perception)

    def warnings(self) -> tuple[str, ...]:
        """Return a line for each key of the topology that the learner ignores."""
        learner = f"learner.kind = {self.learner.kind!r}"
        topology = self.topology
        if _looks_ahead(self.learner):
            return ()
        if not self.learner.uses_hierarchy:
            ignored = topology != parse("chain")
            return (f"topology: left out, {learner} passes no actions down",) if ignored else ()
        ignored = topology.lookahead != "descendants"
        return (f"topology.lookahead: left out, {learner} has no lookahead",) if ignored else ()

    def remarks(self) -> tuple[str, ...]:
        """Return a line for each part of a mixed team that plans without weights of other parts.

        An empty hand-written value is reported, too.
        """
        learner = self.learner
        if isinstance(learner, WrittenSettings) and not learner.value:
            return ("learner.value = {}: all states have the value 0, so that actions are random",)
        if not isinstance(learner, MixedSettings) or self.topology.lookahead == "none":
            return ()
        return tuple(
            f"learner.parts[{k}]: plans for agents of other parts by its own values, because the "
            "weights of other parts are unknown to it"
            for k, part in enumerate(learner.parts)
            if len(learner.parts) > 1 and _looks_ahead(part.learner)
        )

    def canonical(self) -> str:
        """Return JSON text that is the same for equal settings."""
        return json.dumps(
            self.model_dump(mode="json"), sort_keys=True, separators=(",", ":"), allow_nan=False
        )


def _looks_ahead(learner: TeamSettings) -> bool:
    """Return whether agents search over the actions of other agents."""
    if isinstance(learner, MixedSettings):
        return any(_looks_ahead(part.learner) for part in learner.parts)
    return isinstance(learner, LearnerSettings) and not learner.values_actions


class Override(Settings):
    """A named set of tables that override those of a spec."""

    name: Name
    """Name of its conditions."""
    preset: str | None = None
    """Preset of its conditions. By default, the preset of the spec."""
    unset: tuple[str, ...] = ()
    """Dotted keys of the preset that return to their defaults, in addition to those of the spec."""
    scenario: SpecTable = Field(default_factory=dict)
    """Changes of the scenario of the spec."""
    agents: Granularity | None = None
    """One agent per actuator, per body, or for the team. By default, as in the spec."""
    topology: SpecTable = Field(default_factory=dict)
    """Changes of the topology of the spec."""
    learner: SpecTable = Field(default_factory=dict)
    """Changes of the learner of the spec."""
    sweep: Mapping[str, tuple[Any, ...]] = Field(default_factory=dict)
    """Lists of values by dotted key, for this override alone."""
    curriculum: Curriculum | None = None
    """Stages of training. By default, those of the spec."""


class Condition(NamedTuple):
    """One condition of a study; its trials differ in their seeds."""

    label: str
    """Short name, unique within its study."""
    columns: SpecTable
    """Columns that distinguish it in results: `name` if there are overrides, the swept keys (empty
    where an override neither sweeps nor sets them), `preset` if there is neither."""
    settings: ConditionSettings
    """The resolved settings."""
    evaluations: tuple[tuple[str, ConditionSettings], ...] = ()
    """Names and settings of further evaluations of its trained teams."""
    curriculum: tuple[Stage, ...] = ()
    """Stages in which its teams are trained first."""
    same: tuple[str, ...] = ()
    """Labels of equal controls, which are left out."""

    @property
    def labeled(self) -> dict[str, ConditionSettings]:
        """Settings of the condition and of its evaluations by label."""
        others = {f"{self.label}, {name}": settings for name, settings in self.evaluations}
        return {self.label: self.settings, **others}

    @property
    def tables(self) -> list[SpecTable]:
        """Settings of the condition, its evaluations and its stages as tables."""
        others = [other.model_dump(mode="json") for _, other in self.evaluations]
        stages = [stage.table() for stage in self.curriculum]
        return [self.settings.model_dump(mode="json"), *others, *stages]

    @property
    def content(self) -> str:
        """JSON text that is the same for conditions with equal settings and stages."""
        return json.dumps(
            [self.settings.canonical(), *(stage.table() for stage in self.curriculum)]
        )
