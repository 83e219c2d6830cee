"""research/notebooks/edges.md holds the tables of committed results, topologies.md what is run."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from published_tables import print_table

import nested_agents as na
from nested_agents.studies.results.comparison import compare_conditions
from nested_agents.studies.results.notation import format_estimate, format_number, format_p
from nested_agents.studies.results.permutation_tests import paired_permutation
from nested_agents.studies.results.results import Results
from nested_agents.studies.results.statistics import Estimate, bootstrap
from nested_agents.studies.store.database import EVALUATION
from research import RESULTS, equal_treatment
from research.studies.chain_order import equivalence
from research.studies.edges import TRAINED, analyse, effects

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGE = ROOT / "research" / "notebooks" / "edges.md"


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("hierarchies", ("evaluation success", "messages")),
        ("own-relation-4", ("evaluation success", "decisions to goal", "messages")),
        ("own-relation", ("evaluation success", "decisions to goal", "messages")),
    ],
)
def test_tables(name: str, columns: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    table = print_table(name, columns, capsys)
    assert table in PAGE.read_text(encoding="utf-8"), (
        f"research/notebooks/edges.md: put in\n{table}"
    )


SETTINGS = {
    "own values, 3 sizes": ("own",),
    "team's value, 3 sizes": ("team",),
    "all six settings": ("own", "team"),
}


def test_what_telling_is_worth_over_all_settings() -> None:
    page = PAGE.read_text(encoding="utf-8")
    results = na.load(RESULTS / "edges.json").results
    for name, whose in SETTINGS.items():
        lost, slower = pooled(results, whose, "considered only")
        line = f"| {name} | {shown(lost)} | {p_of(lost)} | {times(slower)} | {p_of(slower)} |"
        assert line in page, f"research/notebooks/edges.md: put in\n{line}"
    lost, _ = pooled(results, ("own",), "considered only")
    assert f"{shown(-lost)}, which does not decide" in " ".join(
        (PAGE.parent / "claims.md").read_text().split()
    )


def pooled(results: Results, whose: tuple[str, ...], other: str) -> tuple[np.ndarray, np.ndarray]:
    """Return of each seed the mean difference of success, and of the logarithm of decisions."""
    gained = []
    longer = []
    for condition in results.conditions:
        if results.columns[condition]["learner.decision.value_of"] in whose:
            phases = ("evaluation", EVALUATION + other)
            trained, without = (results.success(condition, phase) for phase in phases)
            steps = [results.values(condition, "steps", phase) for phase in phases]
            gained.append(without.mean(axis=1) - trained.mean(axis=1))
            before = (trained * steps[0]).sum(axis=1) / trained.sum(axis=1)
            after = (without * steps[1]).sum(axis=1) / without.sum(axis=1)
            longer.append(np.log(after / before))
    return np.mean(gained, axis=0), np.mean(longer, axis=0)


def shown(of_seeds: np.ndarray) -> str:
    return format_estimate(bootstrap(of_seeds))


def times(logarithms: np.ndarray) -> str:
    return format_estimate(Estimate(*map(np.exp, bootstrap(logarithms))))


def p_of(of_seeds: np.ndarray) -> str:
    p = paired_permutation(of_seeds, np.zeros_like(of_seeds))
    return format_p(p).removeprefix("= ")


def test_what_is_equal_to_the_chain() -> None:
    results = na.load(RESULTS / "edges.json").results
    page = PAGE.read_text(encoding="utf-8")
    for other, (success, decisions) in effects(results, analyse(results).cases, TRAINED).items():
        gained = format_estimate(success.estimate)
        longer = f"{format_estimate(decisions.estimate)} times"
        line = f"| {other} | {gained} | {success.verdict} | {longer} | {decisions.verdict} |"
        assert line in page, f"research/notebooks/edges.md: put in\n{line}"


def test_the_tables_of_equal_treatment() -> None:
    page = PAGE.read_text(encoding="utf-8")
    for line in equal_treatment.lines():
        assert line in page, f"research/notebooks/edges.md: put in\n{line}"


EVALUATED_AS = (
    "as trained", "told only", "considered only", "considered only, private plans",
    "considered only, common plan", "neither",
)  # fmt: skip


@pytest.mark.parametrize("name", ["edges", "edges-hierarchies", "edges-arms", "edges-games"])
def test_tables_with_a_column_for_each_evaluation(name: str, capsys) -> None:
    lines = print_table(name, ["evaluation success"], capsys).splitlines()[2:]
    success = {label: value for label, _, value in (line[2:-2].split(" | ") for line in lines)}
    rows = [label.removesuffix(", neither") for label in success if label.endswith(", neither")]
    for row in rows:
        line = " | ".join([row, *(success[f"{row}, {how}"] for how in EVALUATED_AS)])
        assert f"| {line} |" in PAGE.read_text(encoding="utf-8"), (
            f"research/notebooks/edges.md: {line}"
        )


def test_the_table_of_classes_of_edges(capsys) -> None:
    columns = ("evaluation success", "decisions to goal", "messages")
    for line in print_table("edges-classes", columns, capsys).splitlines()[2:]:
        label, _, *values = line[2:-2].split(" | ")
        row = " | ".join([label.removeprefix("default, "), *values])
        assert f"| {row} |" in PAGE.read_text(encoding="utf-8"), (
            f"research/notebooks/edges.md: {row}"
        )


def test_the_tables_of_broken_hierarchies(capsys) -> None:
    lines = print_table("edges-broken", ["evaluation success"], capsys).splitlines()[2:]
    success = {label: value for label, _, value in (line[2:-2].split(" | ") for line in lines)}
    others = (
        "as trained", "lost .9, common plan", "delayed by 1", "noisy .3", "leader silent",
        "leader absent",
    )  # fmt: skip
    for trained in ("chain", "tree:2", "teams"):
        rows = [[trained, *(success[f"{trained}, {other}"] for other in others)]]
        for read in ("maintain", "last", "plan"):
            lost = [success[f"{trained}, lost {p}, {read}"] for p in ("0", ".3", ".6", ".9")]
            rows.append([f"{trained}, {read}", *lost])
        for row in rows:
            line = f"| {' | '.join(row)} |"
            assert line in PAGE.read_text(encoding="utf-8"), f"research/notebooks/edges.md: {line}"


@pytest.mark.parametrize(
    ("names", "task"),
    [
        (("orders-boxes",), "boxes, 2 robots"),
        (("orders-arm", "orders-arm-ppo"), "arm of 4 joints"),
        (("orders-game", "orders-game-ppo"), "climbing, 3 agents"),
        (("orders-line", "orders-line-ppo"), "game on a line, 8 agents"),
        (("orders-line-again",), "the same, seeds 40 to 79"),
    ],
)
def test_the_table_of_orders(names: tuple[str, ...], task: str) -> None:
    for name in names:
        results = na.load(RESULTS / f"{name}.json").results
        for group in compare_conditions(results, by="topology").groups:
            rates = [line.estimates["evaluation success"].value for line in group.table]
            learner, orders, verdict, ends = re.findall(
                r"(.+), (\d+) orders, within 0.1: (.+) (\[.+\])", equivalence(group)
            )[0]
            rates = f"{format_number(min(rates))} to {format_number(max(rates))}"
            cells = task, learner, orders, str(group.table[0].seeds), rates, ends, verdict
            line = f"| {' | '.join(cells)} |"
            assert line in PAGE.read_text(encoding="utf-8"), f"research/notebooks/edges.md: {line}"


def test_the_table_of_orders_by_who_hears_a_neighbor() -> None:
    fitted, ppo = (
        compare_conditions(na.load(RESULTS / f"orders-line{own}.json").results, by="topology").table
        for own in ("", "-ppo")
    )
    for own, other in zip(fitted, ppo, strict=True):
        order = re.findall(r"agent(\d)", own.condition) or "12345678"
        order = order[::-1] if own.condition.endswith("reversed") else order
        heard = sum(abs(int(a) - int(b)) == 1 for a, b in pairwise(order))
        rates = [format_estimate(line.estimates["evaluation success"]) for line in (own, other)]
        line = f"| {' '.join(order)} | {heard} | {' | '.join(rates)} |"
        assert line in PAGE.read_text(encoding="utf-8"), f"research/notebooks/edges.md: {line}"


@pytest.mark.slow
def test_kept_teams_are_evaluated_again_as_it_says(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    running = (DOCS / "running.md").read_text(encoding="utf-8")
    communication = (DOCS / "communication.md").read_text(encoding="utf-8")
    pages = communication + running.replace("out/mine", "out/kept")
    blocks = re.findall(r"```python\n(.*?)```", pages, re.DOTALL)
    (again,) = [block for block in blocks if "na.reevaluate" in block]
    (acting,) = [block for block in blocks if "study.team" in block]
    small = {"seeds=4": "seeds=2", "episodes=6": "episodes=1", "steps=150": "steps=6"}
    for large, less in small.items():
        again = again.replace(large, less)
    exec(again, {"__name__": "__main__"})
    assert re.findall(r"^(\S.*?)  ", capsys.readouterr().out, re.MULTILINE) == [
        "chain", "tree:2", "{communication = 'none'}",
    ]  # fmt: skip
    exec(acting, {"na": na})
    assert capsys.readouterr().out.startswith("[")
