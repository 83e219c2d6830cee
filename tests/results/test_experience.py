"""Networks at the field's budgets: the page by the rows, verdicts, decisions to a criterion."""

import numpy as np
import pandas as pd
import pytest

import nested_agents as na
from nested_agents.results import ROWS, SPECS, experience
from nested_agents.studies.results.analysis import Difference
from nested_agents.studies.results.notation import bracketed
from nested_agents.studies.results.statistics import Estimate
from nested_agents.studies.spec.spec import Spec

DOCS = ROWS.parents[1] / "docs"
PEERS = (DOCS / "peers.md").read_text(encoding="utf-8")
CHAIN = experience.CHAIN


@pytest.mark.parametrize("name", experience.TASKS)
def test_the_page_has_the_tables_that_the_rows_give(name) -> None:
    assert all(line in PEERS for line in list(experience.lines(name))[2:])


def test_the_page_has_what_edges_and_foresight_are_worth() -> None:
    for line in (*experience.edge_lines(), *experience.foresight_lines()):
        assert line in PEERS


@pytest.mark.parametrize(
    ("name", "decisions", "text"),
    [
        ("arm", 100_000, ".07 [.01, .17]"),
        ("box", 100_000, ".20 [-.03, .39]"),
        ("box", 30_000, "-.10 [-.40, .10]"),
    ],
)
def test_differences_on_the_way_are_those_of_the_rows(name, decisions, text) -> None:
    rows = experience.read(name)
    wide = rows.pivot(index=["decisions", "seed"], columns="condition", values="success")
    ahead = wide[CHAIN] - wide["hierarchy-ppo, no edges"]
    assert bracketed(na.bootstrap(ahead.loc[decisions].to_numpy())) == text
    assert text in PEERS


def test_in_simple_spread_all_are_ahead_of_random() -> None:
    last = experience.read("spread").query("decisions == 1000000")
    compared = na.compare_table(last, score="return", seed="seed", reference="random")
    assert [d.p < 0.05 for d in compared.differences] == [True] * 4


@pytest.mark.parametrize("name", experience.TASKS)
def test_specs_have_the_conditions_and_seeds_of_the_rows(name) -> None:
    stem = {"arm-16": "arm_16", "four-robots": "four_robots"}.get(name, name)
    paths = sorted((SPECS / "peers").glob(f"{stem}_experience*.toml"))
    if name == "spread":
        paths = [DOCS.parent / "studies" / "catalogue" / "experience" / "experience.toml"]
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
    assert f"| `{name}-experience.csv` | `{paths[0].relative_to(DOCS.parent)}`" in reproduce


def compared(value, low, high, p):
    estimate = Estimate(*map(np.asarray, (value, low, high)))
    return Difference("none", "success", 8, estimate, p, p, np.zeros(8))


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
    assert experience.EdgeWorth(compared(*numbers), 0.1).verdict == verdict


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
