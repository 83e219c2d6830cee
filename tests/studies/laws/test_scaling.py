"""Laws of growth of published studies, by Python and by the command."""

import json
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import nested_agents as na
from nested_agents.core.interface.measures import SUCCESS
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.laws.scaling import decisions_to_criterion, scaling_law
from nested_agents.studies.results.results import from_arrays
from research import RESULTS

SIZES = (2, 4, 8)
ALWAYS = {"chain": -1.0}
"""Teams that succeed from the first episode on."""


def made_up(rates, seeds=6, episodes=12, sizes=SIZES):
    """Return results of two topologies whose teams learn after as many episodes as `rates` say."""
    training, columns = {}, {}
    for topology, factor in rates.items():
        for n in sizes:
            label = f"{topology}, robots={n}"
            columns[label] = {"topology": topology, "scenario.robots": n}
            begins = [min(episodes, round(factor * n**0.5) + seed % 2) for seed in range(seeds)]
            success = np.array([np.arange(episodes) >= begin for begin in begins])
            training[label] = {"success": success, "steps": np.full((seeds, episodes), 10 * n)}
    of_seeds = {c: range(seeds) for c in columns}
    return from_arrays({"training": training}, of_seeds, {}, {}, columns, (SUCCESS,))


def test_decisions_to_a_criterion_are_counted_and_fitted() -> None:
    law = scaling_law(made_up({"chain": 1.0, "star": 2.0}), "success", criterion=1.0)
    assert law.title == "decisions to 1 of success"
    assert [*law.fits] == ["chain", "star"]
    chain = law.fits["chain"]
    assert chain is not None
    # Seeds 0 and 1 of two robots begin after 1 and 2 episodes; five more are looked at.
    assert np.exp(chain.sample.values[:2, 0]) == pytest.approx([20 * 6, 20 * 7])
    assert any(
        line.startswith("Exponents of power laws, minus that of chain") for line in law.notes
    )


def test_runs_that_never_reach_it_are_censored() -> None:
    law = scaling_law(made_up({"chain": 3.0}), "success", criterion=1.0)
    assert 0 < law.fits["chain"].sample.censored.sum() < 18
    assert "runs censored" in " ".join(law.notes)
    never = scaling_law(made_up({"chain": 30.0}), "success", criterion=1.0)
    assert not never.table
    assert "no law: no run reached the criterion: all are censored" in " ".join(never.notes)


def test_runs_of_fewer_episodes_are_censored_where_they_end() -> None:
    """Teams that train for a number of decisions differ in episodes; none may be left out."""
    whole = made_up({"chain": 3.0})
    rows = whole.episodes
    shorter = (
        (rows["seed"] == 1) & (rows["condition"] == "chain, robots=8") & (rows["episode"] >= 10)
    )
    ragged = replace(whole, episodes=rows[~shorter])
    law, expected = (
        scaling_law(results, "success", criterion=1.0).fits["chain"] for results in (ragged, whole)
    )
    assert law.left_out == 0
    assert law.sample.censored.tolist() == expected.sample.censored.tolist()
    assert law.sample.censored[1, 2]
    assert np.exp(law.sample.values[1, 2]) == pytest.approx(10 * 80)


def test_decisions_of_a_curriculum_count(tmp_path) -> None:
    stage = {"name": "one", "episodes": 3, "scenario": {"carts": 1}}
    spec = CARTS | {"preset": "own-value", "learner": {"weights": "role"}, "curriculum": [stage]}
    results = na.run(spec, tmp_path / "out", jobs=1, progress=False).results
    for condition, (decisions, _) in decisions_to_criterion(results, "success", 1.0).items():
        stages = (results.values(condition, "steps", p) for p in ("training:one", "training"))
        assert decisions.tolist() == sum(own.sum(axis=1) for own in stages).tolist()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"size": "boxes"}, "size = 'boxes'"),
        ({"criterion": 2.0}, "criterion = 2.0: must be above 0 and at most 1"),
        ({"measure": "speed"}, "measure = 'speed'"),
        ({"measure": "steps", "criterion": 0.5}, "a rate has a criterion"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(options, said) -> None:
    with pytest.raises(SpecError, match=said) as caught:
        scaling_law(made_up({"chain": 1.0}), **{"measure": "success", **options})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("size", [0, 0.5, -1, float("nan"), float("inf")])
def test_a_size_below_one_is_refused_and_named(size) -> None:
    results = made_up({"chain": 1.0})
    columns = {**results.columns, "chain, robots=2": {"topology": "chain", "scenario.robots": size}}
    results = replace(results, columns=columns)
    with pytest.raises(
        SpecError, match=rf"robots = {size:g} \(condition .*allowed are sizes from 1"
    ):
        scaling_law(results, "steps")


@pytest.mark.parametrize("size", [0, -3, 10**12])
def test_a_predicted_size_out_of_range_is_refused(size) -> None:
    with pytest.raises(SpecError, match=re.escape(f"predict = {size:g}: allowed are sizes from 1")):
        scaling_law(made_up({"chain": 1.0}), "steps", predict=[size])


def test_a_truth_value_is_no_size() -> None:
    with pytest.raises(SpecError, match="predict = True: allowed are sizes from 1"):
        scaling_law(made_up({"chain": 1.0}), "steps", predict=[True])


def test_a_law_beyond_the_range_of_a_measure_is_explained() -> None:
    law = scaling_law(made_up(ALWAYS), "steps", predict=[4, 10**6])
    assert float(law.table[0].estimates["at 4 (90%)"].value) == pytest.approx(40.0)
    assert "outside the range" not in " ".join(law.notes)
    share = replace(SUCCESS, name="share", is_rate=False, least=0.0, greatest=1.0)
    results = made_up({"chain": 1.0})
    lengths = results.episodes["condition"].str.extract(r"robots=(\d)")[0].astype(float)
    results = replace(
        results,
        episodes=results.episodes.assign(share=lengths / 10.0),
        measures=(*results.measures, share),
    )
    law = scaling_law(results, "share", predict=[4, 100])
    text = " ".join(" ".join(law.notes).split())
    assert "chain: at 100 the law gives 10, outside the range" in text
    assert "so that 1 is predicted" in text
    assert "at 4 the law" not in text


@pytest.mark.filterwarnings("error")
def test_rates_are_those_of_the_table() -> None:
    """Of sizes 2, 4, 8 with one, two and three failures in twelve episodes a run."""
    results = made_up({"chain": 0.9})
    law = scaling_law(results, "success", predict=[1, 16])
    fitted = law.fits["chain"]
    assert fitted is not None
    expected = [results.values(c, "success").mean() for c in results.columns]
    assert fitted.sample.means.tolist() == pytest.approx(expected)
    assert fitted.held_out == () or fitted.held_out[-1][1] == pytest.approx(expected[-1])
    for title in ("at 1 (90%)", "at 16 (90%)"):
        e = law.table[0].estimates[title]
        assert 0.0 <= e.low <= e.value <= e.high <= 1.0


def test_two_sizes_or_one_seed_give_no_number() -> None:
    two = scaling_law(made_up({"chain": 1.0}, sizes=(2, 4)), "success", criterion=1.0)
    assert not two.table
    assert "2 sizes and 6 seeds" in " ".join(two.notes)
    one = scaling_law(made_up({"chain": 1.0}, seeds=1), "success", criterion=1.0)
    assert "3 sizes and 1 seed" in " ".join(one.notes)


def test_equal_values_are_no_law() -> None:
    never = scaling_law(made_up({"chain": 30.0}), "success")
    assert not never.table
    assert "no law: every run has 0" in " ".join(never.notes)


def test_seeds_that_agree_do_not_make_a_law_certain() -> None:
    exact = made_up(ALWAYS)
    no_law = replace(exact, episodes=exact.episodes.replace({"steps": {40: 70}}))
    for results, said in (
        (exact, "the law passes through all values"),
        (no_law, "so that intervals of parameters do not show how well it fits"),
    ):
        law = scaling_law(results, "steps")
        assert f"all seeds agree, {'and ' * (results is exact)}{said}" in " ".join(
            " ".join(law.notes).split()
        )


CARTS = {
    "preset": "random", "seeds": 3, "episodes": 2, "steps": 4, "evaluation": 1,
    "scenario": {"kind": "line-up"}, "sweep": {"scenario.carts": [1, 2, 3]},
}  # fmt: skip
LATER = {k: v for k, v in CARTS.items() if k != "sweep"} | {
    "scenario": {"kind": "line-up", "carts": 4}
}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Folders of a study of three sizes, of a later size, and of two that differ in more."""
    root = tmp_path_factory.mktemp("joined")
    specs = {
        "three": CARTS, "later": LATER, "longer": {**LATER, "steps": 5},
        "again": {**LATER, "scenario": {"kind": "line-up", "carts": 3}},
    }  # fmt: skip
    for name, spec in specs.items():
        na.run(spec, root / name, jobs=1, progress=False)
    return root


def test_a_later_folder_joins_a_fit(folders, capsys) -> None:
    places = [str(folders / name) for name in ("three", "later")]
    assert main(["fit", *places, "--measure", "final_distance_m"]) == 0
    assert "4 sizes from 1 to 4 carts" in " ".join(capsys.readouterr().out.split())
    study = na.load(*places)
    growth = na.scaling_law(study, "final_distance_m")
    (fitted,) = growth.analysis.laws.values()
    assert fitted.sample.sizes.tolist() == [1.0, 2.0, 3.0, 4.0]
    values = study.episodes[study.episodes["phase"] == "evaluation"]
    means = values.groupby("condition", sort=False)["final_distance_m"].mean().tolist()
    assert fitted.sample.means.tolist() == pytest.approx(means)
    named = na.scaling_law(na.load(*reversed(places)), "final_distance_m", size="carts")
    assert next(iter(named.analysis.laws.values())).sample.sizes.tolist() == [1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize(
    ("others", "said"),
    [
        (("longer",), r"longer: steps = 5, but 4 in three: .*equal except for the size"),
        (("again",), r"has the same settings as .*carts = 3"),
        (("later", "longer"), r"longer: steps = 5, but 4 in three"),
    ],
)
def test_folders_that_differ_in_more_than_the_size_are_refused(folders, others, said) -> None:
    study = na.load(*(folders / name for name in ("three", *others)))
    with pytest.raises(SpecError, match=said) as caught:
        na.scaling_law(study, "final_distance_m")
    assert "\n" not in str(caught.value)


def test_a_search_method_that_changes_is_remarked(tmp_path) -> None:
    spec = {**CARTS, "preset": "default", "sweep": {"scenario.carts": [1, 2, 7]}}
    growth = na.scaling_law(
        na.run(spec, tmp_path / "a", jobs=1, progress=False), "final_distance_m"
    )
    (remark,) = growth.analysis.remarks
    assert "exact from 1 carts, best-response from 7 carts" in remark
    few = {**spec, "sweep": {"scenario.carts": [1, 2, 3]}}
    study = na.run(few, tmp_path / "b", jobs=1, progress=False)
    assert na.scaling_law(study, predict=[4]).analysis.remarks == ()
    remarks = na.scaling_law(study, predict=[12]).analysis.remarks
    predicted = study.predict_sizes([12, 10**6], tmp_path / "p.json", "final_distance_m")
    for lines in (remarks, predicted.notes):
        said = " ".join(" ".join(lines).split())
        assert "exact from 1 carts, best-response from 12 carts" in said


def test_a_prediction_beyond_the_budget_is_remarked(tmp_path) -> None:
    budget = {"decision": {"budget": 40}}
    spec = {**CARTS, "preset": "default", "learner": budget, "sweep": {"scenario.carts": [1, 2, 3]}}
    study = na.run(spec, tmp_path / "a", jobs=1, progress=False)
    said = " ".join(na.scaling_law(study, predict=[4, 64]).analysis.remarks)
    assert "64 carts cannot run" in said
    assert "learner.decision.budget = 40" in said
    assert "4 carts cannot run" not in said.replace("64 carts", "")


def table(path, sizes, of, seeds=4):
    """Write a table of scores whose means are those of a law; deviations of seeds sum to zero."""
    deviations = [0.9, 0.95, 1.05, 1.1]
    rows = [f"{n},{seed},{of(n) * deviations[seed]}" for n in sizes for seed in range(seeds)]
    path.write_text("\n".join(["agents,seed,score", *rows]) + "\n")
    return str(path)


def test_a_table_of_scores_is_fitted(tmp_path, capsys) -> None:
    path = table(tmp_path / "scores.csv", (1, 2, 4, 8), lambda n: 3.0 * n**1.5)
    assert main(["fit", path, "--columns", "condition=agents", "--predict", "16"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "power law, mean = 3 n^1.5 (4 seeds, 4 sizes from 1 to 8 agents)" in out
    assert "192 [" in out
    short = tmp_path / "short.csv"
    short.write_text("\n".join((tmp_path / "scores.csv").read_text().splitlines()[:-1]))
    assert main(["fit", str(short), "--columns", "condition=agents"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "(3 seeds, 4 sizes from 1 to 8 agents; 3 runs left out" in out
    labeled = tmp_path / "labels.csv"
    labeled.write_text((tmp_path / "scores.csv").read_text().replace("agents", "condition"))
    assert main(["fit", str(labeled)]) == 0
    assert "mean = 3 n^1.5 (4 seeds" in " ".join(capsys.readouterr().out.split())


def test_tables_of_other_sizes_are_joined(tmp_path, capsys) -> None:
    small = table(tmp_path / "small.csv", (1, 2), lambda n: 3.0 * n**1.5)
    large = table(tmp_path / "large.csv", (4, 8), lambda n: 3.0 * n**1.5)
    assert main(["fit", small, large, "--columns", "condition=agents"]) == 0
    assert "mean = 3 n^1.5 (4 seeds, 4 sizes" in " ".join(capsys.readouterr().out.split())


def test_a_table_with_a_size_below_one_is_refused(tmp_path, capsys) -> None:
    path = table(tmp_path / "scores.csv", (0.5, 2, 4), lambda n: 3.0 * n**1.5)
    assert main(["fit", path, "--columns", "condition=agents"]) == 2
    error = capsys.readouterr().err
    assert "agents = 0.5" in error
    assert error.count("\n") == 1


def test_the_published_study_of_scaling_by_command_and_in_python(capsys, tmp_path) -> None:
    file = RESULTS / "scaling.json"
    figure = tmp_path / "law.svg"
    command = ["fit", str(file), "--criterion", "0.8", "--predict", "32", "--plot", str(figure)]
    assert main(command) == 0
    out = capsys.readouterr().out
    assert out.startswith("decisions to 0.80 of success")
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "<svg" in figure.read_text()
    growth = na.scaling_law(na.load(file), criterion=0.8, predict=[32])
    assert growth.table.titles == ("exponent", "at 32 (90%)")
    assert str(growth.table).splitlines()[1].split()[1] in out
    assert main([*command[:2], "--format", "csv"]) == 0
    assert capsys.readouterr().out.startswith("condition,")


def growing_scores() -> pd.DataFrame:
    """Return scores of eight runs of five sizes that grow as ``3 n^1.5``, with 10% noise."""
    rng = np.random.default_rng(0)
    rows = [
        (n, seed, 3.0 * n**1.5 * (1.0 + 0.1 * rng.normal()))
        for n in (1, 2, 4, 8, 16)
        for seed in range(8)
    ]
    return pd.DataFrame(rows, columns=["robots", "seed", "score"])


@pytest.mark.parametrize("name", ["scores.csv", "scores.jsonl", "scores.parquet", "runs.json"])
def test_tables_of_scores_are_fitted_as_compare_reads_them(name, tmp_path, capsys) -> None:
    scores = growing_scores()
    path = tmp_path / name
    columns = ["--columns", "condition=robots"]
    if name == "scores.csv":
        scores.to_csv(path, index=False)
    elif name == "scores.jsonl":
        scores.to_json(path, orient="records", lines=True, double_precision=15)
    elif name == "scores.parquet":
        pytest.importorskip("pyarrow", reason="pip install pyarrow")
        scores.to_parquet(path)
    else:  # the form of marl-eval, whose algorithms are sizes
        runs = {
            str(n): {
                f"seed_{seed}": {"absolute_metrics": {"score": [own]}}
                for seed, own in zip(rows["seed"], rows["score"], strict=True)
            }
            for n, rows in scores.groupby("robots")
        }
        path.write_text(json.dumps({"env": {"task": runs}}))
        columns = []
    assert main(["fit", str(path), *columns, "--measure", "score", "--format", "json"]) == 0
    (line,) = json.loads(capsys.readouterr().out)
    slopes = [
        np.polyfit(np.log(own["robots"]), np.log(own["score"]), 1)[0]
        for _, own in scores.groupby("seed")
    ]
    assert line["estimates"]["exponent"]["value"] == pytest.approx(np.mean(slopes), abs=0.02)


def test_negative_scores_have_no_law_and_the_reason_says_what_can_be_done(tmp_path, capsys) -> None:
    path = tmp_path / "scores.csv"
    scores = growing_scores()
    scores.assign(score=-scores["score"]).to_csv(path, index=False)
    assert main(["fit", str(path), "--columns", "condition=robots"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "no law: the mean at size 16 is -197" in said
    assert "allowed: positive means" in said
    assert "fit another measure" in said
