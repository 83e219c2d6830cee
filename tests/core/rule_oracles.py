"""The paper's equations as plain NumPy over explicit feature vectors: the oracle of the kernels.

Slow on purpose: 5^7 rules cost a 78,125-element feature vector per joint action here.
"""

from __future__ import annotations

import numpy as np

from nested_agents.core.interface.prediction import Blocks
from nested_agents.core.numerics import FloatArray, IntArray
from nested_agents.core.rules.rule_base import RuleBase


def values(rules: RuleBase, theta: FloatArray, states: FloatArray) -> FloatArray:
    """Return f ``(m,)`` of states ``(m, d)`` as phi times theta (Eq. 9)."""
    return rules.features(states) @ theta


def block_values(
    rules: RuleBase, theta: FloatArray, blocks: Blocks, indices: IntArray
) -> FloatArray:
    """Return f of joint-action indices, every next state written out."""
    return values(rules, theta, blocks.states(indices))


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
