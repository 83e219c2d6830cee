"""Results are read without running again: commands, with made-up results."""

import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import made_up
import pytest
from made_up_commands import Command, finish, run_here

from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.tables import dumps
from nested_agents.studies.store.store import Store


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory):
    """A finished study, and what was said."""
    folder = tmp_path_factory.mktemp("loaded")
    (folder / "spec.toml").write_text(dumps(made_up.SPEC.table()))
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        said = run_here(
            made_up.failing, "run", "spec.toml", "--out", "out", "--jobs", 1,
            "--figures", "pdf",
        )  # fmt: skip
    return folder / "out", said


def said_by(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    status = main([str(argument) for argument in arguments])
    return status, *capsys.readouterr()


def test_figures_are_written_in_the_formats_asked_for(study) -> None:
    out, (_, printed, _) = study
    assert [path.suffix for path in (out / "figures").iterdir()] == [".pdf"]
    assert "learning-curves.pdf" in printed


def test_a_table_is_made_as_by_another_study_and_of_a_part(study, capsys) -> None:
    out, _ = study
    status, printed, _ = said_by(
        capsys, "table", out, "--as", "ablation", "--where", "seed in [0, 2]"
    )
    assert status == 0
    assert "2 seeds cannot give a p below 0.05" in " ".join(printed.split())
    assert said_by(capsys, "table", out, "--as", "scaling")[0] == 2


def test_conditions_are_compared_in_every_form(study, capsys) -> None:
    out, _ = study
    status, printed, _ = said_by(capsys, "compare", out, "--measure", "steps")
    assert status == 0
    assert "evaluation steps to success, minus that of default:" in printed
    assert "unadjusted)" in printed
    assert max(map(len, printed.splitlines())) <= 80
    latex = said_by(capsys, "compare", out, "--format", "latex")[1]
    assert latex.startswith("% needs \\usepackage{booktabs}")
    assert said_by(capsys, "compare", out, "--format", "csv")[1].startswith("condition,seeds,")
    status, _, errors = said_by(capsys, "compare", out, out)
    assert (status, "is named more than once" in errors) == (2, True)


@pytest.mark.parametrize("by", [(), ("--by", "preset"), ("--by", "condition")])
def test_conditions_are_compared_by_what_they_are_called(study, by, capsys) -> None:
    status, printed, _ = said_by(capsys, "compare", study[0], *by)
    assert (status, printed) == said_by(capsys, "compare", study[0])[:2]


@pytest.mark.parametrize("what", ["a row altered", "a row deleted", "a recording deleted"])
def test_damage_is_shown_once(study, tmp_path, capsys, what) -> None:
    out = tmp_path / "out"
    shutil.copytree(study[0], out)
    if what == "a recording deleted":
        next((out / "recordings").glob("*.npz")).unlink()
    else:
        change = "DELETE FROM" if what == "a row deleted" else "UPDATE"
        change += " episodes" + " SET steps = steps + 1" * (change == "UPDATE")
        one = "identity = (SELECT min(identity) FROM episodes) AND phase = 'training'"
        with closing(sqlite3.connect(out / "results.sqlite")) as connection, connection:
            connection.execute(f"{change} WHERE {one} AND episode = 0")
    lines = said_by(capsys, "status", out)[1].splitlines()
    assert sum("must run again" in line for line in lines) == 1


READING = ["results", "table", "compare", "status", "export", "report"]


@pytest.mark.parametrize("command", READING)
def test_a_database_of_another_study_is_noted_by_all_that_read_it(
    study, command, tmp_path, capsys, monkeypatch
) -> None:
    monkeypatch.setenv("COLUMNS", "400")
    own = tmp_path / "own"
    shutil.copytree(study[0], own)
    said_by(capsys, command, own)
    assert "is not the spec" not in " ".join(said_by(capsys, command, own)[1:])
    text = (own / "study.toml").read_text()
    (own / "study.toml").write_text(text.replace("steps = 5", "steps = 6"))
    said = " ".join(" ".join(said_by(capsys, command, own)[1:]).split())
    assert (
        "study.toml: is not the spec of results.sqlite in its folder, which has the results" in said
    )
    assert "steps = 6 here, 5 there" in said


def test_what_is_none_in_one_of_two_specs_is_not_noted(study, capsys, monkeypatch) -> None:
    kept = Store.spec
    monkeypatch.setattr(Store, "spec", lambda store: {**kept(store), "evaluation_steps": None})
    assert "is not the spec" not in " ".join(said_by(capsys, "table", study[0])[1:])


def test_a_copy_of_the_spec_that_means_the_same_is_not_noted(study, tmp_path, capsys) -> None:
    own = tmp_path / "own"
    shutil.copytree(study[0], own)
    (own / "study.toml").write_text(
        "# by hand\nseeds = [0, 1, 2]\nepisodes = 4\nsteps = 5\nevaluation = 2\n"
        'sweep.preset = ["default", "frozen"]\n'
    )
    assert "is not the spec" not in " ".join(said_by(capsys, "status", own)[1:])
    (own / "study.toml").unlink()
    assert "is not the spec" not in " ".join(said_by(capsys, "status", own)[1:])


@pytest.mark.parametrize("command", ["table", "results", "compare"])
def test_a_terminal_that_writes_ascii_alone_is_enough(study, command) -> None:
    status, _, err = finish(Command("measure", command, study[0], encoding="ascii"))
    assert (status, err) == (0, "")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_what_a_terminal_cannot_write_has_a_sign_in_its_place(encoding) -> None:
    command = Command("measure", "topology", "show", "edges:a–b>c", encoding=encoding)
    status, out, err = finish(command)
    assert (status, err) == (0, "")
    assert ("1  a–b " if encoding == "utf-8" else "1  a?b ") in out


@pytest.mark.parametrize("command", ["table", "results", "status"])
def test_a_reader_that_goes_away_is_told_by_the_status(study, command) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    process = Command("measure", command, study[0], out=writing, buffered=False)
    os.close(writing)
    status, _, err = finish(process)
    assert (status, err) == (141, "")


@pytest.mark.parametrize("command", ["compare", "table", "status"])
def test_a_link_to_itself_is_one_line(command: str, tmp_path: Path, capsys) -> None:
    loop = tmp_path / "loop.csv"
    loop.symlink_to(loop)
    assert main([command, str(loop)]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert "loop.csv" in err
