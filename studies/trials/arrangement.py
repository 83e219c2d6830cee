"""What a trial describes, built: its world and the team that acts in it.

A trial is known by its content alone, see `nested_agents.studies.trials.trial`, so that commands
that read results import nothing that learns.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...core.agents.loop import policy_seed
from ...core.agents.team import Team, of_fuzzy_agents
from ...core.interface.scenario import Actors, Measure, Scenario, carried_rows, lacking, measures_of
from ...core.learners import LearnerSettings, TeamSettings, check_prediction
from ...core.numerics import IntArray
from ...core.plugins.sources import format_error, place
from ..errors import SpecError
from ..spec.conditions import Condition, ConditionSettings, Stage
from .episodes import joined

if TYPE_CHECKING:
    from ..spec.spec import Spec

Evaluations = Sequence[tuple[str, ConditionSettings]]
"""Names and settings under which a trained team is evaluated beside its own."""


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
        rows = self.rows_from(former, settings)
        of_fuzzy_agents(self.team).continue_from(of_fuzzy_agents(former.team), rows)

    def rows_from(self, former: Arrangement, settings: TeamSettings) -> IntArray:
        """Return the row of weights that each of its rows goes on from, see `carried_rows`."""
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
    if problem := lacking(world):
        raise ValueError(f"scenario.kind: {problem}")
    scenario, hierarchy = settings.arrange(world)
    check_prediction(settings.learner, scenario)
    learner, source = settings.learner, policy_seed(seed)
    failures = settings.topology.failures
    if isinstance(learner, LearnerSettings):
        team: Actors = Team(learner, scenario, hierarchy, source, failures)
    elif learner.uses_hierarchy and failures:
        raise ValueError(
            f"topology.failures: messages of learner.kind = {learner.kind!r} cannot fail, "
            "those of agents with rule bases can"
        )
    else:
        hierarchies = (hierarchy,) if learner.uses_hierarchy else ()
        team = learner.build(scenario, source, *hierarchies)
    return Arrangement(world, scenario, team)


def teach(
    own: Arrangement, settings: ConditionSettings, curriculum: Sequence[Stage], seed: int
) -> Iterator[tuple[Stage, Arrangement]]:
    """Yield each stage with its arrangement, which is trained before the next is asked for.

    Its team continues from that of the stage before; after the last, the team of `own` continues.

    Raises
    ------
    ValueError
        If a stage cannot be built, or what is learned in one means nothing in the next.
    """
    reached: Arrangement | None = None
    for stage in curriculum:
        with _naming(f"curriculum.{stage.name}"):
            there = arrange(settings.model_copy(update={"scenario": stage.scenario}), seed)
            if reached is not None:
                there.continue_from(reached, settings.learner)
        yield stage, there
        reached = there
    if reached is not None:
        with _naming("curriculum"):
            own.continue_from(reached, settings.learner)


def transfer(
    own: Arrangement, settings: ConditionSettings, evaluations: Evaluations, seed: int
) -> Iterator[tuple[str, Arrangement]]:
    """Yield the name and the arrangement of each further evaluation: to be evaluated, not to learn.

    Its team is that of `own` itself if the same agents decide in the same way, else one that
    continues from it.

    Raises
    ------
    ValueError
        If a scenario or a team cannot be built, or what was learned means nothing there.
    """
    for name, other in evaluations:
        with _naming(f"evaluations.{name}"):
            there = arrange(other, seed)
            if other.acts_as(settings) and there.scenario.agents == own.scenario.agents:
                there.rows_from(own, settings.learner)
                there = there._replace(team=own.team)
            else:
                there.continue_from(own, settings.learner)
        yield name, there


@contextmanager
def _naming(key: str) -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from error


def check(spec: Spec, chosen: Container[str] | None = None) -> tuple[Measure, ...]:
    """Return what a study measures of its episodes, if all its conditions can be built.

    Parameters
    ----------
    spec
        The study.
    chosen
        Labels of the conditions that matter; None: all.

    Raises
    ------
    SpecError
        If one cannot be, or their measures do not fit together; before anything is run or written.
    """
    conditions = [c for c in spec.conditions() if chosen is None or c.label in chosen]
    measures: list[Sequence[Measure]] = []
    with spec.sources.active():
        for condition in conditions:
            where = f" (condition {condition.label!r})" if len(conditions) > 1 else ""
            try:
                measures += [measures_of(there.world) for there in _arrangements(condition)]
                if spec.keep_teams:
                    _check_saved(condition.settings)
            except ValueError as error:
                raise SpecError(f"{error}{where}") from None
            except KeyboardInterrupt:
                raise
            except BaseException as error:
                if isinstance(error, Exception) and not place(error):
                    raise  # no code of the user's
                problem = f"the scenario or topology raises {format_error(error)}{place(error)}"
                raise SpecError(f"{problem}{where}") from None
    return joined(measures, conditions[0].columns)


def _check_saved(settings: ConditionSettings) -> None:
    """Refuse a team that arrays cannot bring back."""
    team: Any = arrange(settings, 0).team
    try:
        arrays = {name: np.array(array) for name, array in team.arrays().items()}
        if objects := [name for name, array in arrays.items() if array.dtype.hasobject]:
            raise TypeError(f"its array {objects[0]!r} holds objects")
        team.restore(arrays)
    except Exception as error:  # a learner may be anybody's
        raise ValueError(
            f"keep_teams = true: a team of learner.kind = {settings.learner.kind!r} cannot be "
            f"saved, {error}; needs `arrays` of numbers, and `restore` that takes them"
        ) from None


def _arrangements(condition: Condition) -> Iterator[Arrangement]:
    """Yield a condition's own arrangement and those of its stages and evaluations."""
    settings, learner = condition.settings, condition.settings.learner
    own = arrange(settings, 0)
    stages = teach(own, settings, condition.curriculum, 0)
    evaluations = transfer(own, settings, condition.evaluations, 0)
    for there in (own, *(a for _, a in stages), *(a for _, a in evaluations)):
        if isinstance(learner, LearnerSettings) and learner.decision.rule != "value":
            team, states = of_fuzzy_agents(there.team), there.scenario.reset(0)
            team.check(team.predict(there.scenario, states))
        yield there
