"""Predictors of box pushing by name, and the model of the world behind each.

push
    Compliant quasi-static pushing, see `box_pushing.prediction.push`; the default.
rigid
    The same without compliance and contact friction: the kinematic push.
static
    The box does not move; robots are stopped by it.
exact
    The simulation itself, saved, continued and restored. It knows future failures and their noise,
    and ignores self-models: an upper bound for prediction, a thousand times slower than the others.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np

from ....core.interface.prediction import Assumptions
from ....core.numerics import FloatArray, IntArray
from ....core.values.rule_base import RuleBase
from ...faults.settings import Failures
from ..states.situations import SituationBatch
from ..world.boxes import BoxSpec
from ..world.robots import compliance
from ..world.settings import CONTROL_PERIOD, RobotSettings
from ..world.world import World, WorldState
from .models import PushModel
from .prediction import BoxPrediction, PredictionSettings, PresentState
from .settings import BeliefSettings
from .wheel_commands import speeds_of

IMMOBILE = 1e6
"""Ground friction [N] against which nothing moves."""


def push_model(
    predictor: str,
    robots: list[RobotSettings],
    box: BoxSpec,
    belief: BeliefSettings = BeliefSettings(),  # noqa: B008 - frozen
) -> PushModel:
    """Return the model of a predictor, with the given errors of constants."""
    model = PushModel(
        shape=box.shape,
        radii=np.array([robot.radius for robot in robots]),
        compliance=np.stack([compliance(robot) for robot in robots]) / belief.stiffness,
        friction_force=box.friction_force * belief.load,
        contact_friction=box.contact_friction * belief.contact_friction,
    )
    if predictor == "rigid":
        return model._replace(compliance=np.zeros_like(model.compliance), contact_friction=0.0)
    return model._replace(friction_force=IMMOBILE) if predictor == "static" else model


class ExactPrediction(BoxPrediction):
    """Prediction by simulation, which continues from a saved state.

    Parameters
    ----------
    situation, model, settings
        See `BoxPrediction`.
    world
        World with the same robots and box, for playing; modified.
    state
        State to start from.
    failures
        Failures of the scenario; not modified.
    step
        Number of the step to come.
    """

    def __init__(
        self,
        situation: PresentState,
        model: PushModel,
        settings: PredictionSettings,
        world: World,
        state: WorldState,
        failures: Failures,
        step: int,
    ) -> None:
        super().__init__(situation, model, settings)
        self._future = world, state, failures, step

    def assuming(self, assumptions: Assumptions) -> BoxPrediction:
        """Return the prediction under other assumptions, by simulation unless poses are learned."""
        other = super().assuming(assumptions)
        if assumptions.regressions is not None:
            return other
        return ExactPrediction(other.situation, other.model, other.settings, *self._future)

    def best_responses(self, rules: RuleBase) -> None:
        """Return None, because every joint action must be simulated."""

    def _play(self, commands: FloatArray, seconds: float) -> tuple[World, Failures]:
        """Play under held commands from the saved state; return the world and its failures."""
        world, state, failures, step = self._future
        world.restore(state)
        failures = deepcopy(failures)
        world.set_grip(failures.grip)
        periods, hold = (round(s / CONTROL_PERIOD) for s in (seconds, self.settings.period))
        for number, past in enumerate(range(0, periods, hold), step):
            world.advance_failing(failures, commands, number, min(hold, periods - past))
        return world, failures

    def _after(self, actions: IntArray, seconds: float) -> SituationBatch:
        distinct, rows = np.unique(actions, axis=1, return_inverse=True)
        poses, gaps = [], []
        for commands in speeds_of(distinct, self.wheel_commands.speeds).T:
            world, _ = self._play(commands, seconds)
            poses.append(world.poses)
            gaps.append(world.gaps)
        every = np.stack(poses, axis=-1)[..., rows]
        apart = np.stack(gaps, axis=-1)[..., rows]
        return self._batch(every[1:].copy(), every[0].copy(), apart.copy(), seconds)

    def after(self, joint_action: IntArray) -> ExactPrediction:
        """Return the prediction from the situation after a joint action ``(n,)``."""
        speeds = self.commands(joint_action)
        world, failures = self._play(speeds, self.settings.period)
        state = world.state()
        box, robots = state.poses[0], state.poses[1:]
        reached = replace(self.situation, robots=robots, box=box, speeds=speeds)
        future = world, state, failures, self._future[3] + 1
        return ExactPrediction(reached, self.model, self.settings, *future)
