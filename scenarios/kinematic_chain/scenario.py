"""Kinematic chain: the joints of a planar arm learn to bring its tip to a goal.

One agent per degree of freedom is the earlier application of the paper's method ([28, 29]). Joints
are servo-driven and have no mass: they turn at the commanded speed unless they fail.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from ...core.interface.environments import Transitions
from ...core.interface.measures import SUCCESS, Measure
from ...core.interface.prediction import Assumptions, EmbodiedPrediction, first_alike
from ...core.interface.recording import EpisodeRecorder
from ...core.interface.scenario import Scenario, Transition
from ...core.interface.spaces import ActionSet
from ...core.interface.stacked import StackedEnvironments
from ...core.numerics import FloatArray, IntArray, working_seconds
from ...core.plugins.words import expect
from ...core.search.responding import RespondingPrediction, Responses, Search
from ...core.values.rule_base import RuleBase
from ..faults.settings import Failures
from ..state_variables import find_variable, space_of
from .config import PERIOD, REACH, SIMPLE, KinematicChainSettings
from .responses import Options, piecewise_linear, respond
from .variables import CHAIN_VARIABLES, SPEED, ChainView, forward_kinematics, joint_states

MEASURES = (
    SUCCESS,
    Measure("final_distance_m", "final distance", "m", "distance_m", better="lower", least=0.0),
)
MIN_START_DISTANCE = 0.25
"""Minimum distance of the tip from the goal at the start [m]."""
GOAL_RADII = (0.15, 0.95)
"""Minimum and maximum distance of the goal from the base [m]."""
MAX_BEND = 2.5
"""Maximum start angle of a joint other than the base [rad]."""


class KinematicChain(Scenario):
    """A planar arm with exact predictions and support for self-models.

    Parameters
    ----------
    settings
        See `KinematicChainSettings`.

    Raises
    ------
    ValueError
        If a state variable is unknown, or a failure names an unknown joint.

    Examples
    --------
    >>> scenario = KinematicChainSettings(joints=3).build()
    >>> scenario.agents, scenario.reset(0).shape
    (('joint1', 'joint2', 'joint3'), (3, 4))
    """

    measures = MEASURES
    recorded: tuple[str, ...] = ("angles", "speeds", "failed")

    def __init__(self, settings: KinematicChainSettings) -> None:
        expect("settings of an arm", KinematicChainSettings, settings=settings)
        self.settings = settings
        n = settings.joints
        self.agents = tuple(f"joint{i + 1}" for i in range(n))
        self.roles = ("joint",) * n
        self.action_set = ActionSet()
        self.length = REACH / n
        self._limits = np.full(n, settings.top_speed)
        names = settings.state_space
        self._variables = [find_variable(CHAIN_VARIABLES, name) for name in names]
        self.state_space = space_of("+".join(names), SPEED, self._variables)
        self.nominal_effects = (np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]]),) * n
        """Effect of a joint's speed on its twist ``(3, 2)``: it only turns."""
        self.constants: tuple[str, ...] = ()
        self.levers: FloatArray = np.zeros(0)
        self.regression_shapes: tuple[tuple[int, int], ...] = ()
        self._failures = Failures(settings.failures, self.agents, self._limits)
        # Failures of the coming step, for informed predictions; the others are of the last step.
        self._known = Failures(settings.failures, self.agents, self._limits)
        KinematicChain.reset(self, 0)

    def partners(self) -> tuple[int, ...]:
        """Return the mirror image of every joint, which is the joint itself."""
        return tuple(range(len(self.agents)))

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Bend the arm at random, draw a goal within reach, and return states ``(n, d)``.

        Goals are uniform over the area. Failures are scheduled by the number of the `episode`.
        """
        rng = np.random.default_rng(seed)
        n = len(self.agents)
        bend = min(MAX_BEND, 3.0 * np.sqrt(2.0 / n))
        self._angles = np.append(rng.uniform(-np.pi, np.pi), rng.uniform(-bend, bend, n - 1))
        self._speeds: FloatArray = np.zeros(n)
        self._step = 0
        tip = self._places()[-1]
        while True:
            radius = np.sqrt(rng.uniform(GOAL_RADII[0] ** 2, GOAL_RADII[1] ** 2))
            course = rng.uniform(-np.pi, np.pi)
            self._goal = radius * np.array([np.cos(course), np.sin(course)])
            if np.hypot(*(self._goal - tip)) >= MIN_START_DISTANCE:
                break
        for failures in (self._failures, self._known):
            failures.begin(seed, episode)
        return self.outcome(self._angles, self._speeds, self._goal, self._distance())[0][0]

    def step(self, joint_action: IntArray) -> Transition:
        """Turn the joints for one decision period."""
        begin = working_seconds()
        before = self._distance()
        angles = self._angles
        self._failures.strike(self._step)
        unit = self.settings.speed_increment * self._limits
        self._speeds = self.action_set.apply(self._speeds, joint_action, unit, self._limits)
        held = self._failures.driven(self._speeds, periods=1)[0]
        self._angles = angles + PERIOD * held
        self._step += 1
        moved = working_seconds()
        goal, settings = self._goal, self.settings
        states, rewards, distance = self.outcome(self._angles, self._speeds, goal, before)
        terminated = bool(distance[0] < settings.tolerance)
        truncated = not terminated and self._step >= settings.most_decisions
        twists = np.zeros((len(angles), 3))
        twists[:, 2] = (self._angles - angles) / PERIOD
        seconds = {"physics": moved - begin, "sensors": working_seconds() - moved}
        info = {**self.measure(), "seconds": seconds}
        return Transition(states[0], float(rewards[0]), terminated, truncated, info, twists)

    def outcome(
        self,
        angles: FloatArray,
        speeds: FloatArray,
        goals: FloatArray,
        before: float | FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return states ``(c, n, d)``, rewards and distances ``(c,)`` of c arms.

        Parameters
        ----------
        angles, speeds
            ``(c, n)`` postures [rad] and commanded speeds [rad/s], ``(n,)`` of one arm.
        goals, before
            Goals ``(c, 2)`` and distances before the decision [m].
        """
        angles, speeds = np.atleast_2d(angles).T, np.atleast_2d(speeds).T
        places = forward_kinematics(angles, self.length)
        view = ChainView(places, angles, speeds / self.settings.top_speed, goals, before)
        states = joint_states(view, self._variables, 0, len(angles)).transpose(1, 0, 2)
        rewards = self._reward(view.distance, view.approach)
        return np.ascontiguousarray(states), rewards, view.distance.copy()

    def environments(self, count: int) -> ChainEnvironments | None:
        """Return many arms that are stepped in one call; None if joints fail."""
        return None if self.settings.failures else ChainEnvironments(self, count)

    def predict(self) -> ChainPrediction:
        """Predict from the present state, with failures if the settings say `informed`."""
        nominal = self.settings.predictor == "nominal"
        effects = self.nominal_effects if nominal else self._actual_effects()
        return ChainPrediction(self, effects, self._angles, self._speeds, self._distance())

    def _actual_effects(self) -> tuple[FloatArray, ...]:
        """Return the effects of the joints in the coming step; all failures are linear."""
        self._known.strike(self._step)
        offsets = self._known.driven(np.zeros(len(self.agents)), periods=1)[0]
        effects = np.zeros((len(offsets), 3, 2))
        effects[:, 2, 0] = (self._known.driven(self._limits, periods=1)[0] - offsets) / self._limits
        effects[:, 2, 1] = offsets
        return tuple(effects)

    def with_exact_prediction(self) -> KinematicChain:
        """Return an equal arm with predictions that include failures."""
        return type(self)(self.settings.model_copy(update={"predictor": "informed"}))

    def measure(self) -> dict[str, object]:
        """Return the measurements of the present state.

        They are ``angles`` (n,) [rad], commanded ``speeds`` (n,) [rad/s], ``failed`` joints (n,),
        ``tip`` and ``goal`` (2,) [m], and ``distance_m`` between them.
        """
        return {
            "angles": self._angles.copy(),
            "speeds": self._speeds.copy(),
            "failed": self._failures.failed,
            "tip": self._places()[-1].copy(),
            "goal": self._goal,
            "distance_m": self._distance(),
        }

    def constants_of_episode(self) -> Mapping[str, object]:
        """Return the goal of the episode and constants for drawing."""
        return {
            "goal": self._goal,
            "dt": PERIOD,
            "reach": REACH,
            "tolerance": self.settings.tolerance,
            "top_speed": self.settings.top_speed,
        }

    def animate(self, recording: Mapping[str, FloatArray], path: Path) -> None:
        """Write a recorded episode as GIF or MP4, by the suffix of `path`."""
        from .drawing import animate

        animate(recording, path)

    def draw(self, path: Path | str) -> None:
        """Draw the present posture and the goal to a picture file."""
        from .drawing import snapshot

        snapshot(EpisodeRecorder(self).recording(), path)

    def _reward(self, distance: FloatArray, approach: FloatArray) -> FloatArray:
        """Return the reward ``(m,)`` for distance and approach [m]."""
        s = self.settings.reward
        moving = np.where(approach > s.least_approach, s.c2 * np.exp(-s.r2 * distance), s.receding)
        return np.where(distance < self.settings.tolerance, s.c1, moving)

    def _places(self) -> FloatArray:
        """Return joints and tip ``(n + 1, 2)`` [m]."""
        return forward_kinematics(self._angles, self.length)

    def _distance(self) -> float:
        return float(np.hypot(*(self._goal - self._places()[-1])))


class ChainEnvironments(StackedEnvironments[KinematicChain]):
    """Many arms with the same number of joints and without failures."""

    def allocate(self, scenario: KinematicChain, count: int) -> None:
        """Allocate the state of all environments."""
        n = len(scenario.agents)
        self._angles: FloatArray = np.zeros((count, n))
        self._speeds: FloatArray = np.zeros((count, n))
        self._goals: FloatArray = np.zeros((count, 2))
        self._distance: FloatArray = np.zeros(count)
        self._steps = np.zeros(count, dtype=np.int64)

    def store(self, index: int, scenario: KinematicChain) -> None:
        """Copy an arm and its goal into an environment."""
        self._angles[index] = scenario._angles
        self._speeds[index] = 0.0
        self._goals[index] = scenario._goal
        self._distance[index] = scenario._distance()
        self._steps[index] = 0

    def step(self, joint_actions: IntArray) -> Transitions:
        """Turn all joints of all arms for one decision period."""
        arm = self.scenario
        settings = arm.settings
        unit = settings.speed_increment * arm._limits
        self._speeds = arm.action_set.apply(self._speeds, joint_actions, unit, arm._limits)
        self._angles = self._angles + PERIOD * self._speeds
        self._steps += 1
        states, rewards, self._distance = arm.outcome(
            self._angles, self._speeds, self._goals, self._distance
        )
        terminated = self._distance < settings.tolerance
        truncated = ~terminated & (self._steps >= settings.most_decisions)
        rewards_by_agent = np.broadcast_to(rewards[:, None], joint_actions.shape)
        return Transitions(states, rewards_by_agent, terminated, truncated)


class ChainPrediction(EmbodiedPrediction, RespondingPrediction):
    """Outcomes of joint actions, exact if the assumed effects of the joints are.

    A decision turns each joint by its speed times the period. The turn of each
    action of each joint is computed once; a joint action is then one posture.

    Parameters
    ----------
    arm
        The arm.
    effects
        Assumed effect ``(3, 2)`` of the speed of each joint.
    angles, speeds
        ``(n,)`` present posture [rad] and commanded speeds [rad/s].
    before
        Present distance of the tip from the goal [m].

    Attributes
    ----------
    speeds
        ``(n, A)`` speed that each action of each joint commands [rad/s].
    turns
        ``(n, A)`` turn of the joint by that action [rad].
    """

    def __init__(
        self,
        arm: KinematicChain,
        effects: Sequence[FloatArray],
        angles: FloatArray,
        speeds: FloatArray,
        before: float,
    ) -> None:
        self.arm = arm
        self.effects = effects
        self.angles = angles
        self.before = before
        self.goal = arm._goal
        self.groups = arm.groups
        self._joints = np.arange(len(angles))
        gains, offsets = np.array([effect[2] for effect in effects]).T
        every = np.arange(len(arm.action_set))[:, None].repeat(len(angles), axis=1)
        unit = arm.settings.speed_increment * arm._limits
        commanded = arm.action_set.apply(speeds, every, unit, arm._limits)
        after = angles + PERIOD * (gains * commanded + offsets)
        self.speeds = np.ascontiguousarray(commanded.T)
        self.turns = np.ascontiguousarray((after - angles).T)
        self._fractions = self.speeds / arm.settings.top_speed
        self._present = angles, speeds, before

    def assuming(self, assumptions: Assumptions) -> ChainPrediction:
        """Return the prediction for other effects of the joints."""
        effects = self.effects if assumptions.effects is None else assumptions.effects
        return ChainPrediction(self.arm, effects, *self._present)

    def view_after(self, joint_actions: IntArray) -> ChainView:
        """Return the arm after joint actions ``(m, n)``."""
        actions = joint_actions.T
        angles = self.angles[:, None] + np.take_along_axis(self.turns, actions, axis=1)
        places = forward_kinematics(angles, self.arm.length)
        speeds = np.take_along_axis(self._fractions, actions, axis=1)
        return ChainView(places, angles, speeds, self.goal, self.before)

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        return joint_states(self.view_after(joint_actions), self.arm._variables, agent, 1)[0]

    def states_by_group(self, joint_actions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the speeds ``(n, m, 1)`` and the other variables ``(n, m, d - 1)`` of all."""
        view = self.view_after(joint_actions)
        states = joint_states(view, self.arm._variables, 0, len(self.angles))
        return states[:, :, :1], states[self._joints, :, 1:]

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the rewards ``(m,)`` of joint actions ``(m, n)``."""
        view = self.view_after(joint_actions)
        return self.arm._reward(view.distance, view.approach)

    def after(self, joint_action: IntArray) -> ChainPrediction:
        """Return the prediction from the state after a joint action ``(n,)``."""
        view = self.view_after(joint_action[None])
        speeds = self.commands(joint_action)
        before = float(view.distance[0])
        return ChainPrediction(self.arm, self.effects, view.angles[:, 0], speeds, before)

    @cached_property
    def alike(self) -> IntArray:
        """First action of each joint with the same effect ``(n, A)``."""
        return first_alike(self.speeds)

    def best_responses(self, rules: RuleBase) -> Responses | None:
        """Return best responses of all joints by what each turn changes, see `responses`.

        None if values are no sums over the default variables.
        """
        simple = self.arm.settings.state_space == SIMPLE and rules.is_triangular
        alone = len(rules.terms) == len(rules.partitions)
        alone = alone and all(len(term) == 1 for term in rules.terms)
        return partial(self._respond, rules) if simple and alone else None

    def _respond(self, rules: RuleBase, search: Search) -> IntArray:
        plan = search.initial_joint_action()
        speed, bearing, distance, approach = rules.partitions
        weights = np.split(search.pooled.weights[0], np.cumsum(rules.sizes)[:-1], axis=1)
        # On a circle, one period and the centers next to it.
        period = slice(bearing.size - 1, 2 * bearing.size + 1)
        bearing_values = np.tile(weights[1], 3)[:, period]
        team_values = [values.sum(axis=0, keepdims=True) for values in weights[2:]]
        options = Options(
            self.goal,
            self.before,
            self.turns,
            self.alike,
            np.einsum("iam,im->ia", speed.strengths(self._fractions), weights[0]),
            piecewise_linear(bearing.knots[period], bearing_values),
            piecewise_linear(distance.knots, team_values[0]),
            piecewise_linear(approach.knots, team_values[1]),
        )
        angles = self.angles + self.turns[self._joints, plan]
        places = np.ascontiguousarray(forward_kinematics(angles, self.arm.length).T)
        order, exploring, rng = search.order, search.exploring, search.rng
        return respond(places, plan, order, options, exploring, rng)

    def commands(self, joint_action: IntArray) -> FloatArray:
        """Return the joint speeds ``(n,)`` that a joint action ``(n,)`` would command [rad/s]."""
        return self.speeds[self._joints, joint_action]

    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return the change of the joints' motion by contact ``(n, 3)``, which is zero."""
        return np.zeros((len(self.angles), 3))
