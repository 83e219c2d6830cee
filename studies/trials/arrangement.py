"""What a condition arranges: its world and its team, its curriculum, its further evaluations.

Before a study is run all of its conditions are arranged once, so that what does not fit is told
before anything is written.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from ...core.agents.loop import policy_seed
from ...core.agents.team import Team
from ...core.interface.experience import Observation
from ...core.interface.measures import Measure, measures_of
from ...core.interface.scenario import Scenario, checked_scenario
from ...core.plugins.sources import format_error, place
from ..errors import SpecError
from ..spec.conditions import Condition, ConditionSettings, Stage
from ..spec.spec import Spec
from .episodes import join_measures

Evaluations = Sequence[tuple[str, ConditionSettings]]
"""Names and settings under which a trained team is evaluated beside its own."""


class Arrangement(NamedTuple):
    """A world and those who act in it."""

    world: Scenario
    """As the settings describe it."""
    scenario: Scenario
    """The same as the agents see it, which may be as one agent."""
    team: Team
    """The agents."""

    @property
    def measures(self) -> tuple[Measure, ...]:
        """What is measured of an episode: of the world, then what decisions cost."""
        return (*measures_of(self.world.measures), *self.team.costs)


def arrange(settings: ConditionSettings, seed: int) -> Arrangement:
    """Return the world of a condition and its untrained team.

    Raises
    ------
    ValueError
        If the settings do not fit together; one line.
    """
    world = checked_scenario(settings.scenario.build())
    scenario, hierarchy = settings.arrange(world)
    failures = settings.topology.failures
    team = Team(settings.learner, scenario, hierarchy, policy_seed(seed), failures)
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
                there.team.warm_start(reached.team)
        yield stage, there
        reached = there
    if reached is not None:
        with _naming("curriculum"):
            own.team.warm_start(reached.team)


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
                own.team.check_scenario(there.scenario)
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
    """Return what a study measures of its episodes, if all its conditions can be built.

    Parameters
    ----------
    spec
        The study.
    chosen
        Labels of the conditions that matter; None: all.
    may_fail
        Whether code of the user's may fail in some conditions: their trials will fail, others run.

    Raises
    ------
    SpecError
        If one cannot be, or their measures do not fit together; before anything is run or written.
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
    """Refuse a team that arrays cannot bring back."""
    team = arrange(settings, 0).team
    try:
        arrays = {name: np.array(array) for name, array in team.state_dict().items()}
        if objects := [name for name, array in arrays.items() if array.dtype.hasobject]:
            raise TypeError(f"its array {objects[0]!r} holds objects")
        team.load_state_dict(arrays)
    except Exception as error:  # a learner may be anybody's
        raise ValueError(
            f"keep_teams = true: a team of learner.kind = {settings.learner.kind!r} cannot be "
            f"saved, {error}; needs `arrays` of numbers, and `restore` that takes them"
        ) from None


def _arrangements(condition: Condition) -> Iterator[Arrangement]:
    """Yield a condition's own arrangement and those of its stages and evaluations."""
    settings = condition.settings
    own = arrange(settings, 0)
    stages = teach(own, settings, condition.curriculum, 0)
    evaluations = transfer(own, settings, condition.evaluations, 0)
    for there in (own, *(a for _, a in stages), *(a for _, a in evaluations)):
        if settings.learner.needs_rewards:
            there.team.check(Observation(there.scenario.reset(0), there.scenario))
        yield there
