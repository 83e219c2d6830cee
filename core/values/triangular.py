"""Compiled kernels for rule bases over triangular partitions.

At most two membership functions per variable are active at a time. The active rules of a term are
the *corners* of a cube: for each variable the lower or the upper of its two active functions.
`nested_agents.core.values.rule_base` defines terms, own variables and shared variables.
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from ..numerics import FloatArray, IntArray, njit
from .partitions import Partition

Layout: TypeAlias = tuple[FloatArray, IntArray]
"""Partitions and terms as two arrays, one row per variable and one per term.

Columns of the first are `COUNT`, `PERIOD`, `LOW` and, from `KNOTS` on, the centers; those of the
second `OFFSET`, `LENGTH` and, from `FIRST` on, the variables. Passing few arrays saves time."""
COUNT, PERIOD, LOW, KNOTS = range(4)
OFFSET, LENGTH, FIRST = range(3)


def layout(partitions: Sequence[Partition], terms: Sequence[tuple[int, ...]]) -> Layout:
    """Return partitions and terms as arrays for the kernels."""
    knots = [partition.knots for partition in partitions]
    variables = np.zeros((len(partitions), KNOTS + max(map(len, knots))))
    for variable, partition, centers in zip(variables, partitions, knots, strict=True):
        variable[:KNOTS] = partition.size, partition.period, partition.low
        variable[KNOTS : KNOTS + len(centers)] = centers
    of_terms = np.full((len(terms), FIRST + len(partitions)), -1, dtype=np.int64)
    offset = 0
    for row, term in zip(of_terms, terms, strict=True):
        row[:FIRST] = offset, len(term)
        row[FIRST : FIRST + len(term)] = term
        offset += int(np.prod([partitions[j].size for j in term]))
    return variables, of_terms


@njit(cache=True, inline="always")
def _neighbors(j: int, x: float, variables: FloatArray) -> tuple[int, int, float]:
    """Return the lower and the upper active function of variable j at x, and the upper's degree."""
    count = int(variables[j, COUNT])
    period = variables[j, PERIOD]
    first = 0
    last = count - 2
    if period > 0.0:
        low = variables[j, LOW]
        if not low <= x < low + period:
            x -= period * np.floor((x - low) / period)
        # x lies between the last center of the left copy and the first center of the right copy.
        first = count - 1
        last = 2 * count - 1
    k = first
    while k < last and x >= variables[j, KNOTS + k + 1]:
        k += 1
    center = variables[j, KNOTS + k]
    degree = (x - center) / (variables[j, KNOTS + k + 1] - center)
    lower = k if k < count else k - count
    upper = lower + 1 if lower + 1 < count else 0
    return lower, upper, min(max(degree, 0.0), 1.0)


@njit(cache=True, inline="always")
def _corners(
    term: IntArray,
    variables: FloatArray,
    lowers: IntArray,
    uppers: IntArray,
    degrees: FloatArray,
    rules: IntArray,
    strengths: FloatArray,
) -> int:
    """Write the active rules of a term and their firing strengths; return how many there are."""
    rules[0] = 0
    strengths[0] = 1.0
    size = 1
    for v in range(FIRST, FIRST + term[LENGTH]):
        j = term[v]
        count = int(variables[j, COUNT])
        for c in range(size):
            rules[size + c] = rules[c] * count + uppers[j]
            strengths[size + c] = strengths[c] * degrees[j]
            rules[c] = rules[c] * count + lowers[j]
            strengths[c] = strengths[c] * (1.0 - degrees[j])
        size *= 2
    for c in range(size):
        rules[c] += term[OFFSET]
    return size


@njit(cache=True)
def _add_values(
    theta: FloatArray,
    terms: IntArray,
    own: FloatArray,
    shared: FloatArray,
    variables: FloatArray,
    out: FloatArray,
) -> None:
    """Add the value of some terms in m states to ``out`` ``(m,)``.

    The states are their own variables ``(m, n_own)`` and their shared ones ``(m, d - n_own)``.
    """
    d = len(variables)
    n_own = own.shape[1]
    lowers = np.empty(d, np.int64)
    uppers = np.empty(d, np.int64)
    degrees = np.empty(d)
    longest = 0
    for t in range(len(terms)):  # `max` takes longer to compile
        longest = max(longest, terms[t, LENGTH])
    rules = np.empty(2**longest, np.int64)
    strengths = np.empty(len(rules))
    for s in range(len(out)):
        for j in range(d):
            x = own[s, j] if j < n_own else shared[s, j - n_own]
            lowers[j], uppers[j], degrees[j] = _neighbors(j, x, variables)
        value = 0.0
        for t in range(len(terms)):
            term = terms[t]
            if term[LENGTH] == 1:
                j = term[FIRST]
                low = theta[term[OFFSET] + lowers[j]]
                value += low + degrees[j] * (theta[term[OFFSET] + uppers[j]] - low)
                continue
            n_active = _corners(term, variables, lowers, uppers, degrees, rules, strengths)
            for c in range(n_active):
                value += strengths[c] * theta[rules[c]]
        out[s] += value


@njit(cache=True)
def values_of_agents(theta: FloatArray, states: FloatArray, layout: Layout) -> FloatArray:
    """Return values ``(n, s)`` of states ``(n, s, d)`` by the rows of theta ``(n, n_rules)``."""
    variables, terms = layout
    out = np.zeros(states.shape[:2])
    for i in range(len(states)):
        _add_values(theta[i], terms, states[i], states[i, :, :0], variables, out[i])
    return out


@njit(cache=True)
def active_rules(states: FloatArray, layout: Layout) -> tuple[IntArray, FloatArray]:
    """Return the active rules ``(m, k)`` of states ``(m, d)`` and their strengths ``(m, k)``."""
    variables, terms = layout
    n_active = 0
    for t in range(len(terms)):
        n_active += 2 ** terms[t, LENGTH]
    rules = np.empty((len(states), n_active), np.int32)  # batch learners keep them all
    strengths = np.empty((len(states), n_active))
    d = len(variables)
    lowers = np.empty(d, np.int64)
    uppers = np.empty(d, np.int64)
    degrees = np.empty(d)
    of_term = np.empty(n_active, np.int64)
    products = np.empty(n_active)
    for s in range(len(states)):
        for j in range(d):
            lowers[j], uppers[j], degrees[j] = _neighbors(j, states[s, j], variables)
        start = 0
        for t in range(len(terms)):
            size = _corners(terms[t], variables, lowers, uppers, degrees, of_term, products)
            for c in range(size):
                rules[s, start + c] = of_term[c]
                strengths[s, start + c] = products[c]
            start += size
    return rules, strengths


@njit(cache=True, fastmath={"contract", "nsz"})
def _add_lines(
    theta: FloatArray,
    terms: IntArray,
    states: FloatArray,
    rows: IntArray,
    first: int,
    variables: FloatArray,
    out: FloatArray,
) -> None:
    """Add the values of terms of one variable, of k agents in m states, to ``out`` ``(m,)``.

    A piecewise linear function is its value at the first center plus a change of slope at every
    center: loops over the states have no branch. This halves the decision time of large teams.

    Parameters
    ----------
    theta, terms
        ``(k, n_rules)`` weights, and rows of the layout; terms of several variables are skipped.
    states, rows, first
        ``(b, m, ...)`` variables from number `first` on, and ``(k,)`` the row b of each agent.
    variables
        Rows of the layout.
    out
        ``(m,)``, modified.
    """
    n_states = len(out)
    xs = np.empty(n_states)
    for t in range(len(terms)):
        if terms[t, LENGTH] > 1:
            continue
        offset = terms[t, OFFSET]
        j = terms[t, FIRST]
        size = int(variables[j, COUNT])
        period = variables[j, PERIOD]
        low = variables[j, LOW]
        # On a circle the line begins at the last center of the copy before.
        start = size - 1 if period > 0.0 else 0
        end = 2 * size if period > 0.0 else size - 1
        for i in range(len(theta)):
            row = rows[i]
            value = theta[i, offset + start]
            slope = 0.0
            for s in range(n_states):
                x = states[row, s, j - first]
                xs[s] = x - period * np.floor((x - low) / period) if period > 0.0 else x
                out[s] += value
            for k in range(start, end + 1):
                center = variables[j, KNOTS + k]
                bend = -slope
                if k < end:
                    after = theta[i, offset + (k + 1) % size]
                    bend += (after - value) / (variables[j, KNOTS + k + 1] - center)
                    value = after
                slope += bend
                for s in range(n_states):
                    beyond = xs[s] - center
                    out[s] += bend * (beyond if beyond > 0.0 else 0.0)


@njit(cache=True)
def summed_values(
    weights: tuple[FloatArray, FloatArray, FloatArray],
    agents: IntArray,
    firsts: IntArray,
    terms: tuple[IntArray, IntArray, IntArray],
    own: FloatArray,
    shared: FloatArray,
    variables: FloatArray,
) -> FloatArray:
    """Return the summed value ``(m,)`` of k agents of b bodies in m states.

    Terms of variables that several agents share are valued once, by the sum of their weights.

    Parameters
    ----------
    weights
        Weights of the agents ``(k, n_rules)``, their sum by body ``(b, n_rules)``, and the sum of
        all ``(1, n_rules)``.
    agents, firsts
        ``(k,)`` indices of the agents, and ``(b + 1,)`` the first of each body among them, and k.
    terms
        Rows of the layout: terms of own variables, of a body's variables, of common variables.
    own, shared
        ``(n, m, n_own)`` own variables of all agents, ``(b, m, d - n_own)`` shared ones of bodies.
    variables
        Rows of the layout.
    """
    of_agents, of_bodies, of_all = weights
    own_terms, body_terms, common_terms = terms
    n_own = own.shape[2]
    out = np.zeros(own.shape[1])
    bodies = np.empty(len(shared), np.int64)
    for b in range(len(shared)):
        bodies[b] = b
    _add_lines(of_agents, own_terms, own, agents, 0, variables, out)
    _add_lines(of_bodies, body_terms, shared, bodies, n_own, variables, out)
    _add_lines(of_all, common_terms, shared, bodies, n_own, variables, out)
    own_terms = own_terms[own_terms[:, LENGTH] > 1]
    body_terms = body_terms[body_terms[:, LENGTH] > 1]
    common_terms = common_terms[common_terms[:, LENGTH] > 1]
    for b in range(len(shared)):
        if len(own_terms):
            for i in range(firsts[b], firsts[b + 1]):
                _add_values(of_agents[i], own_terms, own[agents[i]], shared[b], variables, out)
        if len(body_terms):
            _add_values(of_bodies[b], body_terms, own[0], shared[b], variables, out)
    if len(common_terms):
        _add_values(of_all[0], common_terms, own[0], shared[0], variables, out)
    return out
