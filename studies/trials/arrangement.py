"""Scenario and team of a condition, of its curriculum and of its further evaluations.

Before a study runs, all its conditions are built once, so settings that do not fit are reported
before anything is written.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from ...core.agents.loop import policy_seed
from ...core.agents.team import Team
from ...core.interface.abilities import options_of
from ...core.interface.measures import Measure, measures_of
from ...core.interface.scenario import Scenario, checked_scenario, has_same_agents
from ...core.plugins.sources import format_error, place
from ..errors import SpecError
from ..spec.conditions import Condition, ConditionSettings, Stage
from ..spec.spec import Spec
from .episodes import join_measures

Evaluations = Sequence[tuple[str, ConditionSettings]]
"""Names and settings of the further evaluations of a trained team."""


class Arrangement(NamedTuple):
    """A scenario and its team."""

    world: Scenario
    """The scenario that the settings describe."""
    scenario: Scenario
    """The same scenario as the team sees it, with one agent if the team decides centrally."""
    team: Team
    """The agents."""

    @property
    def measures(self) -> tuple[Measure, ...]:
        """Measures of an episode: those of the scenario, then the costs of decisions."""
        return (*measures_of(self.world.measures), *self.team.costs)


def arrange(settings: ConditionSettings, seed: int) -> Arrangement:
    """Build the scenario of a condition and its untrained team.

    Raises
    ------
    ValueError
        If the settings do not fit together, in one line.
    """
    world = checked_scenario(settings.scenario.build())
    scenario, hierarchy = settings.arrange(world)
    if options_of(world) is not None and scenario is not world:
        key = "scenario.perception" if settings.scenario.perception else "agents"
        raise ValueError(f"{key}: not for agents below a leader, leave out scenario.leader")
    failures = settings.topology.failures
    team = Team(settings.learner, scenario, hierarchy, policy_seed(seed), failures)
    return Arrangement(world, scenario, team)


def teach(
    own: Arrangement, settings: ConditionSettings, curriculum: Sequence[Stage], seed: int
) -> Iterator[tuple[Stage, Arrangement]]:
    """Yield each stage with its arrangement. The caller trains the team before the next stage.

    The team of a stage starts from the weights of the previous stage. After the last stage the
    team of `own` receives the weights.

    Raises
    ------
    ValueError
        If a stage cannot be built, or a team cannot use the weights of the previous stage.
    """
    previous: Arrangement | None = None
    for stage in curriculum:
        with _naming(f"curriculum.{stage.name}"):
            there = arrange(settings.model_copy(update={"scenario": stage.scenario}), seed)
            if previous is not None:
                there.team.warm_start(previous.team)
        yield stage, there
        previous = there
    if previous is not None:
        with _naming("curriculum"):
            own.team.warm_start(previous.team)


def transfer(
    own: Arrangement, settings: ConditionSettings, evaluations: Evaluations, seed: int
) -> Iterator[tuple[str, Arrangement]]:
    """Yield the name and the arrangement of each further evaluation, in which no team learns.

    The team is that of `own` if the same agents decide in the same way, without a leader. Otherwise
    it is a new team with the weights of `own`.

    Raises
    ------
    ValueError
        If a scenario or a team cannot be built, or the team cannot use the weights.
    """
    for name, other in evaluations:
        with _naming(f"evaluations.{name}"):
            there = arrange(other, seed)
            has_leader = there.team.leader is not None or own.team.leader is not None
            is_alike = other.acts_as(settings) and has_same_agents(there.scenario, own.scenario)
            if is_alike and not has_leader:
                there = there._replace(team=own.team)
            else:
                there.team.warm_start(own.team)
        yield name, there


@contextmanager
def _naming(key: str) -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from error


def check_conditions(
    spec: Spec, chosen: Container[str] | None = None, *, may_fail: bool = False
) -> tuple[Measure, ...]:
    """Build all conditions of a study once and return the measures of its episodes.

    Parameters
    ----------
    spec
        The study.
    chosen
        Labels of the conditions to build; None: all.
    may_fail
        Whether user code may fail in some conditions. Their trials will fail and others run.

    Raises
    ------
    SpecError
        If a condition cannot be built, or the measures of two conditions contradict each other.
    """
    failing: SpecError | None = None
    conditions = [c for c in spec.conditions() if chosen is None or c.label in chosen]
    measures: list[Sequence[Measure]] = []
    with spec.sources.active():
        for condition in conditions:
            where = f" (condition {condition.label!r})" if len(conditions) > 1 else ""
            try:
                measures += [there.measures for there in _arrangements(condition)]
                if spec.keep_teams:
                    _check_saved(condition.settings)
            except ValueError as error:
                refusal = SpecError(f"{error}{where}")
                if isinstance(error.__cause__, ValueError | None):
                    raise refusal from None
                failing = failing or refusal
            except KeyboardInterrupt:
                raise
            except BaseException as error:
                is_ours = not (place(error) or spec.sources.texts)
                if isinstance(error, Exception) and is_ours:
                    raise
                problem = f"the scenario or topology raises {format_error(error)}{place(error)}"
                failing = failing or SpecError(f"{problem}{where}")
    if failing and not (measures and may_fail):
        raise failing
    return join_measures(measures, conditions[0].columns)


def _check_saved(settings: ConditionSettings) -> None:
    """Raise if a team cannot be restored from arrays."""
    team = arrange(settings, 0).team
    try:
        arrays = {name: np.array(array) for name, array in team.state_dict().items()}
        if not arrays:
            raise TypeError("it has no arrays")
        if objects := [name for name, array in arrays.items() if array.dtype.hasobject]:
            raise TypeError(f"its array {objects[0]!r} holds objects")
        team.load_state_dict(arrays)
    except Exception as error:  # a user's learner may raise anything
        raise ValueError(
            f"keep_teams = true: a team of learner.kind = {settings.learner.kind!r} cannot be "
            f"saved, {error}; `state_dict` must return arrays of numbers that `load_state_dict` "
            "accepts"
        ) from None


def _arrangements(condition: Condition) -> Iterator[Arrangement]:
    """Yield the arrangements of a condition, of its stages and of its evaluations."""
    settings = condition.settings
    own = arrange(settings, 0)
    stages = teach(own, settings, condition.curriculum, 0)
    evaluations = transfer(own, settings, condition.evaluations, 0)
    for there in (own, *(a for _, a in stages), *(a for _, a in evaluations)):
        if settings.learner.needs_rewards:
            there.team.check(there.team.observe(there.scenario, there.scenario.reset(0)))
        yield there
