import csv
import io
import json
import re

import numpy as np
import pandas as pd

from nested_agents.core.interface.measures import SUCCESS, Measure
from nested_agents.studies.presentation.tables import tabulate, write_rows
from nested_agents.studies.results.analysis import Summary
from nested_agents.studies.results.statistics import Estimate, bootstrap, exactly


def estimate(*numbers: float) -> Estimate:
    return Estimate(*map(np.asarray, numbers))


LINES = [
    Summary(
        "order=1, 50%", 8, {"success": estimate(1 / 3, 0.2, 0.5), "x_1 [m]": estimate(2, 1, 3)}
    ),
    Summary("[a & b]", 1, {"success": estimate(0.0, np.nan, np.nan)}),
]


def test_csv_holds_every_digit_and_nothing_where_nothing_is_known():
    rows = list(csv.DictReader(io.StringIO(tabulate(LINES).csv)))
    assert [row["condition"] for row in rows] == ["order=1, 50%", "[a & b]"]
    assert float(rows[0]["success"]) == 1 / 3
    assert (rows[0]["success low"], rows[0]["x_1 [m] high"]) == ("0.2", "3.0")
    assert (rows[1]["success low"], rows[1]["x_1 [m]"]) == ("", "")


def test_json_holds_every_digit_and_null_where_nothing_is_known():
    first, other = json.loads(tabulate(LINES).json)
    assert (first["condition"], first["seeds"]) == ("order=1, 50%", 8)
    assert first["estimates"]["success"] == {"value": 1 / 3, "low": 0.2, "high": 0.5}
    assert other["estimates"] == {"success": {"value": 0.0, "low": None, "high": None}}


def test_latex_escapes_and_has_as_many_cells_in_every_row():
    lines = tabulate(LINES).latex.splitlines()
    assert lines[1] == r"\begin{tabular}{lrrr}"
    rows = [line for line in lines if line.endswith(r"\\")]
    assert [row.replace(r"\&", "").count("&") for row in rows] == [3, 3, 3]
    assert rows[0] == r"condition & seeds & success & x\_1 [m] \\"
    assert rows[1] == r"order=1, 50\% & 8 & $0.33\;[0.20, 0.50]$ & $2\;[1, 3]$ \\"
    # A bracket after the end of a line would be an option of that end.
    assert rows[2] == r"{}[a \& b] & 1 & $0$ & -- \\"


def test_markdown_has_chosen_columns_and_keeps_bars_out_of_cells():
    lines = [*LINES, Summary("a|b", 2, {})]
    assert tabulate(lines, ["success"]).markdown.splitlines() == [
        "| condition | seeds | success |",
        "| --- | --- | --- |",
        "| order=1, 50% | 8 | 0.33 [0.20, 0.50] |",
        "| [a & b] | 1 | 0 |",
        r"| a\|b | 2 |  |",
    ]


HOSTILE = [
    "a\nb", "a\r\n\r\nb", "\x1b[31mred", "nul\0", r"bar|\|", "<script>x</script>", "$x$ & _u_",
    r"\end{tabular}", "*star*", "[x](javascript:y)", "&lt;",
]  # fmt: skip


def test_no_label_breaks_a_row_or_is_markup():
    lines = [Summary(label, 2, {label: estimate(1, 0, 2)}) for label in HOSTILE]
    table = tabulate(lines)
    rows = table.markdown.splitlines()
    assert len(rows) == 2 + len(HOSTILE)
    for row in rows[:1] + rows[2:]:
        plain = re.sub(r"\\[\W_]", "", row)
        assert plain.count("|") == len(HOSTILE) + 3
        assert not re.search(r"[<*$`\x00\x1b]|\]\(|&lt|\b_u", plain)
    source = table.latex
    assert source.isprintable() or set("".join(source.split("\n"))) <= {*map(chr, range(32, 127))}
    rows = [line for line in source.splitlines() if line.endswith(r"\\")]
    assert len(rows) == 1 + len(HOSTILE)
    for row in rows:
        assert row.replace(r"\&", "").count("&") == len(HOSTILE) + 1
        assert not re.search(r"(?<!\$)[<>|](?!\$)|end\{", row)


def test_a_heading_needs_no_unit():
    assert tabulate(LINES, ["x_1", "success"]).titles == ("x_1 [m]", "success")


def test_cells_are_as_in_the_terminal():
    table = tabulate(LINES)
    assert table.titles == ("success", "x_1 [m]")
    assert table.cells.values.tolist() == [["0.33 [0.20, 0.50]", "2 [1, 3]"], ["0", ""]]


def test_p_values_are_for_other_programs_and_papers():
    estimates = {"difference": exactly(0.5), "p": exactly(0.046), "p unadjusted": exactly(0.0002)}
    table = tabulate([Summary("a", 8, {"success": exactly(0.4)}), Summary("b", 8, estimates)])
    assert list(table.cells.loc[1]) == ["", "0.50", "0.046", "< 0.001"]
    assert list(table.cells.loc[0])[2:] == ["", ""]
    first, second = csv.DictReader(io.StringIO(table.csv))
    assert (first["p"], second["p"], second["p unadjusted"]) == ("", "0.046", "0.0002")
    assert "0.046" in table.latex
    assert "0.046" not in table.text(), "the verdicts below have it"


def test_powers_of_ten_in_latex():
    table = tabulate([Summary("a", 8, {"x": estimate(1.8e-5, 1e-5, 2e-5)})])
    assert r"$1.8\times 10^{-5}\;[1.0\times 10^{-5}, 2.0\times 10^{-5}]$" in table.latex


def test_means_at_an_end_of_their_range_are_told_from_student_intervals():
    def legend(values, bounds):
        estimates = {"recovery time": bootstrap(values, bounds=bounds)}
        return " ".join(tabulate([Summary("a", 3, estimates)]).legend)

    assert "scaled" in legend([8.0, 8.0, 8.0], (0.0, 8.0))
    assert "scaled" in legend([0.0, 0.0, 0.0], (0.0, 8.0))
    assert "scaled" not in legend([1.0, 1.0, 1.0], (0.0, 1.0)), "a rate"
    assert "scaled" not in legend([7.0, 7.0, 8.0], (0.0, 8.0)), "the interval is cut, not scaled"


def test_an_empty_table():
    table = tabulate([])
    assert (str(table), table.csv) == ("no trial has finished", "condition,seeds\n")


def test_what_equals_success_in_every_row_is_left_out():
    frame = pd.DataFrame({"condition": "a", "phase": "training", "success": [True, False]})
    measures = (SUCCESS, Measure("stopped", "stopped", is_rate=True))
    for stopped, is_shown in (([True, False], False), ([True, True], True)):
        file = io.StringIO()
        write_rows(frame.assign(stopped=stopped), measures, "table", file)
        assert ("stopped" in file.getvalue()) == is_shown
