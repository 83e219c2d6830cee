"""Box pushing with one agent per robot: its promises, and how it is learned."""

import numpy as np
import pytest
from acting import fuzzy

from nested_agents.core.learners.td import QLearning
from nested_agents.scenarios.box_pushing.config import PushingPointsSettings
from nested_agents.scenarios.checking.checker import check_scenario
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session, arrange, check
from nested_agents.studies.trials.trial import trials_of

SCENARIO = {"kind": "pushing-points", "option_length": 2, "longest": 12}


@pytest.mark.parametrize("observed", ["own", "joint"])
def test_it_keeps_the_promises_of_a_scenario(observed: str) -> None:
    settings = PushingPointsSettings(observed=observed, option_length=1)
    assert "predictions" in check_scenario(settings.build).passed


def test_an_episode_is_broken_off_after_its_decision_periods() -> None:
    scenario = PushingPointsSettings(option_length=5, longest=12).build()
    scenario.reset(0)
    ends = [scenario.step(np.array([0, 1])) for _ in range(3)]
    assert [end.truncated for end in ends] == [False, False, True]


def test_states_hold_the_situation_and_who_chose_what() -> None:
    for observed, n_columns in (("own", 2), ("joint", 3)):
        scenario = PushingPointsSettings(observed=observed, option_length=1).build()
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
def test_presets_learn_it_by_q_learning(observed: str, edges: int, rules: int) -> None:
    (condition,) = Spec.of({"scenario": {**SCENARIO, "observed": observed}}).conditions()
    _, _, team = arrange(condition.settings, 0)
    assert isinstance(fuzzy(team).learner, QLearning)
    assert len(team.hierarchy.edges) == edges
    assert fuzzy(team).learner.theta.shape == (2, rules)


def test_what_is_learned_on_a_square_is_evaluated_on_other_boxes() -> None:
    spec = Spec.of(
        {
            "seeds": [0], "episodes": 1, "steps": 450, "evaluation": 1, "scenario": SCENARIO,
            "evaluations": {"L": {"box": "L"}, "star": {"box": "star"}},
        }
    )  # fmt: skip
    check(spec)
    session = Session(trials_of(spec)[0])
    session.train(1)
    session.evaluate()
    session.run_other_evaluations()
    phases = [row.phase for row in session.result().rows]
    assert phases == ["training", "evaluation", "evaluation:L", "evaluation:star"]


def test_a_team_with_too_many_joint_choices_is_refused_in_one_line() -> None:
    spec = Spec.of({"scenario": {**SCENARIO, "observed": "joint", "robots": 8}})
    with pytest.raises(SpecError, match=r"12 bearings x 8 \*\* 8 joint choices, allowed: 1,000,00"):
        check(spec)
