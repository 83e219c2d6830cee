"""Labels of independent samples are permuted exactly, ties included."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

import nested_agents as na
from nested_agents.studies.results.permutation_tests import independent_permutation

ONE_DECIMAL = [
    (["70.4", "70.8", "70.6", "70.6", "70.8", "70.9"], ["71.1", "70.9", "70.8", "70.8", "71.6"]),
    (["70.4", "71.1", "71.0", "70.1", "70.5"], ["71.2", "71.0", "71.6", "70.8", "71.6"]),
]


def exact_p(first: list[Fraction], second: list[Fraction]) -> Fraction:
    """Return the two-sided p over all permutations of labels, in rational numbers."""
    values = first + second
    total, n, m = sum(values), len(first), len(second)
    sums = [sum(chosen) for chosen in itertools.combinations(values, n)]
    differences = [s / n - (total - s) / m for s in sums]
    observed = sum(first) / n - sum(second) / m
    reached = sum(d >= observed for d in differences), sum(d <= observed for d in differences)
    return min(Fraction(1), Fraction(2 * min(reached), len(sums)))


@pytest.mark.parametrize(("first", "second"), ONE_DECIMAL)
@pytest.mark.parametrize("offset", [0, 10**8])
def test_ties_are_not_broken_by_rounding(first, second, offset) -> None:
    own, other = ([Fraction(x) + offset for x in xs] for xs in (first, second))
    p = independent_permutation([float(x) for x in own], [float(x) for x in other])
    assert p == pytest.approx(float(exact_p(own, other)), abs=1e-12)


def test_means_over_items_in_another_order_tie(tmp_path) -> None:
    table = tmp_path / "items.csv"
    items = [("a", "x", [0.1, 0.2, 0.3]), ("b", "x", [0.3, 0.2, 0.1])]
    rows = [
        f"{condition},{agents},{seed},{item},{score}\n"
        for agents in (2, 4, 8)
        for condition, _, scores in items
        for seed in range(6)
        for item, score in enumerate(scores)
    ]
    table.write_text("topology,agents,seed,item,score\n" + "".join(rows))
    loaded = na.load(table, columns=["condition=topology+agents"])
    assert all(d.cliffs_delta == 0.0 for d in loaded.compare(by="topology").differences)
    report = loaded.scalability(size="agents")
    assert report.best[0] == ("a", "b")
    assert not report.crossovers


def test_tables_of_one_condition_column_are_grouped_by_condition(tmp_path) -> None:
    rng = np.random.default_rng(0)
    for name in ("one", "two"):
        rows = [f"{c},{s},{rng.normal():.3f}\n" for c in "ab" for s in range(8)]
        (tmp_path / f"{name}.csv").write_text("condition,seed,score\n" + "".join(rows))
    compared = na.load(tmp_path / "one.csv", tmp_path / "two.csv").compare(by="directory")
    assert [(d.condition, d.seeds) for d in compared.differences] == [("two.csv", 8)] * 2
    assert all(f"{c}, one.csv" in str(compared) for c in "ab")
