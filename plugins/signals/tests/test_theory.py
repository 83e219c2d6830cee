"""Majorities and cascades against numbers by hand and the published formulas."""

from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nested_agents_signals.theory import (
    cascade,
    enumerated,
    evidence,
    expected,
    majority,
)

from nested_agents import Hierarchy

ACCURACIES = st.floats(0.51, 0.97)


def chain(n, communication="ancestors"):
    names = [f"agent{i}" for i in range(n)]
    return Hierarchy(names, list(pairwise(names)), communication=communication)


def test_a_majority_of_three_by_hand():
    assert majority(3, 0.7) == pytest.approx(0.7**3 + 3 * 0.7**2 * 0.3)
    assert majority(4, 0.6) == pytest.approx(majority(3, 0.6))  # a fourth one adds ties alone


def test_a_majority_grows_towards_one():
    rates = [majority(n, 0.6) for n in (1, 11, 101, 1001)]
    assert rates == sorted(rates)
    assert rates[-1] > 0.999


@pytest.mark.parametrize("q", [0.55, 0.7, 0.9])
def test_cascades_by_coin_are_those_of_bikhchandani_and_others(q):
    # (1992), Equations 1 to 3: up, no, down cascade after an even number of agents n
    right = cascade(21, q, "coin").right
    for n in (2, 4, 20):
        none = (q - q**2) ** (n // 2)
        up = q * (q + 1) * (1 - none) / (2 * (1 - q + q**2))
        assert right[n] == pytest.approx(up + none * q)


@pytest.mark.parametrize("q", [0.55, 0.7, 0.9])
def test_cascades_of_agents_who_trust_their_signal(q):
    # of two agents in a row both are right, both are wrong, or all begins anew
    right = cascade(21, q).right
    both = q**2 / (q**2 + (1 - q) ** 2)
    for n in (2, 4, 20):
        none = (2 * q * (1 - q)) ** (n // 2)
        assert right[n] == pytest.approx(both * (1 - none) + none * q)


@given(ACCURACIES)
def test_a_chain_is_right_more_often_further_down_and_its_vote_no_more_than_its_last(q):
    for indifferent in ("signal", "coin"):
        chain = cascade(12, q, indifferent)
        assert (np.diff(chain.right) >= -1e-12).all()
        assert chain.right[0] == pytest.approx(q)
    assert cascade(12, q).right[-1] >= cascade(12, q, "coin").right[-1] - 1e-12


@given(ACCURACIES, st.integers(1, 9))
def test_trying_all_signals_agrees_with_the_recursion(q, n):
    tried = enumerated(chain(n), q)
    recursion = cascade(n, q)
    assert tried.right == pytest.approx(recursion.right)
    assert tried.vote == pytest.approx(recursion.vote)


@given(ACCURACIES, st.integers(1, 9))
def test_trying_all_signals_agrees_with_the_majority(q, n):
    assert enumerated(chain(n, "none"), q).vote == pytest.approx(majority(n, q))


def test_who_hears_the_one_before_alone_gains_nothing():
    assert enumerated(chain(5, "parents"), 0.7).right == pytest.approx([0.7] * 5)


def test_four_agents_by_hand():
    # The third and the fourth follow two who agree; else each begins anew, as the first two did.
    q = 0.7
    total = 0.0
    for signals in product((0, 1), repeat=4):
        chance = np.prod([q if s else 1 - q for s in signals])
        named = list(signals)
        if signals[0] == signals[1]:
            named[2:] = [signals[0]] * 2
        total += chance * (sum(named) > 2 or 0.5 * (sum(named) == 2))
    assert cascade(4, q).vote == pytest.approx(total)


def test_in_a_cascade_nobody_tells_anything():
    one = np.log(0.7 / 0.3)
    assert evidence(np.array([-3 * one, 3 * one]), 0.7, "coin").tolist() == [[0, 0], [0, 0]]
    named = evidence(np.array(one), 0.7, "coin")
    assert named == pytest.approx([-one, np.log((0.7 + 0.15) / (0.3 + 0.35))])


def test_what_is_known_of_which_hierarchy():
    names = [f"agent{i}" for i in range(40)]
    star = Hierarchy(names, [(names[0], other) for other in names[1:]])
    of_star = expected(star, 0.7)
    assert of_star.right == pytest.approx([0.7] * 40)
    assert np.isnan(of_star.vote)
    assert expected(chain(40), 0.7).vote == cascade(40, 0.7).vote
    assert expected(chain(40, "none"), 0.7).vote == majority(40, 0.7)
    assert expected(chain(40, "parents"), 0.7) is None
    assert expected(chain(6, "parents"), 0.7).right == pytest.approx([0.7] * 6)
    with pytest.raises(ValueError, match="17 agents, allowed: 16"):
        enumerated(chain(17), 0.7)
