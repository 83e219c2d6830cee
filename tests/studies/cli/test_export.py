import csv
import os
import re
from pathlib import Path

import made_up
import pandas as pd
import pytest

from nested_agents.studies.api.loading import load
from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers.runner import save

SPEC = Spec.of(
    made_up.SPEC.table()
    | {"seeds": 2, "sweep": {"preset": ["own-value", "frozen"], "scenario.action_repeat": [8, 4]}}
)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Seven trials that are done, one that failed."""
    directory = tmp_path_factory.mktemp("study") / "out"
    *done, last = trials_of(SPEC)
    with made_up.opened(directory, SPEC) as store:
        for trial in done:
            result = made_up.measure(trial)
            result.numbers["messages"] = trial.seed + 0.5
            save(store, trial, result, 2.5)
        store.fail(last, "Traceback\n  in measure\nRuntimeError: a wheel came off\n")
    return directory


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def test_csv_holds_every_episode_and_every_trial_with_every_swept_key(study, tmp_path, capsys):
    assert main(["export", str(study), "--out", str(tmp_path / "new" / "folder")]) == 0
    paths = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert [path.name for path in paths] == ["episodes.csv", "trials.csv", "study.json"]
    episodes, trials = map(read, paths[:2])
    assert len(episodes) == 7 * (4 + 2)
    assert list(episodes[0])[:6] == [
        "condition", "preset", "scenario.action_repeat", "seed", "phase", "episode",
    ]  # fmt: skip
    expected = {
        (t.condition, str(t.seed), row.phase, str(row.episode)): repr(row.return_)
        for t in trials_of(SPEC)[:-1]
        for row in made_up.measure(t).rows
    }
    keys = ("condition", "seed", "phase", "episode")
    assert {tuple(row[k] for k in keys): row["return"] for row in episodes} == expected
    assert len(trials) == 8
    (failed,) = [row for row in trials if row["state"] == "failed"]
    assert failed["error"] == "RuntimeError: a wheel came off"
    assert (failed["seconds.total"], failed["messages"]) == ("", "")
    assert {row["seconds.total"] for row in trials if row is not failed} == {"2.5"}
    assert trials[0]["messages"] == "0.5"
    assert len({row["identity"] for row in trials}) == 8


def test_the_second_time_only_on_request(study, tmp_path, capsys):
    line = ["export", str(study), "--out", str(tmp_path)]
    assert main(line) == 0
    before = (tmp_path / "episodes.csv").read_bytes()
    (tmp_path / "episodes.csv").write_text("mine")
    capsys.readouterr()
    assert main(line) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert f"{tmp_path / 'episodes.csv'}: exists; --overwrite replaces it" in err
    assert (tmp_path / "episodes.csv").read_text() == "mine"
    assert main([*line, "--overwrite"]) == 0
    assert (tmp_path / "episodes.csv").read_bytes() == before


def test_what_a_kill_between_two_files_left_is_finished(study, tmp_path, capsys):
    line = ["export", str(study), "--out", str(tmp_path)]
    assert main(line) == 0
    whole = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert main(line) == 2  # all of it is there
    for left in whole:
        left.unlink()
        assert main(line) == 0
        assert {path: path.read_bytes() for path in tmp_path.iterdir()} == whole
    (tmp_path / "trials.csv").unlink()
    (tmp_path / "episodes.csv").write_text("mine")
    assert main(line) == 2


def test_an_error_leaves_what_was_there(study, tmp_path, monkeypatch):
    line = ["export", str(study), "--out", str(tmp_path), "--overwrite"]
    assert main(line) == 0
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    assert main(line) == 2
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_file_in_the_way_of_the_folder_is_one_line(study, tmp_path, capsys):
    (tmp_path / "file").touch()
    assert main(["export", str(study), "--out", str(tmp_path / "file")]) == 2
    assert f"--out {tmp_path / 'file'}: " in capsys.readouterr().err


def test_json_gives_the_table_that_the_study_gives(study, tmp_path, capsys):
    columns = ["--columns", "evaluation success", "training time in contact"]
    assert main(["table", str(study), "--format", "markdown", *columns]) == 0
    of_study = capsys.readouterr().out
    assert of_study.startswith(
        "| condition | seeds | evaluation success | training time in contact |\n| --- |"
    )
    assert main(["export", str(study), "--out", str(tmp_path), "--format", "json"]) == 0
    path = Path(capsys.readouterr().out.strip())
    assert path == tmp_path / "results.json"
    assert main(["table", str(path), "--format", "markdown", *columns]) == 0
    assert_alike(capsys.readouterr().out, of_study)
    assert main(["table", str(study)]) == 0
    of_study = capsys.readouterr().out
    assert main(["table", str(path)]) == 0
    assert_alike(capsys.readouterr().out, of_study)


def assert_alike(one, other):
    """Hold texts equal but for the last digit of numbers, some of which are rounded twice."""
    number = re.compile(r"\d*\.\d+|\d+")
    assert number.sub("", one) == number.sub("", other)
    found, expected = ([float(n) for n in number.findall(text)] for text in (one, other))
    assert found == pytest.approx(expected, abs=0.0101)


@pytest.mark.parametrize("form", ["table", "latex", "csv"])
def test_a_table_in_every_form(study, form, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["table", str(study), "--format", form]) == 0
    out = capsys.readouterr().out
    assert "success" in out
    assert "frozen" in out
    if form == "table":
        assert max(map(len, out.splitlines())) <= 80


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ["{study}", "--columns", "succes"],
            "columns: the table has no 'succes'; it has 'training success', ",
        ),
        (["{study}/nothing"], "nothing: holds no study"),
        (["{study}/study.toml"], "study.toml: holds no published results"),
    ],
)
def test_what_has_no_table_is_refused(study, arguments, said, capsys):
    assert main(["table", *(a.format(study=study) for a in arguments)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line


def test_a_folder_of_exported_files_is_refused_with_what_to_name(study, tmp_path, capsys):
    for folder in (study / "export", tmp_path):
        assert main(["export", str(study), "--out", str(folder)]) == 0
        capsys.readouterr()
        assert main(["table", str(folder)]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert str(folder / "episodes.csv") in line
        assert (f"; {study} holds one" in line) == (folder != tmp_path)


def test_parquet_holds_the_same_with_types(study, tmp_path, capsys):
    pytest.importorskip("pyarrow", reason="extra [parquet]")
    assert main(["export", str(study), "--format", "parquet", "--out", str(tmp_path)]) == 0
    names = [Path(line).name for line in capsys.readouterr().out.splitlines()]
    assert names == ["episodes.parquet", "trials.parquet", "study.json"]
    episodes = pd.read_parquet(tmp_path / "episodes.parquet")
    expected = load(study).episodes
    assert episodes["success"].dtype == bool
    pd.testing.assert_frame_equal(episodes, expected, check_dtype=False)
    assert len(pd.read_parquet(tmp_path / "trials.parquet")) == 8


def test_parquet_without_its_package_is_one_line(study, tmp_path, monkeypatch, capsys):
    def refuse(*_, **__):
        raise ImportError("Unable to find a usable engine")

    monkeypatch.setattr(pd.DataFrame, "to_parquet", refuse)
    assert main(["export", str(study), "--format", "parquet", "--out", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert "pyarrow is not installed; pip install" in error
    assert error.count("\n") == 1
