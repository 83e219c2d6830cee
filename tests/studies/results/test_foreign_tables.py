"""Tables of scores that other tools have measured: read, checked, compared."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import nested_agents as na
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.results.foreign_tables import columns_by_role, read_scores
from nested_agents.studies.results.score_tables import table_of
from nested_agents.studies.results.scores import ScoreResults

TOPOLOGIES = {"chain": 0.2, "ring": 0.8, "star": 0.5}
ROLES = {"condition": "topology", "seed": "run", "item": "question"}
NAMES = {**ROLES, "score": "right"}


def read(frame: pd.DataFrame, columns: dict[str, str] = NAMES) -> ScoreResults:
    table = table_of(frame)
    return read_scores(table, columns_by_role(columns, table.columns))


@pytest.fixture(scope="module")
def scores() -> pd.DataFrame:
    """Eight runs of three topologies on four questions."""
    rng = np.random.default_rng(0)
    rows = [
        (topology, run, f"q{k}", int(rng.random() < rate), 10.0 * rate + run)
        for topology, rate in TOPOLOGIES.items()
        for run in range(8)
        for k in range(4)
    ]
    return pd.DataFrame(rows, columns=["topology", "run", "question", "right", "tokens"])


def test_a_table_is_compared_as_a_study_is(scores) -> None:
    results = read(scores).results
    assert results.conditions == ("chain", "ring", "star")
    assert results.measures[0].is_rate
    for topology, own in scores.groupby("topology"):
        by_run = own.pivot(index="run", columns="question", values="right").to_numpy()
        assert (results.values(topology, "right", "evaluation") == by_run).all()
    comparison = na.compare_table(scores, score="right", **ROLES)
    means = scores.groupby(["topology", "run"])["right"].mean()
    for d in comparison.differences:
        own = (means[d.condition] - means["chain"]).to_numpy()
        assert d.sample == pytest.approx(own)
        assert d.estimate.value == pytest.approx(own.mean())


def test_rows_in_another_order_are_the_same_results(scores) -> None:
    before = read(scores).results
    after = read(scores.sample(frac=1.0, random_state=1)).results
    assert before.conditions == after.conditions
    for topology in TOPOLOGIES:
        values = (r.values(topology, "right", "evaluation") for r in (before, after))
        assert np.array_equal(*values)


def test_without_seeds_items_are_compared_one_by_one(scores) -> None:
    few = scores[scores["run"] == 0]
    foreign = read(few, NAMES | {"seed": None})
    assert foreign.results.seeds("chain") == ("q0", "q1", "q2", "q3")
    assert "one value of 'question'" in foreign.notes[0]


def test_without_either_samples_are_independent(scores) -> None:
    few = scores[scores["question"] == "q0"][["topology", "tokens"]]
    comparison = na.compare_table(few, condition="topology", score="tokens")
    assert not any(d.paired for d in comparison.differences)
    assert "difference (independent samples)" in comparison.table.csv
    assert "difference (independent samples)" in comparison.table.latex
    assert "independent samples" in str(comparison)
    assert "--columns seed=COLUMN" in str(comparison)
    shuffled = few.sample(frac=1.0, random_state=1)
    assert str(na.compare_table(shuffled, condition="topology", score="tokens")) == str(comparison)


def test_several_rows_of_a_run_are_refused_unless_their_items_are_named(scores) -> None:
    with pytest.raises(SpecError, match=r"row 1: topology = 'chain', run = '0'.*item=COLUMN"):
        read(scores, NAMES | {"item": None})


def test_a_repeated_seed_is_shown_as_the_file_has_it(tmp_path) -> None:
    path = tmp_path / "episodes.csv"
    path.write_text("condition,seed,phase,episode,steps\n" + "a,0,training,0,5\n" * 2)
    with pytest.raises(SpecError, match="condition = 'a', phase = 'training', seed = '0', ep"):
        na.load(path, columns=["score=steps,item=episode"])


def test_runs_of_other_names_are_independent_samples_of_common_items(scores) -> None:
    renamed = scores.assign(run=scores["topology"] + scores["run"].astype(str))
    lacks = renamed[(renamed["topology"] != "ring") | (renamed["question"] != "q3")]
    compared = na.compare_table(lacks, score="right", **ROLES)
    ring, star = compared.differences
    own, base = (
        lacks[(lacks["topology"] == name) & (lacks["question"] != "q3")]["right"].mean()
        for name in ("ring", "chain")
    )
    assert not ring.paired
    assert not star.paired
    assert float(ring.estimate.value) == pytest.approx(own - base)
    assert "8 of 56 scores of chain and ring" in " ".join(str(compared).split())


def test_columns_of_conditions_are_crossed(scores) -> None:
    table = scores.assign(model=np.where(scores["run"] < 4, "small", "large"))
    roles = ROLES | {"condition": ["topology", "model"]}
    comparison = na.compare_table(table, score="tokens", by="topology", **roles)
    assert [group.setting for group in comparison.analysis.groups] == ["large", "small"]
    assert len(comparison.differences) == 4


def test_what_is_unknown_may_be_blank(scores) -> None:
    table = pd.concat(
        [scores, pd.DataFrame({"topology": ["published"], "right": [0.9]})], ignore_index=True
    )
    foreign = read(table)
    assert len(foreign.results.seeds("published")) == 1
    blank = table.assign(right=table["right"].where(table["run"] != 3))
    assert read(blank).notes == ("12 of 97 rows have no 'right': left out",)


def test_scores_are_paired_by_seed_and_item(scores) -> None:
    fewer = scores.drop(index=scores.index[[5, 40]])
    comparison = na.compare_table(fewer, score="tokens", **ROLES)
    assert [float(d.estimate.value) for d in comparison.differences] == pytest.approx([6.0, 3.0])
    said = " ".join(" ".join(comparison.notes).split())
    assert "2 of 62 scores of chain and ring; 1 of 63 scores of chain and star" in said
    killed = scores[(scores["topology"] != "star") | (scores["run"] > 0)]
    comparison = na.compare_table(killed, score="tokens", **ROLES)
    assert [d.seeds for d in comparison.differences] == [8, 7]


@pytest.mark.parametrize("name", ["steps", "return", "seed", "phase", "step", "condition"])
def test_scores_may_have_names_that_mean_something_in_studies(scores, name) -> None:
    table = scores.rename(columns={"tokens": name})
    comparison = na.compare_table(table, score=name, reference="chain", **ROLES)
    assert comparison.analysis.title == f"evaluation {name}"
    assert comparison.differences[0].estimate.value == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("changes", "names", "said"),
    [
        ({}, NAMES | {"score": "rihgt"}, r"score = 'rihgt': no such column; did you mean"),
        ({}, NAMES | {"score": "run"}, r"score = 'run': is named twice"),
        ({"right": "x"}, NAMES, r"row 0: right = 'x': must be a finite number"),
        ({"right": "0,5"}, NAMES, r"row 0: right = '0,5': must be a finite number"),
        ({"right": np.inf}, NAMES, r"row 0: right = inf: must be a finite number"),
        ({"topology": None}, NAMES, r"row 0: topology is blank"),
        ({"topology": b"chain"}, NAMES, r"row 0: topology = .*: must be text or a number"),
        ({"question": None}, NAMES, r"row 0: question is blank"),
        ({"question": "q1"}, NAMES, r"row 1: .*question = 'q1': stands in row 0, too"),
        ({"run": None}, NAMES, r"row 0: run is blank, but other rows of its condition"),
        ({"run": "1"}, NAMES, r"run = 1: must be text everywhere or a number everywhere"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(scores, changes, names, said) -> None:
    table = scores.astype(dict.fromkeys(("right", "run", "topology"), object))
    for name, value in changes.items():
        table.loc[0, name] = value
    with pytest.raises(SpecError, match=said) as caught:
        read(table, names)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", ["string", "category", "Int64", "boolean", "Float64", object])
def test_columns_of_pandas_are_read_whatever_their_type(scores, kind) -> None:
    column = {"boolean": "right", "Float64": "tokens", "Int64": "run"}.get(kind, "topology")
    table = scores.astype({column: kind})
    expected = na.compare_table(scores, score="right", **ROLES)
    assert str(na.compare_table(table, score="right", **ROLES)) == str(expected)


def test_phases_are_not_pooled(scores, tmp_path, capfd) -> None:
    table = scores[["topology", "run", "question", "tokens"]].assign(phase="train")
    test = table.assign(phase="test", tokens=table["tokens"] ** 2)
    path = tmp_path / "scores.csv"
    pd.concat([table, test]).to_csv(path, index=False)
    command = ["compare", str(path), "--columns"]
    command.append("condition=topology,seed=run,item=question,score=tokens")
    assert main(command) == 2
    assert "phase: name one, known: test, train" in capfd.readouterr().err
    assert main([*command, "--phase", "train"]) == 0
    assert "train tokens, minus that of chain" in capfd.readouterr().out
    assert main([*command, "--phase", "tset"]) == 2
    assert "phase = 'tset': did you mean 'test'" in capfd.readouterr().err


def test_series_are_compared_at_the_last_common_step() -> None:
    rows = [(c, s, 10 * k, s + k * (c == "b")) for c in "ab" for s in range(8) for k in range(4)]
    table = pd.DataFrame(rows, columns=["condition", "seed", "step", "score"])
    whole = na.compare_table(table)
    assert float(whole.differences[0].estimate.value) == 3.0
    killed = table[(table["condition"] != "b") | (table["seed"] > 0) | (table["step"] < 20)]
    comparison = na.compare_table(killed)
    assert (comparison.differences[0].seeds, float(comparison.differences[0].estimate.value)) == (
        7, 3.0,
    )  # fmt: skip
    assert "step 30, the last" in " ".join(comparison.notes)
    assert "1 of 16 runs" in " ".join(comparison.notes)


@pytest.mark.parametrize("suffix", [".csv", ".jsonl", ".json", ".parquet"])
def test_every_form_gives_the_same_table(scores, suffix, tmp_path, capfd) -> None:
    path = tmp_path / f"scores{suffix}"
    if suffix == ".csv":
        scores.to_csv(path, index=False)
    elif suffix == ".parquet":
        pytest.importorskip("pyarrow", reason="pip install pyarrow")
        scores.to_parquet(path)
    else:
        scores.to_json(path, orient="records", lines=suffix == ".jsonl")
    page = tmp_path / "page.html"
    columns = "condition=topology,seed=run,item=question,score=right+tokens"
    command = ["compare", str(path), "--columns", columns, "--statistics"]
    assert main([*command, "--measure", "tokens", "--better", "lower", "--out", str(page)]) == 0
    out, err = capfd.readouterr()
    assert "worse: ring, +6 " in out
    assert "interquartile mean" in " ".join(out.split())
    assert not err
    html = page.read_text(encoding="utf-8")
    assert "<svg" in html
    assert "worse: ring" in html
    assert main(["table", str(path)]) == 2  # no column is called score


def test_a_file_and_a_frame_have_the_same_defaults(scores, tmp_path) -> None:
    table = scores.rename(columns={"topology": "condition", "run": "seed", "tokens": "score"})
    table = table.drop(columns="right").rename(columns={"question": "item"})
    path = tmp_path / "scores.csv"
    table.sample(frac=1.0, random_state=2).to_csv(path, index=False)
    assert str(na.compare_table(path)) == str(na.load(path).compare())
    assert str(na.compare_table(table)) == str(na.compare_table(path))


@pytest.mark.parametrize(
    ("text", "columns", "said"),
    [
        ("", "", "holds no table of scores: no columns"),
        ("a,b\n1,2\n", "", "columns: condition = 'condition': no such column; known: a, b"),
        ("condition,score\na,1\n", "color=b", "must be ROLE=COLUMN"),
        ("condition,score\na,\n", "", "score = 'score': no row has one"),
    ],
)
def test_files_that_hold_none_are_refused(text, columns, said, tmp_path, capfd) -> None:
    path = tmp_path / "scores.csv"
    path.write_text(text)
    assert main(["compare", str(path), *(["--columns", columns] if columns else [])]) == 2
    assert said in capfd.readouterr().err


def test_columns_and_better_are_of_other_tools_alone(tmp_path: Path, capfd) -> None:
    study = tmp_path / "out"
    spec = {"seeds": 1, "episodes": 1, "steps": 1, "evaluation": 1, "preset": "random"}
    na.run(spec, study, jobs=1, progress=False)
    assert main(["compare", str(study), "--columns", "score=a"]) == 2
    assert "columns: are of tables, .csv, .jsonl, .parquet" in capfd.readouterr().err
    assert main(["compare", str(study), "--better", "lower"]) == 2
    assert "better: is of results of other tools" in capfd.readouterr().err


def test_scores_of_different_items_are_not_compared(tmp_path, capsys) -> None:
    rows = [("a", seed, f"a{k}", 0.1 * k) for seed in range(4) for k in range(3)]
    rows += [("b", seed, f"b{k}", 1.0 + 0.1 * k) for seed in range(4) for k in range(3)]
    table = pd.DataFrame(rows, columns=["condition", "seed", "item", "score"])
    table.to_csv(tmp_path / "scores.csv", index=False)
    assert main(["compare", str(tmp_path / "scores.csv")]) == 0
    out, err = capsys.readouterr()
    assert "better" not in out
    assert "Nothing to compare" in out
    assert not err


def test_the_direction_of_known_measures_is_refused(tmp_path, capsys) -> None:
    rows = [(c, s, "training", e, 5) for c in "ab" for s in range(3) for e in range(2)]
    columns = ["condition", "seed", "phase", "episode", "steps"]
    pd.DataFrame(rows, columns=columns).to_csv(tmp_path / "log.csv", index=False)
    assert main(["compare", str(tmp_path / "log.csv"), "--better", "lower"]) == 2
    assert "better = 'lower'" in capsys.readouterr().err
    with pytest.raises(ValueError, match="better = 'up', allowed: higher or lower"):
        na.compare_table(tmp_path / "log.csv", better="up")


def test_a_choice_of_trials_runs_no_code(tmp_path, capsys) -> None:
    rows = [(c, s, 1.0) for c in "ab" for s in range(3)]
    table = pd.DataFrame(rows, columns=["condition", "seed", "score"])
    table.to_csv(tmp_path / "scores.csv", index=False)
    made = tmp_path / "made"
    for choice in (f"@pd.io.common.os.mkdir('{made}') == 0", "condition.__class__ == 0"):
        assert main(["compare", str(tmp_path / "scores.csv"), "--where", choice]) == 2
        assert "where = " in capsys.readouterr().err
    assert not made.exists()


@pytest.mark.parametrize(
    ("column", "names"),
    [
        ("condition", ("a", "a ")),
        ("condition", ("\u00e9", "e\u0301")),
        ("seed", ("1", "1.0")),
        ("seed", ("7", "07")),
    ],
)
def test_names_that_look_alike_stay_apart_and_are_told(column: str, names: tuple[str, str]) -> None:
    labels = names if column == "condition" else ("a", "b")
    firsts = names if column == "seed" else ("1", "1")
    rows = [
        (label, seed, k + 0.1 * len(seed))
        for k, (label, first) in enumerate(zip(labels, firsts, strict=True))
        for seed in (first, "21", "22", "23")
    ]
    table = pd.DataFrame(rows, columns=["condition", "seed", "score"])
    results, notes, _ = read(table, {})
    assert {*results.conditions} == {*labels}
    assert len({seed for label in labels for seed in results.seeds(label)}) == len({*firsts}) + 3
    told = [note for note in notes if "look alike" in note]
    assert [note.startswith(f"{column}: {names[0]!a} and {names[1]!a}") for note in told] == [True]


def test_the_size_with_the_smallest_loss_may_be_the_best(tmp_path: Path, capsys) -> None:
    rows = [(size, seed, size + 0.1 * seed) for size in (2, 4, 8) for seed in range(4)]
    path = tmp_path / "losses.csv"
    pd.DataFrame(rows, columns=["condition", "seed", "score"]).to_csv(path, index=False)
    best = {}
    for better in ("higher", "lower"):
        assert main(["scalability", str(path), "--better", better]) == 0
        said = " ".join(capsys.readouterr().out.split())
        (best[better],) = re.findall(r"is best with (\d+) ", said)
    assert best == {"higher": "8", "lower": "2"}


def test_a_law_says_that_no_seed_ran_at_every_size(tmp_path: Path) -> None:
    rows = [(n, f"{n}-{seed}", n + seed) for n in (2, 4, 8) for seed in range(3)]
    path = tmp_path / "sizes.csv"
    pd.DataFrame(rows, columns=["condition", "seed", "score"]).to_csv(path, index=False)
    (reason,) = na.scaling_law(na.load(path)).analysis.fits.values()
    assert "no seed" in str(reason)


def test_arguments_of_other_types_are_refused_in_one_line(scores) -> None:
    for arguments in ({"condition": 0}, {"table": scores["right"]}):
        with pytest.raises(ValueError, match=f"{next(iter(arguments))} = .*allowed: ") as refusal:
            na.compare_table(**{"table": scores, **arguments})
        assert "\n" not in str(refusal.value)


def test_a_reference_that_a_group_lacks_is_refused_with_the_group(scores) -> None:
    lacks = scores[(scores["run"] > 3) | (scores["topology"] != "ring")]
    crossed = lacks.assign(half=np.where(lacks["run"] > 3, "late", "early"))
    roles = {"condition": ["topology", "half"], "score": "right", "seed": "run", "item": "question"}
    with pytest.raises(SpecError, match=r"reference = 'ring'.*early"):
        na.compare_table(crossed, by="topology", reference="ring", **roles)


def test_only_measures_of_the_table_are_proposed(scores) -> None:
    with pytest.raises(SpecError, match=r"known: right, tokens$"):
        na.compare_table(scores, score=["right", "tokens"], measure="token count", **ROLES)


def test_means_of_decimals_tie_as_exact_ones_do() -> None:
    # Means of 0.1 + 0.2 and of 0.3 + 0: equal numbers, floats that differ in the last bit.
    items = {"a": (0.1, 0.2), "b": (0.3, 0.0)}
    rows = [(c, s, k, v) for c, own in items.items() for s in range(4) for k, v in enumerate(own)]
    frame = pd.DataFrame(rows, columns=["condition", "seed", "item", "score"])
    (difference,) = na.compare_table(frame).differences
    assert difference.cliffs_delta == 0.0
    assert difference.improvement("higher").value == 0.5


def test_small_scores_are_shown_and_tiny_ones_refused(tmp_path: Path, capsys) -> None:
    path = tmp_path / "scores.csv"

    def compare(unit: float) -> int:
        rows = [f"{c},{s},{(s + 5 * k + 1) * unit!r}" for k, c in enumerate("ab") for s in range(8)]
        path.write_text("\n".join(["condition,seed,score", *rows]))
        return main(["compare", str(path)])

    assert compare(1e-5) == 0
    out = capsys.readouterr().out
    assert "4.5e-5 [" in out
    assert "b, +5.0e-5 [+5.0e-5, +5.0e-5]" in out
    assert compare(1e-9) == 2
    assert "measure = 'score': the largest value is 1.3e-08" in capsys.readouterr().err


def test_a_note_on_the_last_step_names_its_phase_if_there_are_several() -> None:
    rows = [
        (condition, seed, phase, step, step + seed)
        for condition in "ab"
        for seed in range(3)
        for phase, last in (("train", 3), ("test", 2))
        for step in range(last + 1)
    ]
    frame = pd.DataFrame(rows, columns=["condition", "seed", "phase", "step", "score"])
    notes = na.compare_table(frame, phase="test").notes
    assert any("test" in note and "step 2" in note for note in notes)
    assert any("train" in note and "step 3" in note for note in notes)
