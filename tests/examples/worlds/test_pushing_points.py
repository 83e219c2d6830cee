"""Pushing points, an example: where they are, how robots push from there and learn it."""

import doctest
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from acting import fuzzy

from nested_agents.core.learners.td import QLearning
from nested_agents.core.plugins.sources import Sources
from nested_agents.scenarios import SCENARIOS
from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.scenarios.box_pushing.world.geometry import surface
from nested_agents.scenarios.checking.checker import check_scenario
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import arrange, check_conditions
from nested_agents.studies.trials.session import Session
from nested_agents.studies.trials.trial import trials_of

WORLDS = Path(__file__).resolve().parents[3] / "examples" / "worlds"
KIND = "pushing_points.py:PushingPoints"
GAP = 0.05
SCENARIO = {"kind": KIND, "option_length": 2, "longest": 12}


@pytest.fixture(autouse=True)
def sources() -> Iterator[Sources]:
    sources = Sources(WORLDS)
    with sources.active():
        yield sources


def settings_of(**table: object):
    return SCENARIOS.parsed(KIND, **table)


@pytest.fixture
def pushing_points(sources: Sources):
    return sources.load("pushing_points.py:pushing_points")


@pytest.mark.parametrize("box", BOXES.values(), ids=BOXES)
def test_points_are_as_far_from_the_box_as_is_said_and_face_it(pushing_points, box) -> None:
    points = pushing_points(box, 8, GAP)
    for x, y, direction in points:
        gap, nx, ny = surface(box.shape, x, y)
        assert gap == pytest.approx(GAP, abs=1e-3)  # arcs have corners
        assert np.cos(direction) * nx + np.sin(direction) * ny == pytest.approx(-1.0)
    assert len({(round(x, 6), round(y, 6)) for x, y, _ in points}) == 8


def test_its_examples_hold(sources: Sources) -> None:
    module = sys.modules[sources.load("pushing_points.py:PushingPoints").__module__]
    assert doctest.testmod(module) == (0, 4)


def test_a_square_has_two_points_to_a_side(pushing_points) -> None:
    directions = pushing_points(BOXES["square"], 8, GAP)[:, 2]
    _, counts = np.unique((directions / (np.pi / 2)).round(9) % 4, return_counts=True)
    assert counts.tolist() == [2, 2, 2, 2]


def test_the_same_number_means_another_direction_on_another_box(pushing_points) -> None:
    """What the paper holds against actions that depend on the geometry of the object (X-B)."""
    square, star = (pushing_points(BOXES[name], 8, GAP)[:, 2] for name in ("square", "star"))
    turned = np.abs((star - square + np.pi) % (2 * np.pi) - np.pi)
    assert np.degrees(turned).max() > 45


def test_robots_behind_the_box_push_it_straight_to_the_goal() -> None:
    scenario = settings_of(start="easy").build()
    scenario.reset(2)
    rewards = []
    least = scenario.measure()["distance_m"] - scenario.settings.tolerance
    for _ in range(12):
        transition = scenario.step(np.array([3, 4]))  # the two points at the back
        rewards.append(transition.reward)
        if transition.terminated:
            break
    assert rewards[-1] == scenario.settings.goal_reward
    assert 0 < sum(rewards[:-1]) < least  # it came nearer by so much


@pytest.mark.parametrize("observed", ["own", "joint"])
def test_it_keeps_the_promises_of_a_scenario(observed: str) -> None:
    settings = settings_of(observed=observed, option_length=1)
    assert "predictions" in check_scenario(settings.build).passed


def test_an_episode_is_broken_off_after_its_decision_periods() -> None:
    scenario = settings_of(option_length=5, longest=12).build()
    scenario.reset(0)
    ends = [scenario.step(np.array([0, 1])) for _ in range(3)]
    assert [end.truncated for end in ends] == [False, False, True]


def test_states_hold_the_situation_and_who_chose_what() -> None:
    for observed, n_columns in (("own", 2), ("joint", 3)):
        scenario = settings_of(observed=observed, option_length=1).build()
        opening = scenario.reset(0)
        states = scenario.step(np.array([3, 5])).states
        assert states.shape == (2, n_columns)
        bearing = 1 if observed == "own" else 0
        np.testing.assert_array_equal(states[:, bearing], opening[:, bearing])
        chosen = states[:, :1].ravel() if observed == "own" else states[0, 1:]
        assert chosen.tolist() == [3.0, 5.0]


@pytest.mark.parametrize(
    ("observed", "edges", "rules"), [("own", 0, 12 * 8), ("joint", 1, 12 * 8**2)]
)
def test_presets_learn_it_by_q_learning(
    sources: Sources, observed: str, edges: int, rules: int
) -> None:
    spec = Spec.of({"scenario": {**SCENARIO, "observed": observed}}, sources)
    (condition,) = spec.conditions()
    _, _, team = arrange(condition.settings, 0)
    assert isinstance(fuzzy(team).learner, QLearning)
    assert len(team.hierarchy.edges) == edges
    assert fuzzy(team).learner.theta.shape == (2, rules)


def test_what_is_learned_on_a_square_is_evaluated_on_other_boxes(sources: Sources) -> None:
    spec = Spec.of(
        {
            "seeds": [0],
            "episodes": 1,
            "steps": 450,
            "evaluation": 1,
            "scenario": SCENARIO,
            "evaluations": {"L": {"box": "L"}, "star": {"box": "star"}},
        },
        sources,
    )
    check_conditions(spec)
    session = Session(trials_of(spec)[0])
    session.train(1)
    session.evaluate()
    session.run_other_evaluations()
    phases = [row.phase for row in session.result().rows]
    assert phases == ["training", "evaluation", "evaluation:L", "evaluation:star"]


def test_a_team_with_too_many_joint_choices_is_refused_in_one_line(sources: Sources) -> None:
    spec = Spec.of({"scenario": {**SCENARIO, "observed": "joint", "robots": 8}}, sources)
    with pytest.raises(SpecError, match=r"12 bearings x 8 \*\* 8 joint choices, allowed: 1,000,00"):
        check_conditions(spec)
