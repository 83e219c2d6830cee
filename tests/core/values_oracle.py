"""The paper's equations as plain NumPy over explicit feature vectors: the oracle of the kernels.

Slow on purpose: 5^7 rules cost a 78,125-element feature vector per joint action here.
"""

from __future__ import annotations

import numpy as np

from nested_agents.core.numerics import FloatArray
from nested_agents.core.values.partitions import Partition
from nested_agents.core.values.rule_base import RuleBase


def strengths(partition: Partition, x: np.ndarray) -> FloatArray:
    """Return membership degrees ``(m, size)`` of values ``(m,)`` (Eq. 6, or triangles)."""
    x, knots = np.asarray(x, dtype=float)[:, None], partition.knots
    if partition.period:
        x = x - partition.period * np.floor((x - partition.low) / partition.period)
    if partition.membership == "triangular":
        rising = np.clip((x - knots[:-1]) / np.diff(knots), 0.0, 1.0)
    else:
        slopes = partition.steepness / np.diff(knots)
        exponents = np.clip(slopes * (x - 0.5 * (knots[:-1] + knots[1:])), -700.0, 700.0)
        rising = np.minimum.accumulate(1.0 / (1.0 + np.exp(-exponents)), axis=1)
    levels = np.hstack([np.ones_like(x), rising, np.zeros_like(x)])
    degrees = levels[:, :-1] - levels[:, 1:]
    return degrees.reshape(len(x), -1, partition.size).sum(axis=1)


def values(rules: RuleBase, theta: FloatArray, states: FloatArray) -> FloatArray:
    """Return f ``(m,)`` of states ``(m, d)`` as phi times theta (Eq. 9)."""
    return rules.features(states) @ theta


def td_update(
    rules: RuleBase,
    theta: FloatArray,
    trace: FloatArray,
    states: FloatArray,
    steps: FloatArray,
    decay: float,
) -> None:
    """Update traces and weights of all agents in place (Eq. 12, 13)."""
    trace *= decay
    trace += rules.features(states)
    theta += np.asarray(steps)[:, None] * trace
