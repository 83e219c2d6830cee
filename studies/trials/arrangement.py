"""What a trial describes, built: its world and the team that acts in it.

A trial is known by its content alone, see `nested_agents.studies.trials.trial`, so that commands
that read results import nothing that learns.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

from ...core.agents.loop import policy_seed
from ...core.agents.rows import carried_rows
from ...core.agents.team import Team, of_fuzzy_agents
from ...core.interface.acting import Actors
from ...core.interface.measures import Measure, measures_of
from ...core.interface.scenario import Scenario
from ...core.learners import LearnerSettings, TeamSettings
from ...core.numerics.arrays import IntArray
from ...core.plugins.settings import ScenarioSettings
from ...core.policies.seen import SeenScenario
from ..errors import SpecError
from ..spec.conditions import Condition, ConditionSettings
from ..spec.spec import Spec
from .measures import joined


class Arrangement(NamedTuple):
    """A world and those who act in it."""

    world: Scenario
    """As the settings describe it."""
    scenario: Scenario
    """The same as the agents see it, which may be as one agent."""
    team: Actors
    """The agents."""

    def continue_from(self, former: Arrangement, settings: TeamSettings) -> None:
        """Let the team begin where that of another world ended.

        Raises
        ------
        ValueError
            If it cannot, see `carried_rows` and `Team.continue_from`; one line.
        """
        rows = self._rows(former, settings)
        of_fuzzy_agents(self.team).continue_from(of_fuzzy_agents(former.team), rows)

    def with_trained(self, former: Arrangement, settings: TeamSettings) -> Arrangement:
        """Return it with the team that was trained in another world: to be evaluated, not to learn.

        That is the former team itself if the agents are the same, else one that takes over.

        Raises
        ------
        ValueError
            As `continue_from`.
        """
        rows = self._rows(former, settings)
        if self.scenario.agents == former.scenario.agents:
            return self._replace(team=former.team)
        of_fuzzy_agents(self.team).continue_from(of_fuzzy_agents(former.team), rows)
        return self

    def _rows(self, former: Arrangement, settings: TeamSettings) -> IntArray:
        shared = isinstance(settings, LearnerSettings) and settings.weights == "role"
        return carried_rows(former.scenario, self.scenario, shared=shared)


def arrange(settings: ConditionSettings, seed: int) -> Arrangement:
    """Return the world of a condition and its untrained team.

    Raises
    ------
    ValueError
        If the settings do not fit together; one line.
    """
    world = settings.scenario.build()
    scenario, hierarchy = settings.arrange(world)
    learner, source = settings.learner, policy_seed(seed)
    if isinstance(learner, LearnerSettings):
        team: Actors = Team(learner, scenario, hierarchy, source)
    else:
        scenario = SeenScenario(scenario)
        team = learner.build(scenario, source)
    return Arrangement(world, scenario, team)


def build(settings: ConditionSettings, seed: int) -> tuple[Scenario, Team]:
    """Return the scenario and the untrained team of fuzzy agents of a condition; see `arrange`."""
    found = arrange(settings, seed)
    return found.scenario, of_fuzzy_agents(found.team)


def check(spec: Spec) -> tuple[Measure, ...]:
    """Return what a study measures of its episodes, if all its conditions can be built.

    Raises
    ------
    SpecError
        If one cannot be, or their measures do not fit together; before anything is run or written.
    """
    conditions = spec.conditions()
    found = []
    with spec.sources.active():
        for condition in conditions:
            where = f" (condition {condition.label!r})" if len(conditions) > 1 else ""
            found += [measures_of(world) for world in _worlds(condition, where)]
    return joined(found, conditions[0].columns)


def _worlds(condition: Condition, where: str) -> Iterator[Scenario]:
    """Yield a condition's own world and those of its stages and evaluations, if all can be built.

    Raises
    ------
    SpecError
        If one cannot be, or what is learned in one means nothing in the next.
    """
    settings = condition.settings
    own = _built(settings, where)
    yield own.world
    reached: Arrangement | None = None
    for stage in condition.curriculum:
        there = _built(_changed(settings, stage.scenario), f" (stage {stage.name!r}){where}")
        yield there.world
        if reached is not None:
            with _naming(f"curriculum.{stage.name}", where):
                there.continue_from(reached, settings.learner)
        reached = there
    if reached is not None:
        with _naming("curriculum", where):
            own.continue_from(reached, settings.learner)
    for name, scenario in condition.evaluations:
        there = _built(_changed(settings, scenario), f" (evaluation {name!r}){where}")
        yield there.world
        with _naming(f"evaluations.{name}", where):
            there.with_trained(own, settings.learner)


def _changed(settings: ConditionSettings, scenario: ScenarioSettings) -> ConditionSettings:
    return settings.model_copy(update={"scenario": scenario})


def _built(settings: ConditionSettings, where: str) -> Arrangement:
    try:
        found = arrange(settings, 0)
        learner = settings.learner
        if isinstance(learner, LearnerSettings) and learner.decision.rule != "value":
            found.scenario.reset(0)
            found.team.check(found.scenario.predict())
    except ValueError as error:
        raise SpecError(f"{error}{where}") from None
    except SystemExit as error:
        raise SpecError(f"the scenario or topology calls sys.exit({error.code}){where}") from None
    return found


@contextmanager
def _naming(key: str, where: str) -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        raise SpecError(f"{key}: {error}{where}") from None
