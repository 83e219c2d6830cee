"""Results are read, watched and logged without running again: commands, with made-up results."""

import shutil
import sqlite3
from contextlib import closing

import made_up
import pytest
from made_up_commands import run_here
from rich.console import Console

from nested_agents.studies.cli.main import main
from nested_agents.studies.cli.watching import curve, frame
from nested_agents.studies.spec.toml import dumps

LOGGER = """
class Lines:
    def __init__(self, spec, directory):
        self.path = directory / "told.txt"

    def trial(self, trial, result):
        with open(self.path, "a") as file:
            file.write(f"{trial.condition} {trial.seed} {len(result.rows)}\\n")

    def close(self):
        with open(self.path, "a") as file:
            file.write("closed\\n")


class Raising(Lines):
    def trial(self, trial, result):
        raise OSError("the disk is full")


class Mute:
    def __init__(self, spec, directory):
        pass
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory):
    """A finished study, run with a logger, and what was said."""
    folder = tmp_path_factory.mktemp("loaded")
    (folder / "spec.toml").write_text(dumps(made_up.SPEC.table()))
    (folder / "log.py").write_text(LOGGER)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        said = run_here(
            made_up.failing, "run", "spec.toml", "--out", "out", "--jobs", 1,
            "--figures", "pdf", "--log", "log.py:Lines", "log.py:Raising",
        )  # fmt: skip
    return folder / "out", said


def said_by(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    status = main([str(argument) for argument in arguments])
    return status, *capsys.readouterr()


def test_figures_are_written_in_the_formats_asked_for(study) -> None:
    out, (_, printed, _) = study
    assert [path.suffix for path in (out / "figures").iterdir()] == [".pdf"]
    assert "learning-curves.pdf" in printed


def test_loggers_are_told_of_every_finished_trial_and_never_in_the_way(study) -> None:
    out, (status, _, errors) = study
    lines = (out / "told.txt").read_text().splitlines()
    assert len(lines) == 6  # one of six trials failed
    assert lines[-1] == "closed"
    assert lines[0].split()[2] == "6"
    assert status == 1
    assert errors.count("Raising is told no more: OSError: the disk is full") == 1


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("log.py:Mute", "has no trial, needs trial and close"),
        ("log.py:None_", "log.py has no 'None_'"),
        ("tensorbord", "known: none"),
    ],
)
def test_what_is_no_logger_is_refused(tmp_path, monkeypatch, name, complaint) -> None:
    (tmp_path / "log.py").write_text(LOGGER)
    (tmp_path / "spec.toml").write_text(dumps(made_up.SPEC.table()))
    monkeypatch.chdir(tmp_path)
    status, _, errors = run_here(
        made_up.measure, "run", "spec.toml", "--out", "out", "--jobs", 1, "--log", name
    )
    assert status == 2
    assert complaint in errors


def test_a_table_is_made_as_by_another_study_and_of_a_part(study, capsys) -> None:
    out, _ = study
    status, printed, _ = said_by(
        capsys, "table", out, "--as", "ablation", "--where", "seed in [0, 2]"
    )
    assert status == 0
    assert "2 seeds and 2 comparisons cannot give an adjusted p below .05" in " ".join(
        printed.split()
    )
    assert said_by(capsys, "table", out, "--as", "scaling")[0] == 2


def test_conditions_are_compared_in_every_form(study, capsys) -> None:
    out, _ = study
    status, printed, _ = said_by(capsys, "compare", out, "--measure", "steps")
    assert status == 0
    assert "steps, evaluation, less that of default:" in printed
    assert "unadjusted)" in printed
    assert max(map(len, printed.splitlines())) <= 80
    latex = said_by(capsys, "compare", out, "--format", "latex")[1]
    assert latex.startswith("% needs \\usepackage{booktabs}")
    assert said_by(capsys, "compare", out, "--format", "csv")[1].startswith("condition,seeds,")
    status, _, errors = said_by(capsys, "compare", out, out)
    assert (status, "is named more than once" in errors) == (2, True)


def test_status_tells_the_power_before_the_money_is_spent(study, capsys) -> None:
    printed = said_by(capsys, "status", study[0])[1]
    assert "power    3 seeds cannot give an adjusted p below .05" in printed


def test_watching_shows_trials_curves_and_failures(study, capsys, monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    status, printed, _ = said_by(capsys, "watch", study[0], "--once")
    assert status == 0
    assert said_by(capsys, "status", study[0])[1].startswith(printed.partition("left ")[0])
    assert "done     5 of 6 trials" in printed
    assert "failed: frozen, seed 1: RuntimeError: a wheel came off" in printed
    assert any(block in printed for block in "▁▂▃▄▅▆▇█")
    assert max(map(len, printed.splitlines())) <= 80
    assert said_by(capsys, "watch", study[0], "--every", "0")[0] == 2


@pytest.mark.parametrize("what", ["a row altered", "a row deleted", "a recording deleted"])
def test_watching_says_of_damage_what_status_says_and_draws_none(
    study, tmp_path, capsys, monkeypatch, what
) -> None:
    monkeypatch.setenv("COLUMNS", "400")
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
    (warning,) = [line for line in lines if "must run again" in line]
    status, printed, _ = said_by(capsys, "watch", out)
    assert status == 0
    assert warning in printed
    assert not any(block in printed for block in "▁▂▃▄▅▆▇█")
    assert not frame(out)[1]


def test_watching_ends_when_nothing_is_to_come(study) -> None:
    shown, is_going_on = frame(study[0])
    assert not is_going_on
    assert Console(width=60, record=True).render_lines(shown)
    assert curve([0.0] * 100) == "▁" * 24
