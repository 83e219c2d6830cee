import re

import numpy as np
import pytest

import nested_agents as na
from nested_agents.core.agents.team import Team
from nested_agents.studies.api import planning
from nested_agents.studies.cli.main import main
from nested_agents.studies.presentation.progress import duration
from nested_agents.studies.trials.trial import trials_of

SPEC = na.Spec(
    seeds=5, episodes=4, steps=20, evaluation=2, learner={"kind": "td-lambda"},
    scenario=na.LineUpSettings(carts=2), sweep={"scenario.carts": [2, 3]},
)  # fmt: skip


def test_a_plan_shows_trials_time_memory_and_power() -> None:
    plan = na.plan(SPEC, jobs=2)
    assert (plan.trials, plan.processes, plan.comparisons) == (10, 2, 1)
    lower, upper = plan.range
    assert 0.0 < lower < plan.seconds < upper
    assert 5e7 < plan.memory < 1e10
    text = str(plan)
    assert "trials   10, each 4 episodes of up to 20 steps" in text
    assert f"time     about {duration(plan.seconds)} with 2 processes (" in text
    assert "at most" not in text
    assert max(map(len, text.splitlines())) <= 80


def test_more_seeds_find_smaller_differences() -> None:
    plans = [na.plan(SPEC.model_copy(update={"seeds": n}), timed=False) for n in (8, 20, 40)]
    smallest = [
        re.search(r"a difference of (0\.\d+) with power", " ".join(str(plan).split()))[1]
        for plan in plans
    ]
    assert smallest == sorted(smallest, reverse=True)
    assert len(set(smallest)) == 3
    assert plans[1].seconds is None
    assert plans[1].range is None
    assert all("needs about 15" in " ".join(str(plan).split()) for plan in plans)


def test_learning_from_all_steps_kept_grows_with_the_square_of_training() -> None:
    steps = np.array([30.0, 10.0, 20.0])
    seconds = 1e-3 * steps + 1e-6 * steps * np.array([30.0, 40.0, 60.0])
    totals = np.array([[500.0, 0.0], [600.0, 400.0]])
    one, two = planning.extrapolate(steps, seconds, totals, grows=True)
    assert one == pytest.approx(0.5 + 1e-6 * 500**2 / 2)
    assert two == pytest.approx(1.0 + 1e-6 * (600**2 + 400**2) / 2)
    linear = planning.extrapolate(steps, 1e-3 * steps, totals, grows=False)
    assert linear == pytest.approx([0.5, 1.0])
    assert planning.extrapolate(np.zeros(0), np.zeros(0), totals, grows=True).tolist() == [0, 0]


def test_pilot_episodes_give_the_cost_of_a_trial() -> None:
    cost = planning.pilot(trials_of(SPEC)[0])
    lower, mean, upper = cost.seconds
    assert 0.0 < lower <= mean <= upper < 60.0
    assert cost.decisions == 4 * 20 + 2 * 20


def test_large_teams_run_the_first_steps_only(monkeypatch) -> None:
    monkeypatch.setattr(planning, "MAX_AGENT_STEPS", 8)
    acted: list[int] = []
    act = Team.act
    monkeypatch.setattr(
        Team, "act", lambda team, *args, **kwargs: acted.append(1) or act(team, *args, **kwargs)
    )
    planning.pilot(trials_of(SPEC)[0])
    assert len(acted) == 2 + 2 * 2 + 4 * 4 + 2 * 4, "to compile, then episodes of 4 steps"


def test_pilot_episodes_that_are_cut_may_be_longer() -> None:
    assert planning._mean_steps(np.array([4.0, 8.0]), 20, 100).tolist() == [3.0, 6.0, 16.0]
    assert planning._mean_steps(np.array([4.0, 4.0]), 20, 4).tolist() == [4.0, 12.0, 20.0]


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--deviation", "0"], "--deviation 0: must be above 0 and at most 1"),
        (["--smallest", "x"], "'--smallest': 'x' is not a valid float"),
        (["--jobs", "0"], "--jobs 0: must be at least 1"),
    ],
)
def test_numbers_out_of_range_are_refused(tmp_path, capsys, options, complaint) -> None:
    path = tmp_path / "spec.toml"
    path.write_text("seeds = 2")
    assert main(["plan", str(path), "--no-timed", *options]) == 2
    assert complaint in capsys.readouterr().err


def test_doubtful_sizes_are_told_before_anything_is_spent(tmp_path, capsys) -> None:
    path = tmp_path / "spec.toml"
    path.write_text("seeds = 2\n[scenario.infrared]\nreach = 60.0\n")
    assert main(["plan", str(path), "--no-timed"]) == 0
    assert "scenario.infrared.reach = 60 m: perhaps meant in mm" in capsys.readouterr().out


def test_what_functions_cost_is_told_by_condition(tmp_path) -> None:
    program = (
        "def decide(observation, received):\n    return {'action': 0, 'costs': {'tokens': 2}}\n"
    )
    (tmp_path / "f.py").write_text(program)
    spec = {
        "seeds": 2, "episodes": 1, "steps": 5, "evaluation": 1,
        "scenario": {"kind": "line-up", "carts": 3},
        "learner": {"kind": str(tmp_path / "f.py:decide"), "costs": {"tokens": "1"}},
        "sweep": {"topology": ["chain", "independent"]},
    }  # fmt: skip
    plan = planning.plan(spec, jobs=1)
    lines = [line.split() for line in str(plan).splitlines()]
    assert ["messages", "calls", "message_bytes", "tokens", "joint", "actions"] in lines
    assert ["chain", "3", "3", "0", "6", "0"] in lines
    assert ["independent", "0", "3", "0", "6", "0"] in lines
    # two seeds, ten decisions a trial, three calls each
    assert "at most 60 messages, 120 calls, 0 message_bytes, 240 tokens." in " ".join(
        str(plan).split()
    )


def test_a_plan_of_three_sizes_tells_which_exponents_can_be_told_apart() -> None:
    spec = {"seeds": 12, "sweep": {"scenario.robots": [2, 4, 8], "topology": ["chain", "star"]}}
    said = " ".join(str(planning.plan(spec, timed=False)).split())
    assert "Exponents: 12 seeds of sizes 2 to 8 detect a difference of exponents of " in said
    two = {**spec, "sweep": {"scenario.robots": [2, 4]}}
    assert "Exponents" not in str(planning.plan(two, timed=False))


PPO = {"kind": "ippo", "environments": 8, "rollout": 20, "epochs": 1, "hidden": [8]}
EXPERIENCE = {"study": "experience", "seeds": 3, "steps": 10, "evaluation": 1}


@pytest.mark.parametrize(
    "own",
    [
        {"learner": PPO, "scenario": {"kind": "spread"}, "decisions": 20_000},
        {"scenario": {"kind": "line-up", "carts": 2}, "decisions": 2000},
        {"scenario": {"kind": "line-up", "carts": 2}, "decisions": 2000, "preset": "random"},
    ],
)
def test_budgets_of_decisions_are_extrapolated(own):
    tables = [{**EXPERIENCE, **own}, {**EXPERIENCE, **own, "decisions": 10 * own["decisions"]}]
    less, more = (planning.pilot(trials_of(na.Spec.of(table))[0]) for table in tables)
    assert 0.0 < less.seconds[0] <= less.seconds[1] <= less.seconds[2]
    # 20,000 decisions, and an evaluation of 10 at the end, and after 1,000, 3,000 and 10,000.
    stops = 1 + {2000: 1, 20_000: 3}[own["decisions"]]
    sampled = "learner" in own
    assert less.decisions == own["decisions"] + 10 * (stops + sampled)
    if own.get("preset") != "random":
        assert more.seconds[1] > less.seconds[1]


def test_a_plan_counts_decisions():
    table = {**EXPERIENCE, "learner": PPO, "scenario": {"kind": "spread"}, "decisions": 10**9}
    text = str(na.plan(table))
    assert "each 1,000,000,000 decisions in episodes of up to 10 steps" in text
    assert max(map(len, text.splitlines())) <= 80
