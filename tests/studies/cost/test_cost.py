"""``nested-agents cost``: what it prints is exact, and the running system agrees with it."""

import csv
import io
import json
import math
import sys
from dataclasses import asdict, replace
from fractions import Fraction
from itertools import product
from pathlib import Path

import pytest

import nested_agents as na
from nested_agents.core.agents.cost import Problem
from nested_agents.core.search.evaluator import Counts
from nested_agents.studies.cli.commands.describing import numbers
from nested_agents.studies.cli.main import main
from nested_agents.studies.cost.cost import (
    DECISION_METHODS,
    Columns,
    CostRow,
    agents_below,
    measure,
    messages,
    step_formula,
)
from nested_agents.studies.cost.figure import draw
from nested_agents.studies.cost.formats import format_rows
from nested_agents.studies.cost.table import cost_table
from nested_agents.studies.presentation import figures

FIVE = ("chain", "teams", "tree:2", "star", "independent")


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str]):
    """Run a command; return status, output and errors."""

    def run(*arguments: str) -> tuple[int, str, str]:
        status = main(["cost", *arguments])
        return status, *capsys.readouterr()

    return run


def test_json_has_integers_as_integers(said) -> None:
    status, out, _ = said("--format", "json")
    assert status == 0
    (row,) = json.loads(out)
    assert row == {
        "agents": 4,
        "topology": "chain",
        "memberships": 5,
        "rules": 78_125,
        "actions": 4,
        "iterations": 450,
        "nested_exact": 2_457_562_500_000,
        "nested_closed_form": 2_457_562_500_000,
        "nested_asymptotic": 2_457_600_000_000,
        "single_agent": 450 * 78125**4 * 16**4,
        "ratio": pytest.approx(4.4704e14, rel=1e-4),
    }
    assert all(type(row[key]) is int for key in row if key not in ("topology", "ratio"))


def test_the_arguments_are_those_of_the_formula(said) -> None:
    out = said("--agents", "2", "--rules", "7", "--actions", "3", "--iterations", "5",
               "--format", "json")[1]  # fmt: skip
    (row,) = json.loads(out)
    assert row["nested_exact"] == 5 * 7 * (9 + 81)
    assert row["single_agent"] == 5 * 49 * 81
    assert row["nested_asymptotic"] == round(5 * 7 * 81 * 9 / 8)


def test_other_topologies_have_no_closed_form(said) -> None:
    rows = json.loads(said("--topology", "star", "independent", "--format", "json")[1])
    assert [row["nested_closed_form"] for row in rows] == [None, None]
    assert rows[0]["nested_exact"] == 450 * 78125 * (16**4 + 3 * 16)
    # A star of two agents is a chain.
    (row,) = json.loads(said("--topology", "star", "--agents", "2", "--format", "json")[1])
    assert row["nested_closed_form"] == row["nested_exact"]


def test_a_thousand_agents_in_every_format(said) -> None:
    single = 450 * (78125 * 16) ** 1000
    before = sys.get_int_max_str_digits()
    outputs = {form: said("--agents", "1000", "--format", form) for form in
               ("table", "json", "csv", "latex")}  # fmt: skip
    assert sys.get_int_max_str_digits() == before
    assert all(status == 0 for status, *_ in outputs.values())
    assert "3.658e6099" in outputs["table"][1]
    assert r"3.658\times 10^{6099}" in outputs["latex"][1]
    try:
        sys.set_int_max_str_digits(0)
        (from_json,) = json.loads(outputs["json"][1])
        (from_csv,) = csv.DictReader(io.StringIO(outputs["csv"][1]))
        assert from_json["single_agent"] == single == int(from_csv["single_agent"])
        assert type(from_json["ratio"]) is int  # no floating-point number holds it
    finally:
        sys.set_int_max_str_digits(before)


def test_the_table_fits_a_terminal(said) -> None:
    out = said("--agents", "1:16", "--topology", *FIVE)[1]
    assert max(map(len, out.splitlines())) <= 80
    assert "e+" not in out


def test_columns_that_do_not_fit_a_terminal_follow_below(said, monkeypatch) -> None:
    named = "a name that is a little longer than usual=star"
    edges = "edges:" + ",".join(f"agent{i}>agent{i + 1}" for i in range(1, 9))
    line = ("--agents", "9", "--topology", "chain", named, edges, "--network")
    whole = said(*line)[1]
    assert edges in whole
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    out = said(*line)[1]
    assert max(map(len, out.splitlines())) <= 80
    assert "..." not in out
    for text in set(whole.split()) - {edges}:
        assert text in out.split()
    first = [line[: line.index("  ", 3)] for line in out.splitlines() if line.startswith("9  ")]
    assert first == 3 * ["9  chain", "9  a name that is a little longer than", f"9  {edges[:40]}"]


def test_numbers() -> None:
    assert numbers("agents", ["5:7"]) == [5, 6, 7]
    assert numbers("agents", ["4,8", "16"]) == [4, 8, 16]
    assert numbers("agents", ["1:3, 2:64:*4, 3"]) == [1, 2, 3, 8, 32]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--agents", "0"), "agents[0] = 0, allowed: whole numbers from 1 to 10,000"),
        (("--agents", "0:8:*2"), "agents = '0:8:*2', allowed: whole numbers such as 4 or 4,8,16"),
        (("--agents", "4:64:*1"), "agents = '4:64:*1'"),
        (("--agents", "4:64:0"), "agents = '4:64:0'"),
        (("--agents", "4,,8"), "agents = ''"),
        (("--agents", "four"), "agents = 'four'"),
        (("--agents", "5:2"), "agents = '5:2'"),
        (("--agents", "1:10001"), "at most 10,000 numbers"),
        (("--agents", "10001"), "agents[0] = 10001, allowed: whole numbers from 1 to 10,000"),
        (("--actions", "4", "1"), "actions[1] = 1, allowed: whole numbers from 2 to 10,000"),
        (("--actions", "4.5"), "actions = '4.5'"),
        (("--actions", "-4"), "-4"),
        (("--rules", "0"), "rules[0] = 0, allowed: whole numbers from 1"),
        (("--memberships", "0"), "memberships[0] = 0, allowed: whole numbers from 1 to 1,000"),
        (("--memberships", "three"), "memberships = 'three'"),
        (("--memberships", "3", "--rules", "9"), "memberships and rules are both given"),
        (("--iterations", "0"), "iterations = 0, allowed: 1 to"),
        (("--budget", "0"), "budget = 0, allowed: 1 to"),
        (("--budget", "3"), "budget = 3: chain needs one joint action for each of 4 agents"),
        (("--agents", "1:1000", "--actions", "2:1000"), "999,000 rows, allowed: 100,000"),
        (("--topology", "ring"), "topology 'ring': known: chain,"),
        (("--topology",), "'--topology' requires an argument; see nested-agents cost --help"),
        (("--topology", "--format", "csv"), "--topology --format: is an option"),
        (("--topology", "per-robot"), "agents = 'body', topology = 'chain'"),
        (("--format", "xml"), "'xml' is not one of 'table', 'json', 'csv', 'latex'"),
        (("--plot", "cost.txt"), "cost.txt: suffix must be"),
        (("--plot", "cost.svg", "--topology", *FIVE), "5 topologies and the single agent, allowed"),
        (("--plot", "cost.svg", "--rules", "1:13"), "13 pairs of rules and actions, allowed"),
        (("--topology", "a=chain", "a=star"), "'a' more than once; name each: LABEL=chain"),
        (("--topology", "a=b=chain"), "topology 'b=chain'"),
    ],
)
def test_what_the_user_can_mend_is_one_line(said, arguments: tuple[str, ...], message: str) -> None:
    status, out, err = said(*arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def per_step(measured: Columns, suffix: str = "") -> dict[str, float]:
    """The counts of a step."""
    names = ("joint_actions", "rule_evaluations", "weight_updates")
    return {name: measured[f"{name}{suffix}_per_step"] for name in names}


def counted(text: str, n: int) -> dict[str, float]:
    """The counts of a step of a running team, which are those of the formula."""
    measured = measure(text, n)
    assert per_step(measured) == per_step(measured, "_formula") == asdict(step_formula(text, n))
    assert measured["decision_ms"] > 0 < measured["learning_ms"]
    return per_step(measured)


@pytest.mark.parametrize("topology", [*FIVE, "random:1"])
@pytest.mark.parametrize("n", [1, 2, 5])
def test_counted_is_formula(topology: str, n: int) -> None:
    measured = counted(topology, n)
    below = agents_below(topology, n)
    assert measured["joint_actions"] == sum(4 ** (1 + b) for b in below)
    assert measured["weight_updates"] == 25 * n


@pytest.mark.parametrize(
    ("way", "n"), [("best-response", 1), ("best-response", 6), ("max-plus", 5)]
)
def test_ways_to_decide_count_as_their_formula(way: str, n: int) -> None:
    counted(way, n)


def test_ways_to_decide_are_added_up_as_the_hierarchies() -> None:
    """Of six agents the first tries 4 + 3 * 12 starts and 6 * 4 around them, each its own four."""
    table = cost_table([*DECISION_METHODS, "independent"], [6], rules=[7], iterations=5)
    rows = {row.topology: row for row in table.rows}
    exact = {name: row.nested_exact for name, row in rows.items()}
    assert exact["best-response"] == 35 * (68**2 + 5 * 4**2)
    assert exact["fitted-q"] == exact["independent"] == 35 * 6 * 4**2
    assert exact["hierarchy-ppo"] == 35 * 6
    assert not any("decision_ms" in measure(way, 6) for way in ("fitted-q", "hierarchy-ppo"))
    assert rows["best-response"].nested_closed_form is None


@pytest.mark.parametrize(
    ("topology", "expected"),
    [
        ("chain", (28, 7, 56)),
        ("hierarchy-ppo", (28, 7, 56)),
        ("independent", (0, 0, 56)),
        ("single-agent", (14, 2, 0)),
        ("coordination-graph", (14, 14, 56)),
        ("max-plus", (100 * 2 * 7, 100, 56)),
    ],
)
def test_messages(topology: str, expected: tuple[int, int]) -> None:
    assert tuple(messages(topology, 8).values()) == expected


def test_what_a_network_costs(said) -> None:
    command = ("--agents", "8,1024", "--topology", "chain", "graph=coordination-graph", "--network")
    lines = said(*command)[1].splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[-7].split() == ["8", "chain", "28", "7", "56"]
    (record,) = json.loads(said("--agents", "8", "--network", "--format", "json")[1])
    assert (record["messages"], record["messages_in_turn"]) == (28, 7)
    assert record["broadcast"] == 8 * 7
    assert said(*command, "--format", "latex")[1].count("tabular") == 4


def test_the_single_agent_counts_as_its_formula() -> None:
    measured = counted("single-agent", 2)
    assert (measured["joint_actions"], measured["rule_evaluations"]) == (16, 16 * 625)
    assert "decision_ms" not in measure("single-agent", 8)  # 65536 actions over 1.5e11 rules


def made_up(n: int, power: float, *, is_timed: bool = True) -> CostRow:
    tried = 4**n
    counts = asdict(Counts(tried, tried, n))
    extra = {f"{name}_formula_per_step": count for name, count in counts.items()}
    if is_timed:
        extra |= {f"{name}_per_step": count for name, count in counts.items()}
        extra |= {"decision_ms": 1e-3 * tried**power, "learning_ms": 1e-3}
    return CostRow(n, "chain", Problem(), 1, None, None, 1, extra=extra)


def test_the_table_of_what_was_measured_says_what_it_holds() -> None:
    out = format_rows([made_up(n, 1.5) for n in range(1, 11)], "table")
    assert "decide ms  learn ms" in out
    assert max(map(len, out.splitlines())) <= 80


def test_latex_has_what_was_measured() -> None:
    rows = [made_up(1, 1.0), made_up(10, 2.0), made_up(11, 1.0, is_timed=False)]
    formulas, measured = format_rows(rows, "latex").split("\n\n")
    assert r"\begin{tabular}{rlrrrrr}" in formulas
    assert measured.splitlines() == [
        r"% needs \usepackage{booktabs}",
        r"\begin{tabular}{rlrrrrrr}",
        r"\toprule",
        r"n & topology & formula & counted & rules tried & updates & decide ms & learn ms \\",
        r"\midrule",
        r"1 & chain & 4 & 4 & 4 & 1 & 0.004 & 0.001 \\",
        r"10 & chain & 1\,048\,576 & 1\,048\,576 & 1\,048\,576 & 10 & $1.100\times 10^{9}$ "
        r"& 0.001 \\",
        r"11 & chain & 4\,194\,304 & -- & -- & -- & -- & -- \\",
        r"\bottomrule",
        r"\end{tabular}",
    ]
    asked = replace(rows[2], extra={})
    assert format_rows([asked], "latex").count("tabular") == 2


def test_labels_of_ones_own_stand_in_place_of_topologies(said, tmp_path: Path) -> None:
    status, out, _ = said("--topology", "chain", "my tree=tree:2", "--format", "csv")
    rows = list(csv.DictReader(io.StringIO(out)))
    assert (status, [row["topology"] for row in rows]) == (0, ["chain", "my tree"])
    assert rows[1]["nested_exact"] == str(Problem().nested(agents_below("tree:2", 4)))


def test_csv_has_columns_of_rows_that_were_measured_later() -> None:
    rows = [made_up(1, 1.0, is_timed=False), made_up(2, 1.0)]
    first, second = csv.DictReader(io.StringIO(format_rows(rows, "csv")))
    assert (first["joint_actions_per_step"], second["joint_actions_per_step"]) == ("", "16")


@pytest.mark.parametrize("form", ["table", "json", "csv", "latex"])
def test_the_formula_stands_beside_what_is_not_measured(said, form: str) -> None:
    status, out, err = said("--agents", "65", "--measured", "--format", form)
    assert status == 0
    assert "65" in out
    joint = sum(4**k for k in range(1, 66))
    assert {"table": "1.815e39", "latex": r"1.815\times 10^{39}"}.get(form, str(joint)) in out
    assert err.startswith("Measuring. Code is compiled first; steps of over about a second")
    assert err.count("\n") == 1
    assert "0 of 0" not in out


def test_the_legend_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = []
    monkeypatch.setattr(figures, "write", lambda figure, path: drawn.append(figure))
    labels = {"chain": "chain", "evenodd.py:even_odd": "star"}
    rows = [row for t in labels.values() for row in cost_table([t], [4, 8]).rows]
    names = {text: label for label, text in labels.items()}
    draw([replace(row, topology=names[row.topology]) for row in rows], tmp_path / "cost.svg")
    (figure,) = drawn
    figure.draw_without_rendering()
    box = figure.legends[0].get_window_extent()
    assert box.x0 >= 0
    assert box.x1 <= figure.bbox.width


def test_measured_tables_and_figure(said, tmp_path: Path) -> None:
    figure = tmp_path / "cost.svg"
    status, out, _ = said("--agents", "1:2", "--topology", "chain", "single-agent", "--measured",
                          "--plot", str(figure))  # fmt: skip
    assert status == 0
    assert "All counts equal the formulas in 4 of 4 rows." in out
    assert max(map(len, out.splitlines())) <= 80
    assert "<svg" in figure.read_text()
    rows = cost_table(["chain"], [2], measured=True).rows
    (record,) = json.loads(format_rows(rows, "json"))
    assert record["joint_actions_per_step"] == record["joint_actions_formula_per_step"] == 20


def test_several_rules_and_actions_have_columns_in_every_form(said) -> None:
    """Each row equals the sum of Eq. 18 and the power of Eq. 23, with 2,187 and 78,125 rules."""
    command = ("--agents", "2", "3", "--memberships", "3", "5", "--actions", "4", "6")
    rows = json.loads(said(*command, "--format", "json")[1])
    keys = ("memberships", "actions", "agents")
    assert [tuple(row[key] for key in keys) for row in rows] == [*product((3, 5), (4, 6), (2, 3))]
    for row in rows:
        m, a, n = (row[key] for key in keys)
        assert row["rules"] == m**7
        assert row["nested_exact"] == 450 * m**7 * sum(a ** (2 * i) for i in range(1, n + 1))
        assert row["single_agent"] == 450 * m ** (7 * n) * a ** (2 * n)
    of_csv = csv.DictReader(io.StringIO(said(*command, "--format", "csv")[1]))
    assert [int(row["rules"]) for row in of_csv] == [row["rules"] for row in rows]
    header, first, *_ = (line.split() for line in said(*command)[1].splitlines())
    assert header[:4] == ["rules", "actions", "n", "topology"]
    assert first[:4] == ["2,187", "4", "2", "chain"]
    latex = said(*command, "--format", "latex")[1]
    assert "rules & actions & n & topology & Eq. 18" in latex
    assert r"78\,125 & 6 & 3 & chain & $1.687\times 10^{12}$" in latex
    assert (
        said("--agents", "2,3", "--memberships", "3,5", "--actions", "4:6:2")[1]
        == said(*command)[1]
    )
    table = cost_table(["chain"], [2, 3], memberships=[3, 5], actions=[4, 6])
    assert [row.nested_exact for row in table.rows] == [row["nested_exact"] for row in rows]
    assert str(table) == said(*command)[1].rstrip("\n")


def test_one_value_of_a_quantity_stands_below_the_table(said) -> None:
    out = " ".join(said("--memberships", "3")[1].split())
    assert "Rules |S| = 3^7 = 2,187, actions |A| = 4, iterations L = 450." in out
    assert "memberships" not in out.partition("Operations")[0]
    out = said("--rules", "9", "10", "--format", "csv")[1]
    assert [row["memberships"] for row in csv.DictReader(io.StringIO(out))] == ["", ""]


def test_what_was_measured_has_one_line_whatever_the_rules(said) -> None:
    out = said("--agents", "1", "--actions", "4", "6", "--measured", "--network")[1]
    assert len([line for line in out.splitlines() if line.split()[:2] == ["1", "chain"]]) == 2
    (first, second) = cost_table(["chain"], [1], actions=[4, 6], measured=True).rows
    assert first.extra == second.extra


def test_a_budget_is_divided_as_in_a_running_team(said) -> None:
    """The first of three agents in a chain may try 44 of 64 joint actions."""
    command = ("--agents", "3", "--topology", "chain", "single-agent", "--budget")
    chain, single = json.loads(said(*command, "64", "--rules", "7", "--format", "json")[1])
    keys = ("budget", "joint_actions", "joint_actions_tried", "operations")
    assert [chain[key] for key in keys] == [64, 84, 64, 450 * 7 * (44**2 + 16**2 + 4**2)]
    assert [single[key] for key in keys] == [64, 64, 64, single["single_agent"]]
    (row, _) = json.loads(said(*command, "100", "--format", "json")[1])
    assert row["joint_actions_tried"] == row["joint_actions"] == 84
    assert row["operations"] == row["nested_exact"], "the budget exceeds what is needed"
    header, first = said(*command, "64")[1].split("\n\n")[3].splitlines()[:2]
    assert header.split() == ["n", "topology", "budget", "joint", "actions", "tried", "operations"]
    assert first.split()[:5] == ["3", "chain", "64", "84", "64"]


@pytest.mark.parametrize(("topology", "budget"), [("chain", 16), ("tree:2", 64), ("star", 8)])
def test_a_budget_is_what_a_running_team_keeps(topology: str, budget: int) -> None:
    spec = {
        "steps": 4, "scenario": {"kind": "line-up", "carts": 4}, "topology": topology,
        "learner": {"decision": {"budget": budget, "evaluator": "sampling"}},
    }  # fmt: skip
    (profiled,) = na.profile(spec, seconds=0.01).itertuples()
    (row,) = cost_table([topology], [4], budget=budget).rows
    assert profiled.tried <= row.extra["joint_actions_tried"] == profiled.budget


def test_a_graph_of_one_agent_is_measured() -> None:
    for text in ("coordination-graph", "max-plus"):
        counted(text, 1)


def test_the_paper_s_numbers_are_reproduced() -> None:
    """Section VII prints 2.45e12, which is Eq. 21 cut to three digits, and 1.1e27, rounded."""
    (row,) = cost_table().rows
    assert row.nested_asymptotic == 450 * 5**7 * 16**4 * Fraction(16, 15) == 2_457_600_000_000
    assert str(row.nested_asymptotic)[:3] == "245"
    assert f"{row.single_agent:.1e}" == "1.1e+27"


@pytest.mark.parametrize("agents", ["2:4", "2:10", "1:16", "1:300"])
def test_the_axis_of_operations_is_their_logarithm(said, agents, tmp_path, monkeypatch) -> None:
    drawn = []
    monkeypatch.setattr(figures, "write", lambda figure, path: drawn.append(figure))
    names = ("chain", "best-response", "fitted-q", "hierarchy-ppo")
    command = ("--agents", agents, "--topology", *names, "single-agent", "--plot", "cost.png")
    assert said(*command)[0] == 0
    (figure,) = drawn
    figure.draw_without_rendering()
    (axes,) = figure.axes
    assert axes.get_ylabel() == "log10(operations)"
    shown = [text.get_text() for text in figure.legends[0].get_texts()]
    assert shown == [*names, "single agent (Eq. 23)"]
    for axis in (axes.xaxis, axes.yaxis):
        low, high = axis.get_view_interval()
        ticks = axis.get_majorticklocs()
        assert sum(low <= tick <= high for tick in ticks) >= 3
        labels = [label.get_text().replace(",", "") for label in axis.get_majorticklabels()]
        assert list(map(float, labels)) == pytest.approx(ticks)
        assert not len(axis.get_minorticklocs())
    n = max(numbers("agents", [agents]))
    lines = {line.get_color(): line.get_ydata() for line in axes.lines if len(line.get_ydata()) > 1}
    single = Fraction((78125 * 16) ** n * 450)
    assert lines["black"][-1] == pytest.approx(math.log10(single.numerator))
    assert len(lines) == 5


@pytest.mark.parametrize(("agents", "is_said"), [("5", False), ("5:6", True)])
def test_where_the_default_evaluator_is_another_one_is_said(said, agents, is_said) -> None:
    out = said("--agents", agents, "--topology", "chain", "star", "independent", "best-response")[1]
    assert ("in this table for: chain, star." in " ".join(out.split())) == is_said
