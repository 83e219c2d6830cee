"""Learned pushing: planted weights are found, and pushes are predicted better than by states."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from acting import fuzzy, look

import nested_agents as na
from nested_agents.core.agents.joint import JointAgents
from nested_agents.core.agents.loop import control_loop, world_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.interface.experience import Decision, Experience
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.core.models.calibration import CalibrationSettings
from nested_agents.core.models.predictors import (
    LearnedPredictorSettings,
    PosePredictorSettings,
    StaticPredictor,
)
from nested_agents.core.models.self_model import SelfModelSettings
from nested_agents.core.models.team_model import TeamModel
from nested_agents.core.numerics import FloatArray
from nested_agents.core.plugins.settings import PartSettings
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.prediction.models import LearnedPush
from nested_agents.scenarios.box_pushing.prediction.poses import (
    BOX_SIGNS,
    ROBOT_SIGNS,
    TWIST_SIGNS,
    samples_of,
)
from nested_agents.scenarios.box_pushing.prediction.predictors import push_model
from nested_agents.scenarios.box_pushing.prediction.push import push
from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS
from nested_agents.scenarios.kinematic_chain.config import KinematicChainSettings
from nested_agents.scenarios.line_up import LineUpSettings
from nested_agents.topologies.config import build
from research.scripted.controller import ScriptedController

PERIOD = 0.512
HALF = 0.1
"""Half the width of the square box [m]."""
BOX, ROBOT = BOXES["square"], ROBOTS["e-puck"]
POSES = PosePredictorSettings(horizon=3)


def planted(rng: np.random.Generator) -> LearnedPush:
    """Return weights that respect mirror symmetry."""
    weights = [
        rng.normal(0.0, 0.4, (len(signs), 3)) * (np.outer(signs, TWIST_SIGNS) > 0.0)
        for signs in (BOX_SIGNS, ROBOT_SIGNS)
    ]
    return LearnedPush(PERIOD, *weights)


def around(rng: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return poses of two robots that drive towards a box, its pose, and commanded twists."""
    box = rng.uniform(-1.0, 1.0, 3)
    angle = rng.uniform(-np.pi, np.pi, 2)
    places = box[:2] + 0.14 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    robots = np.column_stack([places, angle + np.pi + rng.normal(0.0, 0.3, 2)])
    commands = np.column_stack([rng.uniform(0, 0.1, 2), np.zeros(2), rng.normal(0, 1, 2)])
    return robots, box, commands


def along(pose: FloatArray, twist: FloatArray) -> FloatArray:
    """Return where a pose comes to in a decision, by many small steps on the complex plane."""
    place, heading = complex(pose[0], pose[1]), pose[2]
    steps = 2000
    for _ in range(steps):
        middle = heading + twist[2] * PERIOD / steps / 2
        place += complex(twist[0], twist[1]) * np.exp(1j * middle) * PERIOD / steps
        heading += twist[2] * PERIOD / steps
    return np.array([place.real, place.imag, heading])


def nearest(center: complex) -> tuple[complex, float]:
    """Return the nearest point of the square, and its distance, negative inside."""
    x, y = center.real, center.imag
    surface = complex(np.clip(x, -HALF, HALF), np.clip(y, -HALF, HALF))
    if surface != center:
        return surface, abs(surface - center)
    if abs(x) > abs(y):
        return complex(np.copysign(HALF, x), y), abs(x) - HALF
    return complex(x, np.copysign(HALF, y)), abs(y) - HALF


def decide(
    robots: FloatArray, box: FloatArray, commands: FloatArray, learned: LearnedPush
) -> tuple[FloatArray, FloatArray]:
    """Return poses of robots and box after a decision; the module's formulas, for a square."""
    rho, radius = BOX.shape.friction_radius, ROBOT.radius
    origin, turned = complex(box[0], box[1]), np.exp(-1j * box[2])
    contacts = []
    sums = np.zeros(6)
    for robot, command in zip(robots, commands, strict=True):
        free = along(robot, command)
        center = (complex(free[0], free[1]) - origin) * turned
        surface, distance = nearest(center)
        normal = (surface - center) / distance
        d = max(0.0, radius - distance) / PERIOD
        went = complex(free[0] - robot[0], free[1] - robot[1]) * turned
        s = (went / normal).imag / PERIOD + radius * command[2]
        # Torques per force along the normal and along the tangent: the imaginary part of a product.
        lever_n = (surface.conjugate() * normal).imag / rho
        lever_t = (surface.conjugate() * 1j * normal).imag / rho
        angle = np.angle(normal) + box[2] - (robot[2] + free[2]) / 2
        contacts.append((d, s, normal, lever_n, lever_t, angle))
        held = np.clip(s, -d, d)
        tangent = 1j * normal
        sums += [d * normal.real, d * normal.imag, d * lever_n, 0, 0, 0]
        sums += [0, 0, 0, held * tangent.real, held * tangent.imag, held * lever_t]
    motion = sums @ learned.box
    after = []
    for robot, command, contact in zip(robots, commands, contacts, strict=True):
        d, s, normal, lever_n, lever_t, angle = contact
        moved = complex(motion[0], motion[1]) / normal
        d = max(0.0, d - moved.real - lever_n * motion[2]) if d else 0.0
        s = np.clip(s - moved.imag - lever_t * motion[2], -d, d)
        waves = [np.cos(angle), np.sin(angle), np.cos(3 * angle), np.sin(3 * angle)]
        features = np.array([*(d * np.array(waves)), s, s * waves[0], s * waves[1]])
        deflection = features @ learned.robot / [1.0, 1.0, radius]
        after.append(along(robot, command + deflection))
    return np.array(after), along(box, motion / [1.0, 1.0, rho])


def test_the_kernel_computes_the_formulas() -> None:
    rng = np.random.default_rng(2)
    touched = 0
    for _ in range(10):
        robots, box, commands = around(rng)
        learned = planted(rng)
        model = push_model("push", [ROBOT, ROBOT], BOX)._replace(learned=learned)
        choices = np.zeros((2, 1), dtype=np.int64)
        after, boxes, gaps = push(robots, box, commands[:, None], choices, 2 * PERIOD, model)
        for _ in range(2):
            robots, moved = decide(robots, box, commands, learned)
            touched += not np.array_equal(moved, box)
            box = moved
        assert after[:, :, 0] == pytest.approx(robots, abs=1e-6)
        assert boxes[:, 0] == pytest.approx(box, abs=1e-6)
        for robot, gap in zip(robots, gaps[:, 0], strict=True):
            place = complex(robot[0] - box[0], robot[1] - box[1]) * np.exp(-1j * box[2])
            assert gap == pytest.approx(nearest(place)[1] - ROBOT.radius, abs=1e-6)
    assert touched >= 10


def test_planted_weights_are_found_by_regression() -> None:
    rng = np.random.default_rng(0)
    learned = planted(rng)
    model = push_model("push", [ROBOT, ROBOT], BOX)._replace(learned=learned)
    samples = []
    for _ in range(200):
        robots, box, commands = around(rng)
        choices = np.zeros((2, 1), dtype=np.int64)
        after, boxes, _ = push(robots, box, commands[:, None], choices, PERIOD, model)
        before = np.vstack([box, robots])
        samples.append(
            samples_of(before, np.vstack([boxes[:, 0], after[:, :, 0]]), commands, PERIOD, model)
        )
    for parts, weights in zip(
        zip(*samples, strict=True), (learned.box, learned.robot), strict=True
    ):
        features, targets = (np.vstack(part) for part in zip(*parts, strict=True))
        assert np.linalg.lstsq(features, targets)[0] == pytest.approx(weights, abs=1e-6)


def models_for(scenario: Any, *predictors: PartSettings) -> list[TeamModel]:
    nothing = SelfModelSettings(), CalibrationSettings()
    return [TeamModel(predictor, *nothing, scenario) for predictor in predictors]


def play(scenario: Any, models: list[TeamModel], episodes: int) -> None:
    """Let models learn from a controller that pushes, with random actions in between."""
    controller = ScriptedController(scenario)
    rng = np.random.default_rng(0)
    for episode in range(episodes):
        states = scenario.reset(world_seed(10000, episode), episode)
        for _ in range(60):
            seen = look(scenario, states)
            joint = controller.act(scenario.measure())
            random = rng.integers(len(scenario.action_set), size=len(joint))
            joint = np.where(rng.random(len(joint)) < 0.2, random, joint)
            predictions = [model.predict(seen) for model in models]
            transition = scenario.step(joint)
            result = Experience(seen, Decision(joint, ()), transition, last=False)
            for model, prediction in zip(models, predictions, strict=True):
                model.learn(result, prediction)
            states = transition.states
            if transition.terminated or transition.truncated:
                break
        for model in models:
            model.end_episode()


def test_weights_learned_from_mirror_images_are_symmetric() -> None:
    scenario = BoxPushingSettings().build()
    models = models_for(scenario, POSES)
    play(scenario, models, episodes=2)
    for weights, signs in zip(models[0].predictor.weights, (BOX_SIGNS, ROBOT_SIGNS), strict=True):
        assert weights.any()
        assert weights[np.outer(signs, TWIST_SIGNS) < 0.0] == pytest.approx(0.0, abs=1e-9)


def test_cross_track_errors_are_predicted_better_than_by_state_variables() -> None:
    scenario = BoxPushingSettings(start="easy").build()
    models = models_for(scenario, POSES, LearnedPredictorSettings(), StaticPredictor())
    play(scenario, models, episodes=6)
    controller = ScriptedController(scenario)
    names = [variable.name for variable in scenario.state_space.variables]
    columns = [names.index("cross_track_error"), names.index("box_distance")]
    errors = []
    for episode in range(100, 106):
        states = scenario.reset(world_seed(10000, episode), episode)
        for _ in range(30):
            seen = look(scenario, states)
            joint = controller.act(scenario.measure())
            guesses = [model.predict(seen).states(0, joint[None])[0] for model in models]
            # Action 2 maintains the speeds: the decision is held for three periods.
            steps = [scenario.step(j) for j in (joint, *[np.full_like(joint, 2)] * 2)]
            if any(step.terminated for step in steps):
                break
            states = steps[-1].states
            errors.append([np.abs(guess - states[0])[columns] for guess in guesses])
    by_poses, by_states, unchanged = np.sqrt(np.square(errors).mean(axis=0))
    assert by_poses[0] < by_states[0]
    assert (by_poses < unchanged).all()


def team_of(scenario: Any, **settings: Any) -> Team:
    learner = BatchTDSettings.model_validate({"predictor": {"kind": "poses"}, **settings})
    hierarchy = build("chain", scenario.agents, scenario.groups)
    return Team(learner, scenario, hierarchy, np.random.SeedSequence(0))


def actions(scenario: Any, team: Team, count: int, **options: Any) -> list[list[int]]:
    loop = control_loop(scenario, team, episodes=count, steps=60, seed=10000, **options)
    return [record.joint_action.tolist() for record in loop]


def test_it_is_frozen_in_evaluation_and_continues_to_the_same_bits() -> None:
    settings = BoxPushingSettings(start="easy")
    whole, first, second = (team_of(settings.build()) for _ in range(3))
    every = actions(settings.build(), whole, 3)
    begun = actions(settings.build(), first, 2)
    state = {name: array.copy() for name, array in first.state_dict().items()}
    assert state["predictor.gram0"].any()
    second.load_state_dict(state)
    assert begun + actions(settings.build(), second, 1, first_episode=2) == every
    kept = {name: array.copy() for name, array in whole.state_dict().items()}
    actions(settings.build(), whole, 1, learn=False)
    for name in ("predictor.gram0", "predictor.weights1", "predictor.decisions"):
        assert np.array_equal(whole.state_dict()[name], kept[name])


def test_studies_have_the_same_bits_serial_and_parallel(tmp_path: Path) -> None:
    spec = {
        "seeds": [10000, 10001], "episodes": 2, "steps": 30, "evaluation": 1,
        "learner": {"predictor": {"kind": "poses"}},
    }  # fmt: skip
    serial, parallel = (
        na.run(spec, tmp_path / str(jobs), jobs=jobs, progress=False) for jobs in (1, 2)
    )
    assert serial.episodes.equals(parallel.episodes)


def test_another_number_of_robots_starts_from_zero() -> None:
    two, other_two, four = (BoxPushingSettings(robots=n).build() for n in (2, 2, 4))
    model, alike, larger = (models_for(scenario, POSES)[0] for scenario in (two, other_two, four))
    play(two, [model], episodes=1)
    alike.warm_start(model)
    larger.warm_start(model)
    assert np.array_equal(alike.predictor.weights[0], model.predictor.weights[0])
    assert not larger.predictor.weights[0].any()


@pytest.mark.parametrize("settings", [LineUpSettings(carts=2), KinematicChainSettings(joints=2)])
def test_an_environment_without_poses_is_refused(settings: Any) -> None:
    with pytest.raises(ValueError, match=r"learner.predictor.kind = 'poses': .* 'learned'"):
        team_of(settings.build())


def test_calibration_is_refused() -> None:
    scenario = BoxPushingSettings().build()
    with pytest.raises(ValueError, match=r"learner.calibration.enabled: .* 'poses'"):
        team_of(scenario, calibration={"enabled": True})


def test_a_self_model_learns_the_effects_of_wheels_beside_the_poses() -> None:
    failure = {"kind": "seized", "wheels": ["robot1.left"]}
    scenario = BoxPushingSettings(start="easy", failures=[failure]).build()
    team = team_of(scenario, self_model={"enabled": True})
    actions(scenario, team, 1)
    model = fuzzy(team).model
    failed, sound = model.self_model.effects[0][0, :2]
    assert abs(failed) < 0.1 < 0.4 < sound
    situation = model.predict(look(scenario)).situation
    assert np.array_equal(situation.effects[0], model.self_model.effects[0])


def test_robots_as_single_agents_learn_the_same_poses() -> None:
    scenario = BoxPushingSettings(start="easy").build()
    joint = JointAgents(scenario, "body")
    model = models_for(joint, POSES)[0]
    states = joint.reset(world_seed(10000, 0), 0)
    seen = look(joint, states)
    action = np.array([5, 5])
    prediction = model.predict(seen)
    result = Experience(seen, Decision(action, ()), joint.step(action), last=False)
    model.learn(result, prediction)
    assert prediction.states(0, action[None]).shape == (1, joint.state_space.n_variables)
    assert model.predictor.memory["decisions"] == 1


def test_learned_poses_are_predicted_alike_for_one_agent_and_for_all() -> None:
    scenario = BoxPushingSettings(start="easy").build()
    team = team_of(scenario)
    actions(scenario, team, 1)
    prediction = fuzzy(team).model.predict(look(scenario))
    joint = np.indices((4,) * 4).reshape(4, -1).T[::17]
    own, shared = prediction.states_by_group(joint)
    expected = np.concatenate([own[1], shared[0]], axis=1)
    assert prediction.states(1, joint) == pytest.approx(expected, abs=1e-9)
