"""Computational cost of a hierarchy by the paper's formulas (Section VII, Eq. 18-23).

One iteration updates every state-action pair of every agent by enumeration. Agent i chooses among
``|A| ** (1 + |below(i)|)`` joint actions of itself and the agents that it searches over. With |S|
rules per agent, it has |S| times as many pairs, and each is maximized over as many joint actions.
In the paper's chain of n agents the exponents are n, n - 1, ..., 1, and the sums have closed forms.

Results are exact integers of any size, one is a fraction; floats would overflow before n = 50.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

from ..hierarchy.hierarchy import Hierarchy

PAPER_RULES = 5**7
"""|S_n|: seven state variables of five membership functions (Section VII)."""
PAPER_ACTIONS = 4
"""|A| (Section V)."""
PAPER_ITERATIONS = 450
"""L, the iterations of a training epoch (Section VII)."""


@dataclass(frozen=True)
class Problem:
    """Quantities that all formulas share, all above 0."""

    rules: int = PAPER_RULES
    """|S_n|, number of states (rules) of one agent."""
    actions: int = PAPER_ACTIONS
    """|A|, number of actions of one agent, at least 2."""
    iterations: int = PAPER_ITERATIONS
    """L, number of iterations."""

    def nested(self, below: Iterable[int]) -> int:
        """Return the cost of any hierarchy (Eq. 18, generalized).

        ``L * sum_i |S| * (|A| ** (1 + below_i)) ** 2``

        Parameters
        ----------
        below
            Number of agents that each agent searches over.

        Examples
        --------
        The paper's chain of four agents:

        >>> Problem().nested(range(4))
        2457562500000
        """
        return self.sweep(self.actions ** (1 + count) for count in below)

    def sweep(self, tried: Iterable[int]) -> int:
        """Return the cost of agents by the number of joint actions that each tries (Eq. 18).

        ``L * sum_i |S| * tried_i ** 2``
        """
        return self.iterations * self.rules * sum(count**2 for count in tried)

    def chain_closed_form(self, n: int) -> int:
        """Return the cost of a chain of n agents as a geometric series (Eq. 19).

        ``L * |S| * ((|A|^2)^(n+1) - |A|^2) / (|A|^2 - 1)``; the division leaves no remainder.
        """
        square = self.actions**2
        return self.iterations * self.rules * ((square ** (n + 1) - square) // (square - 1))

    def chain_asymptotic(self, n: int) -> Fraction:
        """Return the cost of a chain of many agents (Eq. 21, 22).

        ``L * |S| * (|A|^2)^n * K`` with ``K = |A|^2 / (|A|^2 - 1)``

        Examples
        --------
        >>> Problem().chain_asymptotic(4)
        Fraction(2457600000000, 1)
        """
        square = self.actions**2
        return self.iterations * self.rules * square**n * Fraction(square, square - 1)

    def single_agent(self, n: int) -> int:
        """Return the cost of one agent over the joint state and action of n agents (Eq. 23).

        ``L * |S|^n * (|A|^2)^n``

        Examples
        --------
        >>> f"{Problem().single_agent(4):.4e}"
        '1.0986e+27'
        """
        return self.iterations * self.rules**n * self.actions ** (2 * n)

    def decision(self, below: Iterable[int]) -> int:
        """Return the number of joint actions that one joint decision tries.

        ``sum_i |A| ** (1 + below_i)``. A decision visits one state and maximizes once, while the
        other formulas sweep all states and maximize for every state-action pair.
        """
        return sum(self.actions ** (1 + count) for count in below)


def below_counts(hierarchy: Hierarchy) -> tuple[int, ...]:
    """Return the number of agents that each agent searches over, in agent order."""
    return tuple(len(hierarchy.searched(i)) for i in range(len(hierarchy)))


def is_chain(below: Iterable[int]) -> bool:
    """Return whether a hierarchy with these `below_counts` is a chain.

    Examples
    --------
    >>> is_chain([1, 2, 0]), is_chain([1, 0, 0])
    (True, False)
    """
    counts = sorted(below)
    return counts == list(range(len(counts)))
