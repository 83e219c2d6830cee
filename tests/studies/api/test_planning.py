import re

import pytest
from made_up_results import Arrays, ablation, hierarchies, wheel_failure

import nested_agents as na
from nested_agents.core.agents.team import Team
from nested_agents.studies.api import planning
from nested_agents.studies.catalogue.study import load_study
from nested_agents.studies.cli.main import main
from nested_agents.studies.presentation.progress import duration
from nested_agents.studies.trials.trial import trials_of
from research import SPECS

SPEC = na.Spec(
    seeds=5, episodes=4, steps=20, evaluation=2, learner={"kind": "td-lambda"},
    scenario=na.LineUpSettings(carts=2), sweep={"scenario.carts": [2, 3]},
)  # fmt: skip


def test_a_plan_shows_trials_time_and_power() -> None:
    plan = na.plan(SPEC, jobs=2)
    assert (plan.trials, plan.processes, plan.comparisons) == (10, 2, 1)
    lower, upper = plan.range
    assert 0.0 < lower < plan.seconds < upper
    text = str(plan)
    assert "trials   10, each 4 episodes of up to 20 steps" in text
    assert f"time     about {duration(plan.seconds)} with 2 processes (" in text
    assert "at most" not in text
    assert max(map(len, text.splitlines())) <= 80


SEIZED = {"kind": "seized", "wheels": "robot1.left", "episode": 5}
SWEPT = {"learner.self_model.enabled": [False, True]}
CHANCES = {(t, "own", n): 0.5 for t in ("chain", "star", "tree") for n in (2, 4)}


@pytest.mark.parametrize(
    ("table", "results"),
    [
        (
            {
                "study": "hierarchies",
                "sweep": {"topology": ["chain", "star", "tree"], "scenario.robots": [2, 4]},
            },
            hierarchies(CHANCES),
        ),
        (
            {"study": "ablation", "sweep": {"topology": ["chain", "star", "tree"]}},
            ablation(dict.fromkeys(("chain", "star", "tree"), 0.5)),
        ),
        (
            {"study": "wheel-failure", "scenario": {"failures": [SEIZED]}, "sweep": SWEPT},
            wheel_failure(
                {"fault": {"nothing": 0.1, "weights": 0.2, "self-model": 0.3, "both": 0.4}}
            ),
        ),
    ],
)
def test_a_plan_counts_the_comparisons_of_the_study(table: dict, results: Arrays) -> None:
    spec = na.Spec.of({**table, "seeds": 8, "episodes": 10, "steps": 4, "evaluation": 2})
    planned = na.plan(spec, timed=False).comparisons
    groups = load_study(spec.study).analyse(results.frames()).differences.values()
    assert planned == sum(map(len, groups)) > 0


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


def test_pilot_episodes_give_the_cost_of_a_trial() -> None:
    seconds, startup = planning.pilot(trials_of(SPEC)[0])
    assert 0.0 < seconds < 60.0
    assert startup > 0.0


def test_large_teams_run_the_first_steps_only(monkeypatch) -> None:
    monkeypatch.setattr(planning, "MAX_AGENT_STEPS", 8)
    acted: list[int] = []
    act = Team.act
    monkeypatch.setattr(
        Team, "act", lambda team, *args, **kwargs: acted.append(1) or act(team, *args, **kwargs)
    )
    planning.pilot(trials_of(SPEC)[0])
    assert len(acted) == 3 * 4, "two training episodes and an evaluation of 4 steps"


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
    less, more = (planning.pilot(trials_of(na.Spec.of(table))[0])[0] for table in tables)
    assert less > 0.0
    if own.get("preset") != "random":
        assert more > less


def test_a_plan_counts_decisions():
    table = {**EXPERIENCE, "learner": PPO, "scenario": {"kind": "spread"}, "decisions": 10**9}
    text = str(na.plan(table))
    assert "each 1,000,000,000 decisions in episodes of up to 10 steps" in text
    assert max(map(len, text.splitlines())) <= 80


def test_recovery_is_an_outcome_of_a_whole_seed() -> None:
    spec = SPECS / "wheel-failure-poses.toml"
    assert na.plan(spec, timed=False).deviation == 0.5
    assert na.plan(spec, timed=False, deviation=0.3).deviation == 0.3
