"""Nested agents beside the single agent, in short."""

from pathlib import Path

import pytest

from nested_agents.studies.cost.single_agent import CONTENDERS, compare
from nested_agents.studies.cost.single_agent_report import draw, table

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def contests():
    return compare((1, 2), seeds=(0, 1), episodes=20)


def test_every_contender_learns_for_every_number_of_agents(contests) -> None:
    assert [(c.agents, c.contender) for c in contests] == [
        (n, contender) for n in (1, 2) for contender in CONTENDERS
    ]
    assert all(c.curves.shape == (2, 20) for c in contests)


def test_costs_stand_beside_the_formula(contests) -> None:
    chain, single = contests[3], contests[4]
    assert (chain.weights, single.weights) == (50, 625)
    assert (chain.formula, single.formula) == (25 * (16 + 256), 625 * 256)
    assert (chain.rule_evaluations, single.rule_evaluations) == (25 * 20, 625 * 16)


def test_one_agent_is_the_single_agent(contests) -> None:
    assert (contests[0].curves == contests[1].curves).all()


def test_without_learning_there_is_no_success(contests) -> None:
    assert contests[5].greedy.value < 0.2


def test_table_and_figure(contests, tmp_path: Path) -> None:
    lines = table(contests).splitlines()
    assert max(map(len, lines)) <= 80
    assert len(lines) == 1 + 6 + 4
    draw(contests, tmp_path / "learning.svg")
    assert "<svg" in (tmp_path / "learning.svg").read_text()
