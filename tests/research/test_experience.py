"""Networks at the field's budgets: the page by the rows, verdicts, decisions to a criterion."""

import json
import re
from io import StringIO

import numpy as np
import pandas as pd
import pytest
from programs import main

import nested_agents as na
from nested_agents.studies.results.notation import format_estimate
from nested_agents.studies.results.statistics import Estimate
from nested_agents.studies.spec.spec import Spec
from research import RESULTS, experience
from research.claims import Benefit
from research.measures import Measured

DOCS = RESULTS.parents[1] / "docs"
NOTEBOOKS = RESULTS.parent / "notebooks"
PEERS = (NOTEBOOKS / "ppo.md").read_text(encoding="utf-8")
CHAIN = experience.CHAIN
NETWORKS = (CHAIN, "hierarchy-ppo, no edges")


@pytest.mark.parametrize("name", experience.TASKS)
def test_the_page_has_the_tables_that_the_rows_give(name) -> None:
    assert all(line in PEERS for line in list(experience.lines(name))[2:])


def test_the_page_has_what_edges_and_foresight_are_worth() -> None:
    for line in (*experience.edge_lines(), *experience.foresight_lines()):
        assert line in PEERS


@pytest.mark.parametrize(
    ("name", "decisions", "text"),
    [
        ("arm", 100_000, "0.08 [0.01, 0.17]"),
        ("box", 100_000, "0.20 [-0.03, 0.39]"),
        ("box", 30_000, "-0.10 [-0.40, 0.10]"),
    ],
)
def test_differences_on_the_way_are_those_of_the_rows(name, decisions, text) -> None:
    rows = experience.read(name)
    wide = rows.pivot(index=["decisions", "seed"], columns="condition", values="success")
    ahead = wide[CHAIN] - wide["hierarchy-ppo, no edges"]
    assert format_estimate(na.bootstrap(ahead.loc[decisions].to_numpy())) == text
    assert text in PEERS


def test_in_simple_spread_all_are_ahead_of_random() -> None:
    last = experience.read("spread").query("decisions == 1000000")
    compared = na.compare_table(last, score="return", seed="seed", reference="random")
    assert [d.p < 0.05 for d in compared.differences] == [True] * 4


@pytest.mark.parametrize("name", experience.TASKS)
def test_specs_have_the_conditions_and_seeds_of_the_rows(name) -> None:
    spec_of_networks = experience.spec_of(name)
    paths = sorted(spec_of_networks.parent.glob(f"{spec_of_networks.stem}*.toml"))
    rows = experience.read(name)
    labels: set[str] = set()
    for spec in map(Spec.load, paths):
        own = {condition.label for condition in spec.conditions()}
        labels |= own
        some = rows[rows["condition"].isin(own)]
        assert set(some["seed"]) == set(spec.seeds)
        assert some["decisions"].max() == spec.decisions
        assert experience.TASKS[name].episodes == spec.evaluation
    assert set(rows["condition"]) == labels
    reproduce = (DOCS / "reproduce.md").read_text(encoding="utf-8")
    assert f"| `{name}-experience.csv` | `{spec_of_networks.relative_to(DOCS.parent)}`" in reproduce


@pytest.mark.parametrize(
    ("numbers", "verdict"),
    [
        ((0.3, 0.1, 0.5, 0.01), "helps"),
        ((-0.3, -0.5, -0.1, 0.01), "harms"),
        ((0.02, -0.05, 0.1, 0.6), "equal"),
        ((0.02, -0.05, 0.11, 0.6), "not decided"),
    ],
)
def test_verdicts_go_by_p_then_by_the_whole_interval(numbers, verdict) -> None:
    *estimate, p = numbers
    measured = Measured(Estimate(*map(np.asarray, estimate)), 8, p)
    assert Benefit(0.1).decide(measured) == verdict


def test_claims_of_networks_are_the_lines_of_the_page(capsys, monkeypatch) -> None:
    assert main(["claims", "--of", "networks", "--format", "markdown"]) == 0
    _, _, *printed = capsys.readouterr().out.splitlines()
    assert len(printed) == len(experience.TASKS)
    for name, line in zip(experience.TASKS, printed, strict=True):
        study, _, criterion, result, verdict = line.strip("| ").split(" | ")[-5:]
        estimate, seeds, p = re.fullmatch(r"(.*]), (\d+) seeds, p (?:= )?(.*)", result).groups()
        margin = criterion.removeprefix("p < 0.05, or equal within ")
        last = f"{experience.TASKS[name].shown[-1]:,}"
        row = (name, seeds, last, estimate, p, margin, verdict.strip("*"))
        assert study == f"{name}-experience"
        assert f"| {' | '.join(row)} |" in PEERS
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["claims", "--of", "networks"]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    assert "simple_spread: edges" in out


SMALL = """
study = "experience"
seeds = 5
decisions = 200
steps = 5
evaluation = 2
scenario.kind = "spread"
learner = { kind = "hierarchy-ppo", environments = 4, rollout = 25, batch_size = 50 }
[[overrides]]
name = "hierarchy-ppo, chain"
topology = { kind = "chain", communication = "ancestors" }
[[overrides]]
name = "hierarchy-ppo, no edges"
topology = "independent"
[[overrides]]
name = "random"
preset = "random"
"""


def test_claims_of_networks_are_decided_by_studies_run_for_them(
    tmp_path, capsys, monkeypatch
) -> None:
    (tmp_path / "small.toml").write_text(SMALL)
    course = experience.PublishedCourse("simple_spread", (100, 200), 2, 1.0)
    monkeypatch.setattr(experience, "TASKS", {"spread": course})
    monkeypatch.setattr(experience, "spec_of", lambda name: tmp_path / "small.toml")
    arguments = ["claims", "--of", "networks", "--jobs", "1", "--out", str(tmp_path / "out")]
    assert main([*arguments, "--format", "json"]) == 0
    (record,) = json.loads(capsys.readouterr().out)
    kept = na.load(tmp_path / "out" / "spread-experience").results
    chain, none = (kept.means(name, "evaluation", "return") for name in NETWORKS)
    assert record["value"] == pytest.approx((chain - none).mean(), abs=1e-3)
    assert (record["seeds"], record["study"]) == (5, "spread-experience")
    assert main([*arguments, "--quick"]) == 2
    assert "--quick: --of networks has no small versions" in capsys.readouterr().err


def test_decisions_to_a_criterion_by_hand() -> None:
    rows = pd.DataFrame(
        {
            "decisions": [1000, 10_000] * 3,
            "seed": [0, 0, 1, 1, 2, 2],
            "success": [0.0, 1.0, 0.6, 0.9, 0.0, 0.4],
        }
    )
    needed, missed = experience.decisions_to(rows)
    assert needed.to_numpy() == pytest.approx([1000 * 10**0.5, 1000, 10_000])
    assert missed == 1


def test_rows_of_a_kept_study_are_means_of_evaluations(tmp_path, capsys) -> None:
    table = {"study": "experience", "seeds": 2, "decisions": 2000, "steps": 5, "evaluation": 2}
    table |= {"scenario": {"kind": "spread"}, "preset": "random"}
    na.run(table, tmp_path / "kept", jobs=1)
    experience.main([str(tmp_path / "kept")])
    head, *rows = capsys.readouterr().out.splitlines()
    assert head == "condition,decisions,seed,return"
    assert [row.split(",")[:3] for row in rows] == [
        ["random", str(n), str(seed)] for n in (1000, 2000) for seed in (0, 1)
    ]


def test_the_last_word_return_prints_returns_where_there_is_success_too(tmp_path, capsys) -> None:
    table = {"study": "experience", "seeds": 2, "decisions": 1000, "steps": 5, "evaluation": 20}
    table |= {"scenario": {"kind": "matrix-game", "game": "climbing"}, "preset": "random"}
    kept = na.run(table, tmp_path / "kept", jobs=1)
    experience.main([str(tmp_path / "kept"), "return"])
    rows = pd.read_csv(StringIO(capsys.readouterr().out))
    assert [*rows] == ["condition", "decisions", "seed", "return"]
    assert kept.results.success("random", "evaluation").any()
    assert rows["return"].tolist() == kept.results.means("random", "evaluation", "return").tolist()
    experience.main([str(tmp_path / "kept")])
    assert capsys.readouterr().out.startswith("condition,decisions,seed,success\n")
