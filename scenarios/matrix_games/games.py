"""The games of Claus and Boutilier (1998) and of Kapetanakis and Kudenko (2002), as payoffs.

All agents receive the same payoff, and must find the joint action of the greatest expected one.
Actions are called a, b, c. Rows are the first agent's actions, columns the second one's::

    climbing    a    b    c        penalty     a    b    c
           a   11  -30    0               a   10    0    k
           b  -30    7    6               b    0    2    0
           c    0    0    5               c    k    0   10

Climbing punishes him who plays his part of the optimum, (a, a), while the other does not yet. The
penalty game has two optima, which must not be mixed up. In the stochastic games a joint action pays
one of two amounts, with equal probability; their means are those of climbing.

For three agents there is no game in these papers. Ours pays the least of what each pair of agents,
in their order, would be paid in climbing: 11 if all play a, 7 if all play b, 5 if all play c.
"""

from collections.abc import Callable, Sequence
from itertools import combinations
from math import isfinite

import numpy as np

from ...core.interface.measures import SUCCESS, Measure
from ...core.numerics.arrays import FloatArray
from ...core.plugins.messages import closest

OF_OPTIMA = (
    Measure(SUCCESS.name, SUCCESS.title, source="optimal", better="higher", is_rate=True),
    Measure(
        "optimal_plays", "optimal plays", source="optimal", gathering="mean", better="higher",
        least=0.0, greatest=1.0,
    ),
)  # fmt: skip
"""What is measured of any game: success is that the last play of an episode was optimal."""
CLIMBING = ((11, -30, 0), (-30, 7, 6), (0, 0, 5))
PARTIALLY_STOCHASTIC = ((11, -30, 0), (-30, (14, 0), 6), (0, 0, 5))
STOCHASTIC = (
    ((10, 12), (5, -65), (8, -8)), ((5, -65), (14, 0), (12, 0)), ((5, -5), (5, -5), (7, 3)),
)  # fmt: skip


def payoffs_of(game: str) -> FloatArray:
    """Return the two equally probable payoffs ``(2, A, ..., A)`` of each joint action of a game.

    Parameters
    ----------
    game
        A name in `GAMES`; ``"penalty:k"`` with a number k.

    Raises
    ------
    ValueError
        If there is no such game, or k is no finite number; one line.

    Examples
    --------
    >>> payoffs_of("penalty:-100")[0].tolist()
    [[10.0, 0.0, -100.0], [0.0, 2.0, 0.0], [-100.0, 0.0, 10.0]]
    """
    name, colon, argument = game.partition(":")
    if name not in GAMES:
        raise ValueError(closest(name, [n if n != "penalty" else "penalty:K" for n in GAMES]))
    if (name == "penalty") != bool(colon):
        raise ValueError("penalty is written penalty:K with a number K, other games without")
    return GAMES[name](argument)


def of_two(table: Sequence[Sequence[float | tuple[float, float]]]) -> FloatArray:
    """Return the payoffs ``(2, A, A)`` of a table whose entries are a number, or two.

    >>> of_two([[1, (0, 4)], [0, 3]]).mean(axis=0).tolist()
    [[1.0, 2.0], [0.0, 3.0]]
    """
    pairs = [[e if isinstance(e, tuple) else (e, e) for e in row] for row in table]
    return np.moveaxis(np.array(pairs, dtype=float), -1, 0).copy()


def optimal(payoffs: FloatArray) -> FloatArray:
    """Return which joint actions ``(A, ..., A)`` have the greatest expected payoff, as 0 or 1."""
    expected = payoffs.mean(axis=0)
    return (expected == expected.max()).astype(float)


def _penalty(argument: str) -> FloatArray:
    try:
        k = float(argument)
    except ValueError:
        raise ValueError(f"K = {argument!r}: must be a number") from None
    if not isfinite(k):
        raise ValueError(f"K = {argument}: must be finite")
    return of_two([[10, 0, k], [0, 2, 0], [k, 0, 10]])


def _three(argument: str) -> FloatArray:
    of_pair = np.array(CLIMBING, dtype=float)
    digits = np.indices((3, 3, 3))
    least = np.min([of_pair[digits[i], digits[j]] for i, j in combinations(range(3), 2)], axis=0)
    return np.stack([least, least])


GAMES: dict[str, Callable[[str], FloatArray]] = {
    "climbing": lambda _: of_two(CLIMBING),
    "penalty": _penalty,
    "partially-stochastic-climbing": lambda _: of_two(PARTIALLY_STOCHASTIC),
    "stochastic-climbing": lambda _: of_two(STOCHASTIC),
    "three-agents": _three,
}
"""Payoffs by name, given what follows the name."""
