import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import nested_agents as na
from nested_agents.studies.cli import display
from nested_agents.studies.cli.display import print_lines, print_table, show_results
from nested_agents.studies.cli.main import main
from nested_agents.studies.presentation.tables import tabulate
from nested_agents.studies.results.analysis import Summary
from nested_agents.studies.results.statistics import Estimate

TITLES = ["success", "evaluation success", "final orientation error [deg]", "time in contact"]
LINES = [
    Summary(
        label,
        30,
        {t: Estimate(*map(np.asarray, (0.5, 0.25, 0.75))) for t in TITLES if t != missing},
    )
    for label, missing in (("default", ""), ("sampling (best response), robots=16", TITLES[1]))
]


@pytest.mark.parametrize("width", [60, 80, 120])
def test_a_table_of_any_width_breaks_no_word(width, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", str(width))
    print_table(tabulate(LINES))
    table, _ = capsys.readouterr().out.split("\nMeans over 30 seeds")
    lines = table.splitlines()
    assert max(map(len, lines)) <= width
    words = " ".join(lines)
    for title in TITLES:
        assert all(word in words.split() for word in title.split())
    assert words.count("0.50 [0.25, 0.75]") == 7


def test_columns_without_room_follow_below(monkeypatch, capsys):
    tables = {}
    for width in (40, 120):
        monkeypatch.setenv("COLUMNS", str(width))
        print_table(tabulate(LINES))
        tables[width] = capsys.readouterr().out
    assert tables[40].count("default") > tables[120].count("default") == 1
    titles = tables[120].partition("default")[0].split()
    assert sorted(titles) == sorted(" ".join(TITLES).split())


def test_lines_are_broken_on_a_terminal_only(monkeypatch, capsys):
    lines = ["short", "", "training success: 24 orders do not differ significantly"]
    monkeypatch.setenv("COLUMNS", "40")
    print_lines(lines)
    assert capsys.readouterr().out.splitlines() == lines
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    print_lines(lines)
    broken = ["training success: 24 orders do not", "  differ significantly"]
    assert capsys.readouterr().out.splitlines() == ["short", "", *broken]
    print_lines(["time with n agents of default:\n  deciding n^1.15 [0.90, 1.40]"])  # a note
    assert capsys.readouterr().out.splitlines()[1] == "  deciding n^1.15 [0.90, 1.40]"


def test_results_are_shown_with_the_commands_that_follow(tmp_path, capsys):
    spec = {
        "seeds": 2, "episodes": 1, "steps": 2, "evaluation": 1, "scenario": {"kind": "line-up"},
        "sweep": {"preset": ["default", "frozen", "planner"]},
    }  # fmt: skip
    study = na.run(spec, tmp_path / "my study", jobs=1, progress=False)
    assert show_results(study, ["png"]) == 0
    out = capsys.readouterr().out
    assert f"rows    nested-agents results '{tmp_path}/my study' --format csv" in out


ORDERS = "\x1b]0;owned\x07\x1b[31m[red]x\u202e\x9b31m"
"""A label that would name the window, color the text and reverse it."""
WRITTEN = r"\x1b]0;owned\x07\x1b[31m[red]x\u202e\x9b31m"
PUBLISHED = Path(na.__file__).parents[1] / "research/results/from-eight-128.json"


@pytest.fixture
def foreign(tmp_path):
    """A published file of somebody else's, and one of its labels is full of orders."""
    content = json.loads(PUBLISHED.read_text(encoding="utf-8").replace('"default"', '"LABEL"'))
    path = tmp_path / "foreign.json"
    path.write_text(json.dumps(content).replace("LABEL", json.dumps(ORDERS)[1:-1]))
    return path


@pytest.mark.parametrize("form", ["table", "markdown", "csv", "latex"])
@pytest.mark.parametrize("command", ["table", "compare"])
def test_no_label_orders_a_terminal(command, form, foreign, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("TERM", "dumb")
    assert main([command, str(foreign), "--format", form]) == 0
    out, err = capsys.readouterr()
    assert not set(out + err) & set("\x1b\x07\u202e\x9b")
    if form == "markdown":
        out = out.replace("\\\\", "\\")  # where a backslash is escaped
    assert form == "latex" or WRITTEN[:20] in out  # the rest is in the next line


def test_what_is_written_to_a_file_is_as_it_was(foreign, capsys):
    assert main(["table", str(foreign), "--format", "csv"]) == 0
    assert ORDERS in capsys.readouterr().out


@pytest.mark.parametrize("arguments", [["--reference", "nope"], ["--where", "seed < 0"]])
def test_no_error_orders_a_terminal(foreign, arguments, capsys):
    named = foreign.rename(foreign.with_name("\x1b[31mred.json"))
    assert main(["compare", str(named), *arguments]) == 2
    assert main(["compare", str(named.with_name("\x1b[31mno.json"))]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert not set(err) & set("\x1b\x07\u202e\x9b")
    assert err.count("\n") == 2


def test_commands_print_through_one_door():
    """Nothing in the folder calls print but a function of display, and main for its errors."""
    calls = {}
    for path in sorted(Path(display.__file__).parent.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        names = [n.func.id for n in ast.walk(tree) if isinstance(n, ast.Call)
                 and isinstance(n.func, ast.Name) and n.func.id == "print"]  # fmt: skip
        if names:
            calls[path.name] = len(names)
    assert calls == {"display.py": 1, "main.py": 2}


@pytest.mark.parametrize("command", [["table"], ["compare"], ["table", "--format", "markdown"]])
def test_a_terminal_of_ascii_has_signs_in_place_of_what_it_lacks(command):
    """The locale POSIX gives Python streams that raise for a dash."""
    plain = {"LC_ALL": "POSIX", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "COLUMNS": "400"}
    line = [sys.executable, "-m", "nested_agents", command[0], str(PUBLISHED), *command[1:]]
    done = subprocess.run(line, capture_output=True, check=False, env={**os.environ, **plain})
    assert done.returncode == 0
    assert done.stderr.isascii()
    assert done.stdout.isascii()
