"""Box pushing: wheels that learn to bring a box to a goal (Section IX-A).

The scenario joins the world (robots, box, ground), the task (goal pose, reward, end of an
episode), the sensing (states) and the servo layer, which turns actions into wheel speeds.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ...core.interface.environments import Transitions
from ...core.interface.measures import Measure
from ...core.interface.recording import EpisodeRecorder
from ...core.interface.scenario import Scenario, Transition
from ...core.interface.spaces import ActionSet
from ...core.interface.stacked import StackedEnvironments
from ...core.numerics import FloatArray, IntArray, stream_of, working_seconds, wrap
from ...core.plugins.words import expect
from ..faults.settings import Failures
from .config import BoxPushingSettings
from .measurements import MEASURES, ORIENTATION
from .prediction.calibration import CONSTANTS, PushBelief, measured_twists
from .prediction.poses import BOX_SIGNS, ROBOT_SIGNS, TWIST_SIGNS
from .prediction.prediction import BoxPrediction, PredictionSettings, PresentState
from .prediction.predictors import ExactPrediction, push_model
from .prediction.settings import BeliefSettings
from .states.kernel import progress_of
from .states.situations import SituationBatch
from .states.state_spaces import state_space_for
from .world.boxes import box_for, growth
from .world.polygons import UNIT
from .world.reward import Task, reward
from .world.robots import nominal_effect, opposite_wheels, robot_for
from .world.settings import CONTROL_PERIOD
from .world.starts import place
from .world.stepping import advance_many, step_address
from .world.world import TOUCHING, World

if TYPE_CHECKING:
    from ..movies import Pixels

SENSING = 2**32 - 1
"""Key of the stream of sensor noise under the seed of an episode; failures have 0, 1, ..."""


class BoxPushing(Scenario):
    """Box pushing: the agents are the wheels of robots, which push a box to a goal.

    Parameters
    ----------
    settings
        See `BoxPushingSettings`.

    Raises
    ------
    ValueError
        If a robot, box or start is unknown, or the robots do not fit around the box.

    Examples
    --------
    >>> scenario = BoxPushingSettings().build()
    >>> scenario.agents
    ('robot1.left', 'robot1.right', 'robot2.left', 'robot2.right')
    >>> scenario.reset(0).shape
    (4, 8)
    """

    measures: tuple[Measure, ...] = MEASURES
    has_leader: ClassVar[bool] = False
    """Whether there is a leader above the agents, see `leading`."""
    regression_shapes = tuple((len(signs), len(TWIST_SIGNS)) for signs in (BOX_SIGNS, ROBOT_SIGNS))
    recorded: tuple[str, ...] = ("robot_poses", "box_pose", "wheel_speeds", "contact", "failed")

    def __init__(self, settings: BoxPushingSettings) -> None:
        expect("settings of box pushing", BoxPushingSettings, settings=settings)
        if settings.leader.policy != "none" and not self.has_leader:
            raise ValueError(
                f"scenario.leader.policy = {settings.leader.policy!r}: a leader is part of a team; "
                "build the scenario by settings.build(), or leave out leader"
            )
        self.settings = settings
        if settings.orientation_tolerance is not None:
            self.measures = (*MEASURES, ORIENTATION)
        self.robot = robot_for(settings.robot)
        self.box = box_for(settings.box, settings.robots)
        self._unit = growth(settings.box, settings.robots) if settings.scaling == "similar" else 1.0
        self.farthest = self._unit * settings.termination_radius
        """Distance of the box from the goal beyond which an episode is broken off [m]."""
        robots = [self.robot] * settings.robots
        names = self.robot.wheel_names
        numbers = range(settings.robots)
        self.agents = tuple(f"robot{r + 1}.{name}" for r in numbers for name in names)
        self.roles = names * settings.robots
        every = np.arange(len(self.agents)).reshape(-1, len(names))
        self.groups = tuple(map(tuple, every.tolist()))
        self.body = np.repeat(numbers, len(names))
        self.action_set = ActionSet()
        self.space = state_space_for(settings.state_space, self.robot.max_speed)
        self.space.prepare_kernel(self.box.shape)
        self.world = World(robots, self.box, infrared=settings.infrared)
        self._limits: FloatArray = np.full(len(self.agents), self.robot.max_speed)
        self._unit_speeds = settings.speed_increment * self._limits
        self.state_space = self.space.space
        self.nominal_effects = (nominal_effect(self.robot),) * settings.robots
        """Per robot the ``(3, w + 1)`` effect of its wheel speeds on its twist."""
        self.constants = CONSTANTS if settings.predictor == "push" else ()
        """Names of what the push predictor can calibrate; the other predictors have none."""
        self.levers = np.array([self.box.friction_radius, *[self.robot.radius] * settings.robots])
        """Speed per turning rate of the box and of every robot ``(M + 1,)`` [m]."""
        self._model = push_model(settings.predictor, robots, self.box, settings.belief)
        self._playground = World(robots, self.box) if settings.predictor == "exact" else None
        self._failures = Failures(settings.failures, self.agents, self._limits)
        reward_settings = settings.reward.model_copy(update={"r1": settings.reward.r1 / self._unit})
        self.task = Task.of(
            reward_settings, self._unit * settings.tolerance, settings.orientation_tolerance
        )
        self._prediction = self._shared_settings()
        self.horizon = max(1, round(settings.prediction_horizon / settings.action_repeat))
        # Robots without room at the box and state variables of users that fail are refused now.
        self._begin(0)
        if not self.space.is_built_in:
            self.states_at_rest()

    def _shared_settings(self) -> PredictionSettings:
        """Return the settings that all predictions share."""
        return PredictionSettings(
            groups=self.groups,
            belief=PushBelief.of(self._model, self.world.robots, self.settings.belief.stiffness),
            space=self.space,
            action_set=self.action_set,
            increments=self._unit_speeds,
            limits=self._limits,
            task=self.task,
            infrared=self.settings.infrared,
            period=self.settings.period,
            horizon=self.settings.prediction_horizon * CONTROL_PERIOD,
        )

    def partners(self) -> tuple[int, ...]:
        """Return the opposite wheel of every wheel, or itself if it is in the middle.

        Raises
        ------
        ValueError
            If a wheel has none; one line.
        """
        opposite = opposite_wheels(self.robot)
        return tuple(group[k] for group in self.groups for k in opposite)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Begin an episode, whose number schedules failures; return states ``(n, d)``."""
        self._begin(seed, episode)
        return self.states_at_rest()

    def _begin(self, seed: int | np.random.SeedSequence, episode: int = 0) -> None:
        """Place robots, box and goal by the start distribution, and schedule failures."""
        self._sensing = stream_of(seed, SENSING)
        rng = np.random.default_rng(seed)
        start = self.settings.start
        robots, box, self.goal = place(start, rng, self.world.robots, self.box, self._unit)
        self.aim = self.goal
        self.world.place(robots, box)
        self.commanded_speeds: FloatArray = np.zeros(len(self.agents))
        """Commanded speeds ``(n,)`` of all wheels [m/s]."""
        self._step = 0
        self._failures.begin(seed, episode)
        self.world.set_grip(self._failures.grip)
        self._save()

    def states_at_rest(self) -> FloatArray:
        """Return the states ``(n, d)`` of all agents if the box has not moved."""
        return self.states_at(self._present(self.world.box_pose), self.commanded_speeds[None])[0]

    def commanded(self, speeds: FloatArray, joint_actions: IntArray) -> FloatArray:
        """Return the wheel speeds ``(..., n)`` that joint actions command, given those before."""
        return self.action_set.apply(speeds, joint_actions, self._unit_speeds, self._limits)

    def step(self, joint_action: IntArray) -> Transition:
        """Command the wheels, simulate one decision period, observe and reward."""
        self.commanded_speeds = self.commanded(self.commanded_speeds, joint_action)
        before = self.world.poses
        begin = working_seconds()
        self._advance(self.commanded_speeds)
        moved = working_seconds()
        present = self._present(before[0])
        states = self.states_at(present, self.commanded_speeds[None])[0]
        readings = self.settings.infrared.noisy(self.world.infrared(), self._sensing)
        if self.aim is not self.goal:  # a leader's waypoint; the reward is about the goal
            present = present._replace(goal=self.goal)
        distance, approach, turn = progress_of(present)
        strongest = np.maximum.reduce(readings, axis=1)[None]
        gained = reward(self.task, distance, approach, turn, self.world.contact[None], strongest)[0]
        received = gained[self.body] if self.task.by_robot else float(gained[0])
        away = float(distance[0])
        measured = self._measured(away, float(turn[0]))
        terminated = bool(self.task.reached(distance, turn)[0])
        sensed = working_seconds()
        seconds = self.settings.period
        twists = partial(measured_twists, before, self.world.poses, seconds, self.robot.radius)
        if terminated:
            # The wheels stop; the box may leave the tolerance before it comes to rest.
            self._advance(np.zeros(len(self.agents)))
            there = self.task.reached(self.distance, self._orientation())
            measured["stopped_at_goal"] = bool(there)
        self._step += 1
        self._save()
        measured["seconds"] = {"physics": moved - begin, "sensors": sensed - moved}
        truncated = not terminated and away > self.farthest
        return Transition(states, received, terminated, truncated, measured, twists)

    def environments(self, count: int) -> BoxEnvironments | None:
        """Return a batch of environments; None with failures, noise or user-defined variables."""
        settings = self.settings
        is_noisy = settings.failures or settings.infrared.noise or self._playground is not None
        if is_noisy or not self.space.is_built_in or step_address() is None:
            return None
        return BoxEnvironments(self, count)

    def predict(self) -> BoxPrediction:
        """Predict from the current state; only the exact predictor knows of failures."""
        situation = PresentState(
            self.world.robot_poses.copy(),
            self.world.box_pose.copy(),
            self.aim,
            self.commanded_speeds,
            self.nominal_effects,
        )
        if self._playground is None or self._saved is None:
            return BoxPrediction(situation, self._model, self._prediction)
        future = self._playground, self._saved, self._failures, self._step
        return ExactPrediction(situation, self._model, self._prediction, *future)

    def with_exact_prediction(self) -> BoxPushing:
        """Return an equal scenario that predicts one decision period by simulation."""
        exactly = {"predictor": "exact", "prediction_horizon": self.settings.action_repeat}
        exactly |= {"belief": BeliefSettings()}
        return type(self)(self.settings.model_copy(update=exactly))

    def constants_of_episode(self) -> dict[str, object]:
        """Return the goal pose of the episode and the constants of drawing."""
        return {"goal_pose": self.goal, **self.settings.drawing}

    def animate(self, recording: Mapping[str, FloatArray], path: Path) -> None:
        """Draw a recorded episode as an animation, GIF or MP4 by the suffix of `path`."""
        from .pictures.rendering import animate

        animate(recording, path)

    def draw(self, path: Path | str) -> None:
        """Draw the current state, after `reset` the start of an episode, to a picture file."""
        from .pictures.rendering import snapshot

        snapshot(EpisodeRecorder(self).recording(), 0, path)

    def picture(self, recording: Mapping[str, FloatArray]) -> Pixels:
        """Return a picture ``(height, width, 3)`` of the last step of a recording."""
        from .pictures.rendering import BoxScene

        return BoxScene(recording).pixels(len(recording["box_pose"]) - 1)

    def _save(self) -> None:  # after every step: saving costs the world its order of contacts
        self._saved = None if self._playground is None else self.world.state()

    def measure(self) -> dict[str, object]:
        """Return poses, speeds, contact and errors of the present state.

        Poses ``(M, 3)`` and ``(3,)`` are in m, m, rad, wheel speeds ``(n,)`` are the commanded ones
        [m/s], and `contact_time` ``(M,)`` is the fraction of the last decision period in contact.
        `stopped_at_goal` is known after the step that ends the episode: whether the box stayed at
        the goal once the wheels had stopped.
        """
        return self._measured(self.distance, self._orientation())

    def _measured(self, distance: float, orientation: float) -> dict[str, object]:
        times = self.world.contact_time
        return {
            "robot_poses": self.world.robot_poses.copy(),
            "box_pose": self.world.box_pose.copy(),
            "goal_pose": self.goal,
            "wheel_speeds": self.commanded_speeds,
            "contact": self.world.contact.copy(),
            "contact_time": times.copy(),
            "contact_fraction": float(np.add.reduce(times) / len(times)),
            "failed": self._failures.failed,
            "distance_m": distance,
            "orientation_rad": orientation,
            "orientation_error_deg": degrees(abs(orientation)),
            "stopped_at_goal": False,
        }

    def _advance(self, commands: FloatArray) -> None:
        """Simulate one decision period with the given wheel speeds."""
        self.world.advance_failing(
            self._failures, commands, self._step, self.settings.action_repeat
        )

    @property
    def distance(self) -> float:
        """Distance of the box from the goal [m]."""
        return float(np.hypot(*(self.goal - self.world.box_pose)[:2]))

    def _orientation(self) -> float:
        return float(wrap(self.world.box_pose[2] - self.goal[2]))

    def _present(self, origin: FloatArray) -> SituationBatch:
        """Return the present situation; `origin` is the former pose ``(3,)`` of the box."""
        return self.situations(self.world.poses[None], self.world.gaps[None], origin[None])

    def situations(
        self, poses: FloatArray, gaps: FloatArray, origins: FloatArray
    ) -> SituationBatch:
        """Return ``m`` situations one decision period after the box was at its origin.

        Parameters
        ----------
        poses
            ``(m, M + 1, 3)`` of the box and the robots.
        gaps
            ``(m, M)`` between robots and box [m].
        origins
            ``(m, 3)`` former poses of the box.
        """
        last = np.ascontiguousarray(poses.transpose(1, 2, 0))
        apart, before = np.ascontiguousarray(gaps.T), np.ascontiguousarray(origins.T)
        return SituationBatch(last[1:], last[0], apart, self.aim, before, 1.0, self.box.shape)

    def states_at(self, batch: SituationBatch, speeds: FloatArray) -> FloatArray:
        """Return the states ``(m, n, d)`` of all agents in m situations.

        `speeds` are those commanded ``(m, n)`` [m/s].
        """
        shared = self.space.shared(batch, range(len(self.groups))).swapaxes(0, 1)
        m, n_robots, _ = shared.shape
        states = np.empty((m, n_robots, len(self.groups[0]), self.state_space.n_variables))
        states[..., 0] = speeds.reshape(states.shape[:3])
        states[..., 1:] = shared[:, :, None]
        return states.reshape(*speeds.shape, -1)


class BoxEnvironments(StackedEnvironments[BoxPushing]):
    """Batch of environments without failures and without sensor noise.

    Their physics is one compiled call, with the bits of each environment alone. Box2D decides where
    bodies lie in memory; therefore each environment keeps the `World` in which the scenario started
    its episode.
    """

    def allocate(self, scenario: BoxPushing, count: int) -> None:
        """Allocate the state of all environments."""
        one = scenario.world
        n_robots = len(one.robots)
        self._worlds = [World(one.robots, one.box, infrared=one.sensor) for _ in range(count)]
        self._addresses: IntArray = np.zeros((count, n_robots + 2), dtype=np.int64)
        self._last: FloatArray = np.zeros((count, n_robots, 3))
        self._wrenches: FloatArray = np.zeros((count, n_robots, 3))
        self._speeds: FloatArray = np.zeros((count, len(scenario.agents)))
        self._boxes: FloatArray = np.zeros((count, 3))

    def store(self, index: int, scenario: BoxPushing) -> None:
        """Swap the worlds of the scenario, which has just been reset, and of an environment."""
        world = scenario.world
        scenario.world = self._worlds[index]
        self._worlds[index] = world
        self._addresses[index] = world.addresses
        self._last[index] = 0.0
        self._wrenches[index] = 0.0
        self._speeds[index] = 0.0
        self._boxes[index] = world.box_pose

    def step(self, joint_actions: IntArray) -> Transitions:
        """Command the wheels in all environments, simulate one decision period, and reward."""
        one = self.scenario
        before = self._boxes
        self._speeds = one.commanded(self._speeds, joint_actions)
        periods, speeds = one.settings.action_repeat, self._speeds * UNIT
        poses, gaps, readings = advance_many(
            one.world.physics,
            one.world.sensors,
            self._addresses,
            speeds,
            periods,
            self._last,
            self._wrenches,
        )
        batch = one.situations(poses, gaps, before)
        self._boxes = np.ascontiguousarray(poses[:, 0])
        states = one.states_at(batch, self._speeds)
        away, approach, turn = progress_of(batch)
        reached = one.task.reached(away, turn)
        paid = reward(one.task, away, approach, turn, gaps < TOUCHING, readings)
        paid = paid[:, one.body] if one.task.by_robot else paid
        rewards = np.broadcast_to(paid, joint_actions.shape)
        return Transitions(states, rewards, reached, ~reached & (away > one.farthest))
