"""The chain-order study on made-up results, whose answer is known."""

from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from made_up_results import NOTHING, Arrays

from nested_agents.studies.presentation.figures import save
from nested_agents.studies.results.analysis import Analysis
from nested_agents.studies.results.differences import Difference
from nested_agents.studies.spec.spec import Spec
from research import SPECS
from research.studies import chain_order as chain_order
from research.studies.chain_order import analyse, draw

ORDERS = ["chain:" + ",".join(order) for order in permutations(("r1.a", "r1.b", "r2.a"))]


def made_up(chances: list[float], seeds: int = 20) -> Arrays:
    """Results of orders that succeed with these chances."""
    rng = np.random.default_rng(1)

    def outcomes(episodes: int) -> dict:
        return {
            order: {"success": (rng.random((seeds, episodes)) < chance).astype(float)}
            for order, chance in zip(ORDERS, chances, strict=True)
        }

    numbered = dict.fromkeys(ORDERS, tuple(range(seeds)))
    return Arrays(outcomes(15), outcomes(10), seeds=numbered)


def every(analysis: Analysis) -> list[Difference]:
    return [d for of_measure in analysis.differences.values() for d in of_measure]


def test_equal_orders_are_not_told_apart() -> None:
    analysis = analyse(made_up([0.7] * 6).frames())
    assert [c.p > 0.05 for c in analysis.cases] == [True, True]
    assert len(every(analysis)) == 10
    assert all(d.p > 0.05 for d in every(analysis))
    assert "6 orders do not differ significantly" in analysis.notes[0]


def test_one_bad_order_is_found_and_named() -> None:
    analysis = analyse(made_up([0.7, 0.7, 0.7, 0.3, 0.7, 0.7]).frames())
    for comparison in analysis.cases:
        assert comparison.p < 0.001
    assert [d.condition for d in every(analysis) if d.p < 0.05] == ["2 3 1", "2 3 1"]
    assert "6 orders differ" in analysis.notes[0]
    assert "evaluation success, minus that of 1 2 3:" in analysis.notes
    assert sum(note.startswith("  worse: 2 3 1") for note in analysis.notes) == 2


def test_agents_are_numbered_in_the_first_order() -> None:
    analysis = analyse(made_up([0.5] * 6).frames())
    assert [line.condition for line in analysis.table] == [
        "1 2 3", "1 3 2", "2 1 3", "2 3 1", "3 1 2", "3 2 1",
    ]  # fmt: skip
    assert "1 = r1.a, 2 = r1.b, 3 = r2.a" in analysis.notes[-1]


def test_orders_are_compared_on_the_seeds_that_all_have_finished() -> None:
    results = made_up([0.5] * 6)
    whole = np.sort(results.training[ORDERS[0]]["success"], axis=0)
    for k, order in enumerate(ORDERS):
        seeds = tuple(seed for seed in range(20) if seed != k)
        results.seeds[order] = seeds
        results.training[order]["success"] = whole[list(seeds)]
    analysis = analyse(replace(results, evaluation={}).frames())
    (test,) = analysis.cases
    assert (test.orders, test.seeds, test.p) == (6, 14, 1.0)
    assert [d.seeds for d in every(analysis)] == [18] * 5
    assert all(float(d.estimate.value) == 0.0 for d in every(analysis))


def test_what_no_two_seeds_have_finished_is_not_compared() -> None:
    results = made_up([0.5] * 6)
    results.seeds[ORDERS[2]] = (19,)
    for arrays in (results.training, results.evaluation):
        arrays[ORDERS[2]]["success"] = arrays[ORDERS[2]]["success"][-1:]
    results.evaluation.pop(ORDERS[0])
    analysis = analyse(results.frames())
    assert not analysis.cases
    assert len(analysis.table) == 6


def test_the_figure_is_drawn(tmp_path: Path) -> None:
    paths = save(draw(analyse(made_up([0.5] * 6).frames())), tmp_path)
    assert [path.name for path in paths] == ["chain-order.png", "chain-order.svg"]
    assert all(path.stat().st_size > 0 for path in paths)
    assert draw(analyse(NOTHING)) == {}


@pytest.mark.parametrize(
    ("path", "orders"),
    [(SPECS / "chain-order.toml", 24), (SPECS / "chain-order-8.toml", 4)],
)
def test_the_specs_hold_distinct_orders_of_at_least_twenty_seeds(path: Path, orders: int) -> None:
    spec = Spec.load(path)
    assert len(spec.conditions()) == orders
    assert len(spec.seeds) >= 20


@pytest.mark.parametrize(
    ("chances", "verdict"),
    [
        ((1.0, 1.0), "equal [-0.06, 0.06]"),
        ((0.6, 0.2), "the order matters [-0.45, "),
        ((0.5, 0.55), "not decided ["),
    ],
)
def test_orders_are_compared_within_overrides(chances: tuple[float, float], verdict: str) -> None:
    rng = np.random.default_rng(2)
    orders = {"chain": chances[0], "chain:reversed": chances[0], "chain:b,a": chances[1]}
    success, columns = {}, {}
    for name in ("fuzzy", "ppo"):
        for order, chance in orders.items():
            label = f"{name}, topology={order}"
            own = chance if name == "ppo" else 1.0
            success[label] = {"success": (rng.random((60, 10)) < own).astype(float)}
            columns[label] = {"name": name, "topology": order}
    numbered = dict.fromkeys(success, tuple(range(60)))
    made = Arrays(success, success, seeds=numbered, columns=columns)
    analysis = analyse(made.frames())
    assert [line.condition for line in analysis.table][:2] == [
        "fuzzy, chain",
        "fuzzy, chain:reversed",
    ]
    assert analysis.notes[0] == "fuzzy, 3 orders, within 0.1: equal [-0.06, 0.06]"
    assert analysis.notes[1].startswith(f"ppo, 3 orders, within 0.1: {verdict}")
    assert {name: len(own) for name, own in analysis.differences.items()} == {"fuzzy": 2, "ppo": 2}
