"""Predictions of team sizes that were not run: written, kept from changes, and checked."""

import json

import numpy as np
import pytest

import nested_agents as na
from nested_agents.studies.cli.main import main
from nested_agents.studies.scalability.prediction import PredictionFile, check, predict


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
    assert all(own.has_held for own in same.checked)
    assert "2 of 2 predictions held" in same.sentences[0]
    other = check(file, load(tables / "other.csv").results, {})
    assert not any(own.has_held for own in other.checked)
    assert "Not held: all teams, 16" in other.sentences[1]


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
    assert "2 predictions, sha256" in capsys.readouterr().out
    assert main(["scalability", large, *columns, "--check", str(path), "--format", "json"]) == 0
    assert [own["held"] for own in json.loads(capsys.readouterr().out)["checked"]] == [True, True]
    assert main(["scalability", large, *columns, "--check", small]) == 2
    assert "is no prediction file" in capsys.readouterr().err
    assert main(["scalability", small, *columns, "--predict", "16"]) == 2
    assert "--predict: needs --out FILE.json" in capsys.readouterr().err
