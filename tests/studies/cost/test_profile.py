"""Profiles: what time goes to and what is tried, of conditions that stay as they are."""

import signal
from pathlib import Path

import numpy as np
import pytest

import nested_agents as na
from nested_agents.core.agents.loop import control_loop
from nested_agents.studies.cli.main import main
from nested_agents.studies.cost.profile import PARTS, lines, sample_parts

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
    assert [path.name for path in tmp_path.iterdir()] == ["spec.toml"]


def test_parts_are_of_what_runs() -> None:
    table = na.profile({"steps": 20, "scenario": {"kind": "line-up"}}, seconds=0.2)
    (row,) = table.to_dict("records")
    assert min(row[part] for part in PARTS) >= 0.0
    assert row["predict"] + row["value"] + row["search"] > 0.0
    assert row["sense"] == 0.0  # line-up reports none
    assert row["tried"] == 20.0


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
    with sample_parts() as seconds:
        timed = trained()
    assert np.array_equal(plain, timed)
    assert sum(seconds.values()) > 0.0
    assert signal.getsignal(signal.SIGALRM) is before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_teams_without_a_predictor_have_profiles() -> None:
    spec = {"steps": 10, "scenario": {"kind": "line-up"}, "learner": {"kind": "fitted-q"}}
    (row,) = na.profile(spec, seconds=0.5).to_dict("records")
    assert row["value"] > 0.0
    assert row["evaluator"] == "fitted-q"


def test_hierarchies_and_the_single_agent_keep_to_equal_budgets() -> None:
    table = na.profile(EXAMPLES / "equal_computing.toml", seconds=0.01)
    assert {*table["budget"]} == {16, 64, 256}
    assert ((table["tried"] > 0) & (table["tried"] <= table["budget"])).all()
    single = table[table["condition"].str.contains("single")]
    assert dict(zip(single["budget"], single["tried"], strict=True)) == {16: 16, 64: 64, 256: 256}
    assert next(lines(table)).split()[-1] == "budget"


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
