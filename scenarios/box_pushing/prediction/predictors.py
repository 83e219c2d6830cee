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
from dataclasses import dataclass, replace

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


@dataclass(frozen=True)
class Future:
    """Simulation that continues from a saved state."""

    world: World
    """World with the same robots and box, for playing; modified."""
    state: WorldState
    """State to start from."""
    failures: Failures
    """Failures of the scenario; not modified."""
    step: int
    """Number of the step to come."""
    hold: int
    """Control periods in one step."""

    def after(self, commands: FloatArray, periods: int) -> tuple[FloatArray, FloatArray]:
        """Return poses ``(M + 1, 3)``, the box first, and gaps ``(M,)`` under held commands."""
        self._play(commands, periods)
        return np.vstack([self.world.box_pose, self.world.robot_poses]), self.world.gaps.copy()

    def onward(self, commands: FloatArray) -> Future:
        """Return where the world goes from the end of a step under held commands."""
        failures = self._play(commands, self.hold)
        return replace(self, state=self.world.state(), failures=failures, step=self.step + 1)

    def _play(self, commands: FloatArray, periods: int) -> Failures:
        """Play control periods from the saved state; return the failures at their end."""
        self.world.restore(self.state)
        failures = deepcopy(self.failures)
        self.world.set_grip(failures.grip)
        for number, past in enumerate(range(0, periods, self.hold), self.step):
            self.world.advance_failing(failures, commands, number, min(self.hold, periods - past))
        return failures


class ExactPrediction(BoxPrediction):
    """Prediction by simulation.

    Parameters
    ----------
    situation, model, settings
        See `BoxPrediction`.
    future
        The simulation.
    """

    def __init__(
        self,
        situation: PresentState,
        model: PushModel,
        settings: PredictionSettings,
        future: Future,
    ) -> None:
        super().__init__(situation, model, settings)
        self.future = future

    def assuming(self, assumptions: Assumptions) -> BoxPrediction:
        """Return the prediction under other assumptions, by simulation unless poses are learned."""
        other = super().assuming(assumptions)
        if assumptions.regressions is not None:
            return other
        return ExactPrediction(other.situation, other.model, other.settings, self.future)

    def best_responses(self, rules: RuleBase) -> None:
        """Return None, because every joint action must be simulated."""

    def _after(self, actions: IntArray, seconds: float) -> SituationBatch:
        distinct, rows = np.unique(actions, axis=1, return_inverse=True)
        commands = speeds_of(distinct, self.wheel_commands.speeds)
        played = [self.future.after(each, round(seconds / CONTROL_PERIOD)) for each in commands.T]
        poses = np.stack([poses for poses, _ in played], axis=-1)[..., rows]
        gaps = np.stack([gaps for _, gaps in played], axis=-1)[..., rows]
        return self._batch(poses[1:].copy(), poses[0].copy(), gaps.copy(), seconds)

    def after(self, joint_action: IntArray) -> ExactPrediction:
        """Return the prediction from the situation after a joint action ``(n,)``."""
        speeds = self.commands(joint_action)
        future = self.future.onward(speeds)
        box = future.state.poses[0]
        robots = future.state.poses[1:]
        reached = replace(self.situation, robots=robots, box=box, speeds=speeds)
        return ExactPrediction(reached, self.model, self.settings, future)
