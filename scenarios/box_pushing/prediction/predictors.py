"""Predictors of box pushing by name, and the model of the world behind each.

push
    Compliant quasi-static pushing, see `box_pushing.prediction.push`; the default.
rigid
    The same without compliance and contact friction: the kinematic push.
static
    The box does not move; robots are stopped by it.
exact
    The world itself, saved, played ahead and restored. It knows all that is to come, failures and
    their noise too, and takes no notice of a self-model: a bound on what prediction can give, some
    thousand times slower than the others.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ....core.numerics import FloatArray, IntArray
from ....core.values.rule_base import RuleBase
from ..states.situations import SituationBatch
from ..world.boxes import BoxSpec
from ..world.robots import compliance
from ..world.settings import CONTROL_PERIOD, RobotSettings
from ..world.world import WheelFailures, World, WorldState
from .prediction import BoxPrediction, Premises, PresentState
from .push import PushModel
from .settings import BeliefSettings

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
    failures: WheelFailures
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

    def _play(self, commands: FloatArray, periods: int) -> WheelFailures:
        """Play control periods from the saved state; return the failures at their end."""
        self.world.restore(self.state)
        failures = deepcopy(self.failures)
        self.world.set_grip(failures.grip)
        for number, past in enumerate(range(0, periods, self.hold), self.step):
            failures.advance(self.world, commands, number, min(self.hold, periods - past))
        return failures


class ExactPrediction(BoxPrediction):
    """Prediction by simulation; own blocks in tables are those of a robot alone.

    Parameters
    ----------
    situation, model, premises
        See `BoxPrediction`.
    future
        The simulation.
    """

    merges: ClassVar[bool] = False  # wheels that command one twist may yet slip differently

    def __init__(
        self, situation: PresentState, model: PushModel, premises: Premises, future: Future
    ) -> None:
        super().__init__(situation, model, premises)
        self.future = future

    def best_responses(self, rules: RuleBase) -> None:
        """Return None, because every joint action must be simulated."""

    def _after(self, choices: IntArray, seconds: float) -> SituationBatch:
        periods = round(seconds / CONTROL_PERIOD)
        rows, which = np.unique(choices, axis=0, return_inverse=True)
        commands = self.wheel_commands.speeds[np.arange(rows.shape[1]), rows]
        played = [self.future.after(each.ravel(), periods) for each in commands]
        poses, gaps = (np.array(part)[which] for part in zip(*played, strict=True))
        situations_last = np.ascontiguousarray(poses.transpose(1, 2, 0))
        gaps = np.ascontiguousarray(gaps.T)
        return self._batch(situations_last[1:], situations_last[0], gaps, seconds)

    def after(self, joint_action: IntArray) -> ExactPrediction:
        """Return the prediction from where a joint action ``(n,)`` leads in a decision period."""
        speeds = self.commands(joint_action)
        future = self.future.onward(speeds)
        box = future.state.poses[0]
        robots = future.state.poses[1:]
        reached = replace(self.situation, robots=robots, box=box, speeds=speeds)
        return ExactPrediction(reached, self.model, self.premises, future)
