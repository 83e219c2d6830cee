import numpy as np
import pytest

import nested_agents as na
from nested_agents.studies.cli.display import print_lines, print_table, show_results
from nested_agents.studies.presentation.tables import tabulate
from nested_agents.studies.results.analysis import Summary
from nested_agents.studies.results.statistics import Estimate

TITLES = ["success", "evaluation success", "final orientation error [rad]", "time in contact"]
LINES = [
    Summary(
        label,
        30,
        {t: Estimate(*map(np.asarray, (0.5, 0.25, 0.75))) for t in TITLES if t != missing},
    )
    for label, missing in (("default", ""), ("sampling (best response), robots=16", TITLES[1]))
]


@pytest.mark.parametrize("width", [40, 60, 80, 120])
def test_a_table_of_any_width_breaks_no_word(width, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", str(width))
    print_table(tabulate(LINES))
    *lines, _ = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= width
    words = " ".join(lines).split()
    for title in TITLES:
        assert set(title.split()) <= set(words)
    assert words.count(".25–.75") == 7


def test_columns_without_room_follow_below(monkeypatch, capsys):
    tables = {}
    for width in (40, 120):
        monkeypatch.setenv("COLUMNS", str(width))
        print_table(tabulate(LINES))
        tables[width] = capsys.readouterr().out
    assert tables[40].count("default") > tables[120].count("default") == 1
    assert tables[120].splitlines()[0].split() == " ".join(TITLES).split()


def test_lines_are_broken_on_a_terminal_only(monkeypatch, capsys):
    lines = ["short", "", "training success: 24 orders do not differ significantly"]
    monkeypatch.setenv("COLUMNS", "40")
    print_lines(lines)
    assert capsys.readouterr().out.splitlines() == lines
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    print_lines(lines)
    broken = ["training success: 24 orders do not", "  differ significantly"]
    assert capsys.readouterr().out.splitlines() == ["short", "", *broken]


def test_what_learns_nothing_is_named(tmp_path, capsys):
    """Carts never meet in two steps; of controls that is not said."""
    spec = {
        "seeds": 2, "episodes": 1, "steps": 2, "evaluation": 1, "scenario": {"kind": "line-up"},
        "sweep": {"preset": ["default", "frozen", "planner"]},
    }  # fmt: skip
    study = na.run(spec, tmp_path / "my study", jobs=1, progress=False)
    assert study.results.success("default", "evaluation").sum() == 0
    assert study.unlearned == ("default",)
    assert show_results(study, ["png"]) == 0
    out = capsys.readouterr().out
    assert "hint    default: no better than frozen weights" in out
    assert f"rows    nested-agents results '{tmp_path}/my study' --format csv" in out
    assert study.where("condition != 'frozen'").unlearned == ()
