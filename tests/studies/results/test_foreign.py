"""Tables of scores that others have measured: read, checked, compared."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import nested_agents as na
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.results.foreign import ScoreColumns, results_of

TOPOLOGIES = {"chain": 0.2, "star": 0.5, "ring": 0.8}
NAMES = ScoreColumns(("topology",), ("right",), "run", "question")


@pytest.fixture(scope="module")
def scores() -> pd.DataFrame:
    """Five runs of three topologies on four questions."""
    rng = np.random.default_rng(0)
    rows = [
        (topology, run, f"q{k}", int(rng.random() < rate), 10.0 * rate + run)
        for topology, rate in TOPOLOGIES.items()
        for run in range(8)
        for k in range(4)
    ]
    return pd.DataFrame(rows, columns=["topology", "run", "question", "right", "tokens"])


def test_a_table_is_compared_as_a_study_is(scores) -> None:
    results = results_of(scores, NAMES).results
    assert results.conditions == ("chain", "star", "ring")
    assert results.measures[0].is_rate
    for topology, own in scores.groupby("topology"):
        by_run = own.pivot(index="run", columns="question", values="right").to_numpy()
        assert (results.values(topology, "right", "evaluation") == by_run).all()
    comparison = na.compare_table(
        scores, condition="topology", score="right", seed="run", item="question"
    )
    means = scores.groupby(["topology", "run"])["right"].mean()
    for d in comparison.differences:
        own = (means[d.condition] - means["chain"]).to_numpy()
        assert d.sample == pytest.approx(own)
        assert d.estimate.value == pytest.approx(own.mean())


def test_rows_in_another_order_are_the_same_results(scores) -> None:
    before = results_of(scores, NAMES).results
    shuffled = scores.sample(frac=1.0, random_state=1)
    after = results_of(shuffled, NAMES).results
    for topology in TOPOLOGIES:
        values = (r.values(topology, "right", "evaluation") for r in (before, after))
        assert np.array_equal(*values)


def test_without_seeds_items_are_compared_one_by_one(scores) -> None:
    few = scores[scores["run"] == 0]
    foreign = results_of(few, ScoreColumns(("topology",), ("right",), None, "question"))
    assert foreign.results.seeds("chain") == (0, 1, 2, 3)
    assert "compared on these" in foreign.remarks[0]


def test_without_either_every_row_is_a_run(scores) -> None:
    results = results_of(scores, ScoreColumns(("topology",), ("tokens",))).results
    assert len(results.seeds("chain")) == 32


def test_several_rows_of_a_run_are_averaged(scores) -> None:
    (measure,) = results_of(scores, ScoreColumns(("topology",), ("right",), "run")).results.measures
    assert not measure.is_rate
    assert measure.bounds == (0.0, 1.0)


def test_columns_of_conditions_are_crossed(scores) -> None:
    table = scores.assign(model=np.where(scores["run"] < 4, "small", "large"))
    comparison = na.compare_table(
        table,
        condition=["topology", "model"],
        score="tokens",
        seed="run",
        item="question",
        by="topology",
    )
    assert [group.setting for group in comparison.contrasts.groups] == ["small", "large"]
    assert len(comparison.differences) == 4


def test_what_is_unknown_may_be_blank(scores) -> None:
    table = pd.concat(
        [scores, pd.DataFrame({"topology": ["published"], "right": [0.9]})], ignore_index=True
    )
    foreign = results_of(table, NAMES)
    assert foreign.results.seeds("published") == (8,)
    blank = table.assign(right=table["right"].where(table["run"] != 3))
    assert results_of(blank, NAMES).remarks == ("12 of 97 rows have no score: left out",)


def test_items_that_not_all_runs_have_are_left_out_and_told(scores) -> None:
    fewer = scores.drop(index=scores.index[5])
    foreign = results_of(fewer, NAMES)
    assert foreign.remarks == ("1 of 4 values of 'question' are not of all runs: left out",)
    assert foreign.results.values("star", "right", "evaluation").shape == (8, 3)


@pytest.mark.parametrize("name", ["steps", "return", "seed", "phase"])
def test_scores_may_have_names_that_mean_something_in_studies(scores, name) -> None:
    table = scores.rename(columns={"tokens": name})
    comparison = na.compare_table(
        table, condition="topology", score=name, seed="run", item="question"
    )
    assert comparison.contrasts.title == f"evaluation {name}"
    assert comparison.differences[0].estimate.value == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("changes", "names", "said"),
    [
        ({}, NAMES._replace(score=("rihgt",)), r"score = 'rihgt': no such column; did you mean"),
        ({}, NAMES._replace(score=("run",)), r"score = 'run': is named twice"),
        ({"right": "x"}, NAMES, r"right = 'x' in row 0: must be a finite number"),
        ({"right": np.inf}, NAMES, r"right = inf in row 0: must be a finite number"),
        ({"topology": None}, NAMES, r"topology is blank in row 0"),
        ({"question": "q1"}, NAMES, r"row 1: condition 'chain', run and question stand in a row"),
        ({"run": None}, NAMES, r"condition 'chain': some of its rows have a seed"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(scores, changes, names, said) -> None:
    table = scores.astype({"right": object, "run": object}).copy()
    for name, value in changes.items():
        table.loc[0, name] = value
    with pytest.raises(SpecError, match=said) as caught:
        results_of(table, names)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", [".csv", ".jsonl", ".parquet"])
def test_every_form_gives_the_same_table(scores, suffix, tmp_path, capfd) -> None:
    path = tmp_path / f"scores{suffix}"
    if suffix == ".csv":
        scores.to_csv(path, index=False)
    elif suffix == ".jsonl":
        scores.to_json(path, orient="records", lines=True)
    else:
        pytest.importorskip("pyarrow", reason="pip install pyarrow")
        scores.to_parquet(path)
    page = tmp_path / "page.html"
    columns = "condition=topology,seed=run,item=question,score=right+tokens"
    command = ["compare", str(path), "--columns", columns, "--statistics"]
    assert main([*command, "--measure", "tokens", "--better", "lower", "--out", str(page)]) == 0
    out, err = capfd.readouterr()
    assert "worse: ring, +6 [" in out
    assert "interquartile mean" in out
    assert not err
    html = page.read_text(encoding="utf-8")
    assert "<svg" in html
    assert "worse: ring" in html


@pytest.mark.parametrize(
    ("text", "columns", "said"),
    [
        ("", "", "holds no table of scores: No columns"),
        ("a,b\n1,2\n", "", "columns: condition = 'condition': no such column; known: a, b"),
        ("condition,score\na,1\n", "colour=b", "must be ROLE=COLUMN"),
        ("condition,score\na,\n", "", "score = 'score': no row has one"),
    ],
)
def test_files_that_hold_none_are_refused(text, columns, said, tmp_path, capfd) -> None:
    path = tmp_path / "scores.csv"
    path.write_text(text)
    assert main(["compare", str(path), *(["--columns", columns] if columns else [])]) == 2
    assert said in capfd.readouterr().err


def test_columns_are_of_tables_alone(tmp_path: Path, capfd) -> None:
    assert main(["compare", str(tmp_path), "--columns", "score=a"]) == 2
    assert "columns: are of tables, .csv, .jsonl, .parquet" in capfd.readouterr().err
