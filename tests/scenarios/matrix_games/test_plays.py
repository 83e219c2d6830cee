"""Compiled episodes against the control loop, for every part that the kernel knows."""

import dataclasses

import numpy as np
import pytest
from acting import fuzzy

from nested_agents.core.agents.loop import control_loop, world_seed
from nested_agents.core.decision.exploration import BoltzmannExploration, PaperExploration
from nested_agents.scenarios.matrix_games.plays import parts_of, whole_episode
from nested_agents.studies.spec.conditions import ConditionSettings
from nested_agents.studies.trials.arrangement import arrange

PLAYS = 40
FULL = {"joint": 2, "own": 1, "above": 2}


def settings(kind, observed, topology, teammates, game="stochastic-climbing", **learner):
    order = {"own": 1}.get(observed, 3 if game == "three-agents" else 2)
    return ConditionSettings.model_validate(
        {
            "scenario": {"kind": "matrix-game", "game": game, "observed": observed},
            "topology": topology,
            "learner": {
                "kind": kind,
                "discount": 0.0,
                "rule_base": {"order": order},
                "exploration": {"kind": "boltzmann"},
                "decision": {"teammates": teammates},
                **({} if kind == "frozen" else {"step_size": 0.1}),
                **learner,
            },
        }
    )


CASES = [
    settings("td-lambda", "own", "independent", "best-response", normalised=True),
    settings("td-lambda", "joint", "simultaneous", "empirical"),
    settings("td-lambda", "joint", "simultaneous", "best-response", game="penalty:-10"),
    settings("optimistic-td", "own", "independent", "uniform"),
    settings("optimistic-td", "joint", "chain", "uniform", falling=0.25),
    settings("fmq", "own", "independent", "best-response"),
    settings("td-lambda", "above", "chain", "uniform", game="three-agents"),
    settings("td-lambda", "joint", "chain:reversed", "best-response", game="three-agents"),
    settings("td-lambda", "joint", "chain", "conditional", game="three-agents"),
    settings("td-lambda", "joint", "star", "empirical", game="three-agents"),
    settings("frozen", "joint", "chain", "best-response", game="climbing"),
]
EXPLORATIONS = [
    BoltzmannExploration(),
    PaperExploration(decay=0.05),
    PaperExploration(decay=0.05, clock="episode"),
]


@pytest.mark.parametrize("case", range(len(CASES)))
@pytest.mark.parametrize("exploration", EXPLORATIONS, ids=["boltzmann", "paper", "afresh"])
def test_a_compiled_episode_is_the_control_loops(case, exploration):
    learner = CASES[case].learner.model_copy(update={"exploration": exploration})
    condition = CASES[case].model_copy(update={"learner": learner})
    (_, game, team), (_, other, reference) = arrange(condition, 3), arrange(condition, 3)
    for episode, learn in enumerate([True, False, True]):
        records = control_loop(
            other, reference, episodes=1, steps=PLAYS, seed=3, first_episode=episode, learn=learn
        )
        rewards, optimal = zip(
            *((r.transition.reward, r.transition.info["optimal"]) for r in records), strict=True
        )
        seed = world_seed(3, episode)
        summary = whole_episode(game, team, seed, episode, PLAYS, learn=learn)
        assert summary.steps == PLAYS
        assert summary.return_ == pytest.approx(sum(rewards))
        assert summary.measures["optimal_plays"] == pytest.approx(np.mean(optimal))
        assert summary.measures["success"] == optimal[-1]
    assert dataclasses.asdict(team.counts) == dataclasses.asdict(reference.counts)
    arrays, expected = team.arrays(), reference.arrays()
    assert arrays.keys() == expected.keys()
    for name in arrays.keys() - {"learner.trace", "learner.reach"}:  # of no effect: discount 0
        np.testing.assert_allclose(arrays[name], expected[name], rtol=1e-12, err_msg=name)
    assert (arrays["generator"] == expected["generator"]).all()


@pytest.mark.parametrize(
    "changes",
    [
        {"discount": 0.5},
        {"rule_base": {"order": 1}},
        {"rule_base": {"order": 2, "membership": "sigmoid"}},
        {"exploration": {"kind": "burst"}},
        {"exploration": {"kind": "paper", "exploit": "sample"}},
        {"exploration": {"kind": "paper", "explore": "boltzmann"}},
        {"decision": {"rule": "reward"}},
        {"decision": {"value_of": "team"}},
        {"decision": {"evaluator": "sampling"}},
        {"averaging": 5.0},
    ],
)
def test_what_the_kernel_does_not_know_is_left_to_the_control_loop(changes):
    condition = settings("td-lambda", "joint", "chain", "best-response", **changes)
    _, game, team = arrange(condition, 0)
    assert parts_of(game, fuzzy(team), learn=True) is None
    assert whole_episode(game, team, world_seed(0, 0), 0, 5, learn=True) is None
    assert len(list(control_loop(game, team, episodes=1, steps=5, seed=0))) == 5
