"""Learned pushing: planted weights are found, and pushes are predicted better than by states."""

from typing import Any

import numpy as np
import pytest
from acting import fuzzy, look

from nested_agents.core.agents.loop import control_loop, world_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.core.models.learned_predictor import LearnedPredictor
from nested_agents.core.models.pose_model import PoseModel
from nested_agents.core.models.predictors import LearnedPredictorSettings, PosePredictorSettings
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.prediction.poses import (
    REGRESSIONS,
    Bodies,
    LearnedPush,
    push_by_weights,
    push_experience,
)
from nested_agents.scenarios.box_pushing.world.boxes import box_for
from nested_agents.scenarios.kinematic_chain.config import KinematicChainSettings
from nested_agents.scenarios.line_up import LineUpSettings
from nested_agents.topologies.config import build
from research.scripted.controller import ScriptedController

PERIOD = 0.512
BODIES = Bodies(box_for("square", 2).shape, np.array([0.037, 0.037]))
POSES = PosePredictorSettings(horizon=3)


def planted(rng: np.random.Generator) -> LearnedPush:
    """Return weights that respect mirror symmetry."""
    weights = [
        rng.normal(0.0, 0.4, (len(of.features), 3)) * (np.outer(of.features, of.targets) > 0.0)
        for of in REGRESSIONS
    ]
    return LearnedPush(PERIOD, *weights)


def test_planted_weights_are_found_by_regression() -> None:
    rng = np.random.default_rng(0)
    learned = planted(rng)
    rows: list[tuple[Any, ...]] = []
    for _ in range(200):
        box = rng.uniform(-1.0, 1.0, 3)
        angle = rng.uniform(-np.pi, np.pi, 2)
        places = box[:2] + 0.14 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        robots = np.column_stack([places, angle + np.pi + rng.normal(0.0, 0.3, 2)])
        commands = np.column_stack([rng.uniform(0, 0.1, 2), np.zeros(2), rng.normal(0, 1, 2)])
        choice = np.zeros((2, 1), dtype=np.int64)
        moved, pushed, _ = push_by_weights(
            robots, box, commands[:, None], choice, 1, BODIES, learned
        )
        before = np.vstack([box, robots])
        after = np.vstack([pushed[:, 0], moved[:, :, 0]])
        rows.append(push_experience(before, after, commands, PERIOD, BODIES))
    sums, motion, features, deflections = (np.vstack(part) for part in zip(*rows, strict=True))
    assert np.linalg.lstsq(sums, motion)[0] == pytest.approx(learned.box, abs=1e-6)
    assert np.linalg.lstsq(features, deflections)[0] == pytest.approx(learned.robot, abs=1e-6)


def test_mirrored_learning_finds_symmetric_weights() -> None:
    scenario = BoxPushingSettings().build()
    model = PoseModel(POSES, scenario)
    play(scenario, [model], episodes=2)
    for i, of in enumerate(REGRESSIONS):
        weights = model.memory[f"weights{i}"]
        odd = np.outer(of.features, of.targets) < 0.0
        assert weights.any()
        assert weights[odd] == pytest.approx(0.0, abs=1e-9)


def play(scenario: Any, models: list[Any], episodes: int) -> None:
    """Let models learn from a controller that pushes, with random actions in between."""
    controller = ScriptedController(scenario)
    rng = np.random.default_rng(0)
    for episode in range(episodes):
        scenario.reset(world_seed(10000, episode), episode)
        for _ in range(60):
            seen = look(scenario)
            joint = controller.act(scenario.measure())
            random = rng.integers(len(scenario.action_set), size=len(joint))
            joint = np.where(rng.random(len(joint)) < 0.2, random, joint)
            predictions = [model.predict(seen) for model in models]
            transition = scenario.step(joint)
            for model, prediction in zip(models, predictions, strict=True):
                model.adapt(prediction, joint, transition)
            if transition.terminated or transition.truncated:
                break
        for model in models:
            model.end_episode()


def test_pushes_are_predicted_better_than_by_state_variables_or_by_no_change() -> None:
    scenario = BoxPushingSettings(start="easy").build()
    models = [PoseModel(POSES, scenario), LearnedPredictor(LearnedPredictorSettings(), scenario)]
    play(scenario, models, episodes=6)
    controller = ScriptedController(scenario)
    columns = [v.name for v in scenario.state_space.variables]
    error = columns.index("cross_track_error"), columns.index("box_distance")
    errors: list[Any] = []
    for episode in range(100, 106):
        scenario.reset(world_seed(10000, episode), episode)
        for _ in range(30):
            seen = look(scenario)
            joint = controller.act(scenario.measure())
            guesses = [model.predict(seen).states(0, joint[None])[0] for model in models]
            guesses.append(seen.present[0])
            # Maintaining is index 2: the decision is held for three periods.
            steps = [scenario.step(j) for j in (joint, *[np.full_like(joint, 2)] * 2)]
            if any(step.terminated for step in steps):
                break
            entered = steps[-1].states[0]
            errors.append([np.abs(guess - entered)[list(error)] for guess in guesses])
    by_poses, by_states, unchanged = np.sqrt(np.square(errors).mean(axis=0))
    assert (by_poses < by_states).all()
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


def test_another_number_of_robots_starts_from_zero() -> None:
    two, other_two, four = (BoxPushingSettings(robots=n).build() for n in (2, 2, 4))
    model = PoseModel(POSES, two)
    play(two, [model], episodes=1)
    alike, larger = PoseModel(POSES, other_two), PoseModel(POSES, four)
    alike.warm_start(model)
    larger.warm_start(model)
    assert np.array_equal(alike.memory["weights0"], model.memory["weights0"])
    assert not larger.memory["weights0"].any()


@pytest.mark.parametrize("settings", [LineUpSettings(carts=2), KinematicChainSettings(joints=2)])
def test_an_environment_without_poses_is_refused(settings: Any) -> None:
    with pytest.raises(ValueError, match=r"learner.predictor.kind = 'poses': .* 'learned'"):
        team_of(settings.build())


def test_compiled_best_responses_are_those_of_the_tables() -> None:
    scenario = BoxPushingSettings(start="easy").build()
    team = team_of(scenario)
    actions(scenario, team, 1)
    prediction = fuzzy(team).model.predict(look(scenario))
    joint = np.indices((4,) * 4).reshape(4, -1).T[::17]
    indices = joint @ 4 ** np.arange(3, -1, -1)
    table = prediction.tables().blocks(1).states(indices)
    assert prediction.states(1, joint) == pytest.approx(table, abs=1e-9)
