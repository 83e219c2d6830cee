"""Conditions: what a study compares, and what a trial of one depends on besides seed and length.

A curriculum is what a team is trained on before the scenario of its condition. A stage of it is a
number of episodes in a scenario, described by changes of the condition's own: what a sweep or an
override says of it holds in the stages, too, unless they say otherwise.
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
from ...core.interface.scenario import Scenario
from ...core.learners import LEARNERS, LearnerSettings, TeamSettings
from ...core.learners.batch import BatchTDSettings
from ...core.learners.written import WrittenSettings
from ...core.plugins.registry import Plugged
from ...core.plugins.settings import (
    FailureSpan,
    ScenarioSettings,
    Settings,
    check_team,
    unwritten,
)
from ...scenarios import DEFAULT, SCENARIOS
from ...scenarios.faults.perception import perceived
from ...topologies import build
from ...topologies.config import Topology, parse
from .tables import SpecTable

SECONDS_PER_PAIR = 1e-8
"""What a decision takes at least for every pair of agents, of whatever scenario [s]."""

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
    scenario: SpecTable = Field(default_factory=dict)
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
        scenario = perceived(join_agents(world, self.agents), self.scenario.perception)
        try:
            check_team(len(scenario.agents), SECONDS_PER_PAIR)
        except ValueError as error:
            raise ValueError(f"scenario: has {len(scenario.agents)} agents: {error}") from None
        pairs = scenario.interactions
        return scenario, build(self.topology, scenario.agents, scenario.groups, pairs)

    @property
    def failure_spans(self) -> tuple[FailureSpan, ...]:
        """When failures of the scenario begin and end, or agents leave and return."""
        left = [f for f in self.topology.failures if isinstance(f, LeftAgents)]
        return (*self.scenario.failure_spans, *((f.episode, f.end_episode) for f in left))

    @property
    def onset(self) -> int | None:
        """Episode in which the first failure begins, if any does."""
        return min((begin for begin, _ in self.failure_spans), default=None)

    def acts_as(self, other: ConditionSettings) -> bool:
        """Return whether topology, learner and perception are those of `other`."""
        own = self.topology, self.learner, self.scenario.perception
        return own == (other.topology, other.learner, other.scenario.perception)

    def warnings(self) -> tuple[str, ...]:
        """Return what of its topology says nothing to its learner, a line each."""
        learner = f"learner.kind = {self.learner.kind!r}"
        topology = self.topology
        if _considers(self.learner):
            return ()
        if not self.learner.uses_hierarchy:
            ignored = topology != parse("chain")
            return (f"topology: left out, {learner} passes no actions down",) if ignored else ()
        ignored = topology.lookahead != "descendants"
        return (f"topology.lookahead: left out, {learner} has no lookahead",) if ignored else ()

    def remarks(self) -> tuple[str, ...]:
        """Return whose plans do not know whose weights, a line for each part of a mixed team.

        A written value of nothing is named as well.
        """
        learner = self.learner
        if isinstance(learner, WrittenSettings) and not learner.value:
            return ("learner.value: nothing is worth anything, so that actions are random",)
        if not isinstance(learner, MixedSettings) or self.topology.lookahead == "none":
            return ()
        return tuple(
            f"learner.parts[{k}]: plans for agents of other parts by its own values alone: nobody "
            "knows the weights of another part"
            for k, part in enumerate(learner.parts)
            if len(learner.parts) > 1 and _considers(part.learner)
        )

    def canonical(self) -> str:
        """Return the JSON text that equal settings share, whatever wrote them."""
        return json.dumps(
            self.model_dump(mode="json"), sort_keys=True, separators=(",", ":"), allow_nan=False
        )


def _considers(learner: TeamSettings) -> bool:
    """Return whether agents try actions of others before they decide."""
    if isinstance(learner, MixedSettings):
        return any(_considers(part.learner) for part in learner.parts)
    return isinstance(learner, LearnerSettings) and not learner.values_actions


class Override(Settings):
    """A named set of tables laid over those of a spec."""

    name: Name
    """How its conditions are called."""
    preset: str | None = None
    """The preset under its tables; none: the spec's."""
    scenario: SpecTable = Field(default_factory=dict)
    """Laid over the spec's scenario."""
    agents: Granularity | None = None
    """In place of the spec's; none: the spec's."""
    topology: SpecTable = Field(default_factory=dict)
    """Laid over the spec's topology."""
    learner: SpecTable = Field(default_factory=dict)
    """Laid over the spec's learner."""
    sweep: Mapping[str, tuple[Any, ...]] = Field(default_factory=dict)
    """Lists of values by dotted key, for this override alone."""
    curriculum: Curriculum | None = None
    """Stages in place of the spec's; none: the spec's."""


class Condition(NamedTuple):
    """What one part of a study's trials have in common."""

    label: str
    """Short name, unique within its study."""
    columns: SpecTable
    """What tells it from the others, as the columns of a result: `name` if there are overrides, the
    swept keys (empty where an override does not sweep), `preset` if there is neither."""
    settings: ConditionSettings
    """The resolved settings."""
    evaluations: tuple[tuple[str, ConditionSettings], ...] = ()
    """Names and settings under which its trained teams are evaluated beside its own: other
    scenarios, topologies, decisions."""
    curriculum: tuple[Stage, ...] = ()
    """What its teams are trained on before."""
    left_out: tuple[str, ...] = ()
    """SpecTable of its preset, or of what the scenario lays over that, which its kinds have not or
    refuse."""
    other_kinds: tuple[str, ...] = ()
    """Which kinds these are, as ``learner.kind = 'fitted-q'``; where nothing is left out, none."""
    same: tuple[str, ...] = ()
    """Labels of controls that would be the same, and are left out."""

    @property
    def tables(self) -> list[Any]:
        """Its settings and those of its evaluations and stages, as tables."""
        others = [other.model_dump(mode="json") for _, other in self.evaluations]
        stages = [stage.table() for stage in self.curriculum]
        return [self.settings.model_dump(mode="json"), *others, *stages]
