"""The best hierarchy of large teams, predicted by laws of small ones."""

import numpy as np
import pytest

from nested_agents.core.numerics import pd
from research.atlas_choices import HierarchyChoice, choices, shares_right
from research.atlas_rows import NO_FAULT

from .test_atlas import rows_of


def test_the_best_hierarchy_is_predicted_by_laws_of_small_teams() -> None:
    """Eight seeds, all of one sign: p is 2 / 2^8."""
    (choice,) = choices(rows_of(seeds=8))
    assert (choice.predicted, choice.measured, choice.nearest) == ("chain", "chain", "chain")
    assert choice.p == pytest.approx(2.0 / 2**8)
    assert (choice.rivals, choice.verdict) == ((), "right")
    assert str(choice) == (
        "line_up, batch-td, success, 64 agents: chain predicted, chain was best (p = 0.008)"
    )


def test_the_best_is_compared_with_each_other_hierarchy() -> None:
    """A third that ties with the best leaves none significantly the best."""
    rows = rows_of(seeds=8)
    third = rows[rows["hierarchy"] == "chain"].assign(hierarchy="tree:2")
    (choice,) = choices(pd.concat([rows, third]))
    assert choice.p == 1.0
    assert not choice.is_clear


def test_equal_hierarchies_are_not_decided() -> None:
    rows = rows_of()
    rows["success"] = 0.5 + 0.1 * np.random.default_rng(1).uniform(size=len(rows))
    assert [choice.verdict for choice in choices(rows)] == ["not decided"]


def test_laws_that_cross_are_seen_to_before_they_do() -> None:
    """The star is worse up to 16 agents and better at 64: the largest small teams mislead."""
    rows = rows_of()
    star = rows["hierarchy"] == "star"
    noise = np.random.default_rng(2).normal(0.0, 0.02, len(rows))
    odds = np.where(star, 0.3 * rows["size"] ** 0.5, 8.0 / rows["size"] ** 0.6) * np.exp(noise)
    rows["success"] = odds / (1.0 + odds)
    (last,) = choices(rows)
    assert (last.size, last.nearest, last.predicted, last.measured) == (64, "chain", "star", "star")
    assert last.verdict == "right"


def test_every_fault_is_a_case_at_the_largest_size_of_all_its_hierarchies() -> None:
    lost = rows_of(fault="lost .3")
    lost = lost[(lost["size"] < 64) | (lost["hierarchy"] == "chain")]
    assert [(c.case[2], c.size) for c in choices(pd.concat([rows_of(), lost]))] == [
        (NO_FAULT, 64),
        ("lost .3", 32),
    ]


def test_a_seed_that_one_hierarchy_lacks_is_left_out() -> None:
    rows = rows_of(seeds=8)
    lacks = (rows["seed"] == 3) & (rows["hierarchy"] == "star") & (rows["size"] == 4)
    (choice,) = choices(rows[~lacks])
    assert choice.p == pytest.approx(2.0 / 2**7)


@pytest.mark.parametrize("rows", [rows_of()[lambda d: d["size"] < 8], rows_of()[:20]])
def test_too_few_sizes_or_hierarchies_are_no_case(rows: pd.DataFrame) -> None:
    assert choices(rows) == []


def test_shares_count_only_where_one_is_significantly_the_best() -> None:
    case = HierarchyChoice(
        ("boxes", "td", NO_FAULT), "success", 64, "chain", (), "star", "chain", 0.01
    )
    others = [
        case._replace(rivals=("star",)),
        case._replace(predicted="star"),
        case._replace(p=0.2),
    ]
    assert shares_right([case, *others]) == [
        "4 cases, 3 with one significantly the best: 1 right, 1 wrong, 1 not decided",
        "decided and right: 1 of 3, 0.33 [0.06, 0.80]",
        "the greatest prediction: 2 of 3, 0.67 [0.20, 0.94]",
        "the best of the largest small teams: 0 of 3, 0 [0, 0.57]",
    ]
    assert shares_right(others[2:]) == ["1 cases, none with one significantly the best"]
