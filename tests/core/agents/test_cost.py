"""The cost formulas against the paper's printed figures, each other, and n up to 1000."""

from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from nested_agents.core.agents.cost import Problem, below_counts, is_chain
from nested_agents.core.hierarchy.hierarchy import Hierarchy

PAPER = Problem()


def truncated(number: int | Fraction, digits: int) -> str:
    """The number in scientific notation, cut off and not rounded, as the paper prints it."""
    whole = str(int(number))
    return f"{whole[0]}.{whole[1:digits]}e{len(whole) - 1}"


def test_the_papers_four_agents() -> None:
    assert PAPER.rules == 78125
    assert PAPER.nested(range(4)) == 450 * 78125 * (16 + 16**2 + 16**3 + 16**4)
    assert PAPER.nested(range(4)) == 2_457_562_500_000
    assert PAPER.chain_asymptotic(4) == 2_457_600_000_000
    assert PAPER.single_agent(4) == 450 * 78125**4 * 16**4


def test_the_papers_printed_figures() -> None:
    # Section VII prints 2.45e12 and 1.1e27: the first cut off, the second rounded.
    assert truncated(PAPER.nested(range(4)), 3) == "2.45e12"
    assert truncated(PAPER.chain_asymptotic(4), 3) == "2.45e12"
    assert f"{PAPER.single_agent(4):.4e}" == "1.0986e+27"
    assert f"{PAPER.single_agent(4):.1e}" == "1.1e+27"


@given(
    n=st.integers(1, 1000),
    rules=st.integers(1, 10**6),
    actions=st.integers(2, 9),
    iterations=st.integers(1, 10**4),
)
def test_sum_closed_form_and_factored_form_are_one(
    n: int, rules: int, actions: int, iterations: int
) -> None:
    problem = Problem(rules, actions, iterations)
    exact = problem.nested(range(n))
    assert problem.chain_closed_form(n) == exact
    # Eq. 20: the same with the largest power taken out.
    square = actions**2
    factored = square**n * (square - Fraction(1, square ** (n - 1))) / (square - 1)
    assert iterations * rules * factored == exact
    # Eq. 21 sums the series down to n = -infinity: too much by its part up to n = 0.
    assert problem.chain_asymptotic(n) - exact == Fraction(
        iterations * rules * actions**2, actions**2 - 1
    )


def test_every_n_to_1000_is_exact() -> None:
    total = 0
    for n in range(1, 1001):
        total += 450 * 78125 * 16**n
        assert PAPER.nested(range(n)) == PAPER.chain_closed_form(n) == total
        single = PAPER.single_agent(n)
        assert type(single) is int
        assert single == 450 * (78125 * 16) ** n
        assert (single > total) == (n > 1)


def test_any_hierarchy() -> None:
    star = Hierarchy("abcd", [("a", "b"), ("a", "c"), ("a", "d")])
    assert below_counts(star) == (3, 0, 0, 0)
    assert PAPER.nested(below_counts(star)) == 450 * 78125 * (16**4 + 3 * 16)
    assert PAPER.decision(below_counts(star)) == star.count_joint_actions(4) == 4**4 + 3 * 4
    assert not is_chain(below_counts(star))


def test_an_independent_agent_costs_the_same_alone_and_in_company() -> None:
    assert PAPER.nested([0] * 7) == 7 * PAPER.nested([0])
