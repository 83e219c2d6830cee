"""Predictions of team sizes that were not run: written, kept from changes, and checked."""

import json

import made_up
import numpy as np
import pytest

import nested_agents as na
from nested_agents.studies.cli.main import main
from nested_agents.studies.scalability.prediction import PredictionFile, check, predict
from nested_agents.studies.workers.runner import save
from research import RESULTS


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    """Scores that grow as n to the power of 0.5: of small teams, as predicted, and otherwise."""
    rng = np.random.default_rng(0)
    folder = tmp_path_factory.mktemp("scores")
    for name, sizes, factor in [
        ("small", (2, 4, 8), 1.0), ("large", (16, 32), 1.0), ("other", (16, 32), 3.0)
    ]:  # fmt: skip
        lines = ["agents,seed,score"]
        for n in sizes:
            scores = factor * n**0.5 * np.exp(0.05 * rng.normal(size=12))
            lines += [f"{n},{seed},{score:.5f}" for seed, score in enumerate(scores)]
        (folder / f"{name}.csv").write_text("\n".join(lines))
    return folder


def load(path):
    return na.load(path, columns=["condition=agents"])


def predicted(tables, sizes=(16, 32)):
    results = load(tables / "small.csv").results
    return predict(results, {}, results.main.name, None, sizes)[0]


def test_predictions_hold_for_the_same_law_and_fail_for_another(tables):
    file = predicted(tables)
    assert [p.size for p in file.predictions] == [16.0, 32.0]
    assert file.predictions[0].low < 4.0 < file.predictions[0].high
    same = check(file, load(tables / "large.csv").results, {})
    assert all(own.holds(measured) for own, _, measured in same.checked)
    assert "2 of 2 predictions held" in same.notes[0]
    other = check(file, load(tables / "other.csv").results, {})
    assert not any(own.holds(measured) for own, _, measured in other.checked)
    assert "0 of 2 predictions held" in other.notes[0]
    assert "Not held: all teams, 16" in other.notes[1]


def test_a_changed_file_is_refused(tables, tmp_path):
    path = tmp_path / "prediction.json"
    predicted(tables).write(path)
    assert PredictionFile.read(path) == predicted(tables)._replace(sha256=predicted(tables).digest)
    content = json.loads(path.read_text())
    content["predictions"][0]["low"] = 0.0
    path.write_text(json.dumps(content))
    with pytest.raises(na.SpecError, match="was changed after it was written"):
        PredictionFile.read(path)


def test_another_spec_and_sizes_that_were_not_run_are_refused(tables):
    file = predicted(tables)._replace(spec={"seeds": 3, "scenario": {"box": "disc"}})
    large = load(tables / "large.csv").results
    with pytest.raises(na.SpecError, match=r"scenario\.box = square, but disc in the prediction"):
        check(file, large, {"seeds": 12, "scenario": {"box": "square"}})
    with pytest.raises(na.SpecError, match="none of the predicted sizes was measured"):
        check(predicted(tables), load(tables / "small.csv").results, {})
    with pytest.raises(na.SpecError, match="predict = 8: was run"):
        predicted(tables, (8,))


def test_a_measure_that_there_is_not_is_refused(tables):
    with pytest.raises(na.SpecError, match="scores"):
        predict(load(tables / "small.csv").results, {}, "scores", None, (16,))


def test_commands_predict_and_check(tables, tmp_path, capsys):
    path = tmp_path / "prediction.json"
    columns = ["--columns", "condition=agents"]
    small, large = str(tables / "small.csv"), str(tables / "large.csv")
    assert main(["scalability", small, *columns, "--predict", "16", "32", "--out", str(path)]) == 0
    assert "2 predictions, sha256" in " ".join(capsys.readouterr().out.split())
    assert main(["scalability", large, *columns, "--check", str(path), "--format", "json"]) == 0
    assert [own["held"] for own in json.loads(capsys.readouterr().out)["checked"]] == [True, True]
    assert main(["scalability", large, *columns, "--check", small]) == 2
    assert "is no prediction file" in capsys.readouterr().err
    assert main(["scalability", small, *columns, "--predict", "16"]) == 2
    assert "--predict: needs --out FILE.json" in capsys.readouterr().err


def test_options_that_a_mode_does_not_use_are_refused(tables, tmp_path, capsys):
    path = tmp_path / "prediction.json"
    predicted(tables).write(path)
    small, large = str(tables / "small.csv"), str(tables / "large.csv")
    columns = ["--columns", "condition=agents"]
    for option in (["--measure", "scores"], ["--budget", "nothing <= 3"], ["--out", "x.json"]):
        assert main(["scalability", large, *columns, "--check", str(path), *option]) == 2
        assert f"{option[0]}: is not used with --check" in capsys.readouterr().err
    predict = ["--predict", "16", "--out", str(tmp_path / "new.json")]
    for option in (["--budget", "nothing <= 3"], ["--format", "csv"]):
        assert main(["scalability", small, *columns, *predict, *option]) == 2
        assert f"{option[0]}: is not used with --predict" in capsys.readouterr().err
    assert main(["scalability", small, *columns, *predict, "--check", str(path)]) == 2
    assert main(["scalability", small, *columns, "--out", str(path)]) == 2
    assert "--out: is not used without --predict" in capsys.readouterr().err


def test_what_was_measured_has_the_interval_of_the_table(tmp_path):
    study = na.load(RESULTS / "scaling.json")
    path = tmp_path / "prediction.json"
    predicted = study.where("robots <= 8").predict_sizes([16], path)
    assert predicted.table.lines[0].condition == "all teams, 16: evaluation success"
    (own, *_) = study.check_prediction(path).checked
    shown = study.table().lines[-1].estimates["evaluation success"]
    assert tuple(own[2]) == tuple(shown)


def test_a_prediction_replaces_no_file(tables):
    small = tables / "small.csv"
    content = small.read_bytes()
    with pytest.raises(na.SpecError, match=r"small\.csv: exists"):
        load(small).predict_sizes([16], small)
    assert small.read_bytes() == content


def test_a_size_that_is_no_number_is_refused(tables, tmp_path):
    path, scores = tmp_path / "prediction.json", tmp_path / "scores.csv"
    load(tables / "small.csv").predict_sizes([16], path)
    scores.write_text("agents,seed,score\n16,0,4.0\n16,1,4.1\nmany,0,5.0\nmany,1,5.1\n")
    with pytest.raises(na.SpecError, match=r"agents = 'many' .*is no size"):
        load(scores).check_prediction(path)


def test_every_spec_of_several_studies_must_be_that_of_the_prediction(tmp_path):
    base = {"seeds": 4, "episodes": 3, "steps": 5, "evaluation": 2}
    for name, sizes, episodes in [("small", [2, 4, 8], 3), ("large", [16], 3), ("other", [32], 4)]:
        table = base | {"episodes": episodes, "sweep": {"scenario": {"robots": sizes}}}
        spec = made_up.Spec.of(table)
        with made_up.opened(tmp_path / name, spec) as store:
            for trial in made_up.trials_of(spec):
                save(store, trial, made_up.measure(trial), 1.0)
    path = tmp_path / "prediction.json"
    na.load(tmp_path / "small").predict_sizes([16, 32], path, "steps")
    na.load(tmp_path / "large").check_prediction(path)
    with pytest.raises(na.SpecError, match=r"episodes = 4, but 3"):
        na.load(tmp_path / "large", tmp_path / "other").check_prediction(path)
