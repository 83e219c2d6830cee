"""The compiled TD(lambda) update of rule bases with any partitions."""

from ..numerics import FloatArray, IntArray, njit

MIN_TRACE = 1e-30
"""Eligibility traces below this become zero: arithmetic with denormal numbers is slow."""


@njit(cache=True)
def _value(theta: FloatArray, rules: IntArray, strengths: FloatArray) -> float:
    """Return the sum of the weights of active rules, times their strengths."""
    value = 0.0
    for a in range(len(rules)):
        value += theta[rules[a]] * strengths[a]
    return value


@njit(cache=True)
def td_lambda_update(
    theta: FloatArray,
    rows: IntArray,
    traces: FloatArray,
    active: tuple[IntArray, FloatArray],
    active_next: tuple[IntArray, FloatArray],
    rewards: FloatArray,
    constants: tuple[float, FloatArray, float],
) -> None:
    """Update the weights of every agent in turn (Eq. 7, 12 and 13).

    Parameters
    ----------
    theta
        ``(n_rows, n_rules)`` consequent weights, modified.
    rows
        ``(n,)`` row of theta of every agent.
    traces
        ``(n, n_rules)`` eligibility traces, modified.
    active, active_next
        Active rules ``(n, k)`` and strengths ``(n, k)`` of the previous states and the next ones.
    rewards
        ``(n,)`` rewards in the TD errors.
    constants
        Discount (0 if the previous states are terminal), ``(n,)`` step size of every agent, and
        the discount times the trace decay.
    """
    rules, strengths = active
    next_rules, next_strengths = active_next
    discount, step_sizes, decay = constants
    for i in range(len(rows)):
        weights = theta[rows[i]]
        trace = traces[i]
        value = _value(weights, rules[i], strengths[i])
        next_value = _value(weights, next_rules[i], next_strengths[i])
        error = rewards[i] + discount * next_value - value
        step = step_sizes[i] * error
        for k in range(len(trace)):
            decayed = decay * trace[k]
            trace[k] = decayed if abs(decayed) > MIN_TRACE else 0.0
        for a in range(rules.shape[1]):
            trace[rules[i, a]] += strengths[i, a]
        for k in range(len(trace)):
            weights[k] += step * trace[k]
