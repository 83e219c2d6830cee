"""Profiles: what time goes to and what is tried, of conditions that stay as they are."""

import signal
from pathlib import Path

import numpy as np
import pytest

import nested_agents as na
from nested_agents.core.agents.loop import control_loop
from nested_agents.studies.cli.main import main
from nested_agents.studies.cost.profile import DECIDING, PARTS, Profile, ProfileTable, Sampler

if not hasattr(signal, "setitimer"):
    pytest.skip("takes a timer of the system", allow_module_level=True)

SPEC = """
study = "scaling"
seeds = 1
steps = 10
scenario.kind = "line-up"
[sweep]
topology = ["chain", "tree:2"]
scenario.carts = [2, 6]
"""

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


def test_what_is_tried_stands_beside_the_formulas(tmp_path: Path, capsys) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text(SPEC)
    assert main(["profile", str(spec), "--seconds", "0.05"]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    lines = [line.split() for line in out.splitlines()]
    # A chain of two tries 4 ** 2 + 4; of six, 4 + 16 + ... + 4 ** 6 would be 5,460.
    assert ["topology=chain,", "carts=2", "exact", "20", "20"] in [line[:5] for line in lines]
    (chain,) = (
        line for line in lines if line[:2] == ["topology=chain,", "carts=6"] and len(line) == 7
    )
    assert chain[2] != "exact"
    assert chain[4] == "5,460"
    assert "not as by the formula with 6 agents." in " ".join(out.split())
    assert [path.name for path in tmp_path.iterdir()] == ["spec.toml"]


def test_parts_are_of_what_runs() -> None:
    table = na.profile({"steps": 20, "scenario": {"kind": "line-up"}}, seconds=0.2)
    (row,) = table.rows
    assert set(row.seconds) == set(PARTS)
    assert min(row.seconds.values()) >= 0.0
    assert row.deciding > 0.0
    assert row.deciding == pytest.approx(sum(row.seconds[part] for part in DECIDING))
    assert row.seconds["sense"] == 0.0  # line-up reports none
    assert list(table.frame["tried"]) == [20.0]


def test_a_team_that_is_timed_learns_the_same() -> None:
    def trained() -> np.ndarray:
        scenario = na.LineUpSettings(carts=3).build()
        hierarchy = na.build_hierarchy(na.parse_topology("chain"), scenario.agents)
        team = na.Team(na.BatchTDSettings(), scenario, hierarchy, na.policy_seed(3))
        for _ in control_loop(scenario, team, episodes=2, steps=10, seed=3):
            pass
        return team.state_dict()["learner.theta"]

    plain = trained()
    before = signal.getsignal(signal.SIGALRM)
    with Sampler() as sampler:
        timed = trained()
    assert np.array_equal(plain, timed)
    assert sum(sampler.seconds.values()) > 0.0
    assert signal.getsignal(signal.SIGALRM) is before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def profile_of(agents: int, tried: float, formula: int, seconds: float) -> Profile:
    parts = dict.fromkeys(PARTS, 0.0) | {"predict": 0.75 * seconds, "search": 0.25 * seconds}
    name = "exact" if tried == formula else "best-response"
    return Profile(f"chain, robots={agents}", "chain", agents, name, 100, tried, formula, parts)


def test_growth_is_that_of_what_is_tried_times_that_of_each() -> None:
    table = ProfileTable((profile_of(2, 20.0, 20, 0.001), profile_of(8, 200.0, 87_380, 0.03)))
    text = " ".join(str(table).split())
    assert (
        "chain: 2 to 8 agents: decisions take 30 times as long: 10 times the joint actions, each "
        "3 times as long. The largest part is predict (75%); exact then best-response: not as by "
        "the formula with 8 agents."
    ) in text
    assert ["chain,", "robots=2", "exact", "20", "20", "1", "50"] in [
        line.split() for line in str(table).splitlines()
    ]


def test_teams_without_a_predictor_have_profiles() -> None:
    spec = {"steps": 10, "scenario": {"kind": "line-up"}, "learner": {"kind": "fitted-q"}}
    (row,) = na.profile(spec, seconds=0.5).rows
    assert row.seconds["value"] > 0.0
    assert row.evaluator == "fitted-q"


def test_hierarchies_and_the_single_agent_keep_to_equal_budgets() -> None:
    table = na.profile(EXAMPLES / "equal_computing.toml", seconds=0.01)
    assert {row.budget for row in table.rows} == {16, 64, 256}
    assert all(0 < row.tried <= row.budget for row in table.rows if row.budget is not None)
    single = {row.budget: row.tried for row in table.rows if "single" in row.condition}
    assert single == {16: 16, 64: 64, 256: 256}
    assert str(table).splitlines()[0].split()[-1] == "budget"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--seconds", "0"], "--seconds 0: must be above 0 and at most 3600"),
        (["--seconds", "nan"], "--seconds nan: must be above 0 and at most 3600"),
        (["--set", "scenario.carts=0"], "scenario.carts"),
    ],
)
def test_bad_input(arguments: list[str], message: str, tmp_path: Path, capsys) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text('scenario.kind = "line-up"\n')
    assert main(["profile", str(spec), *arguments]) == 2
    assert message in capsys.readouterr().err
