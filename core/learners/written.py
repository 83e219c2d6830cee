"""A hand-written value function over state variables: a control of learning.

The agents decide like any team, with the same predictor and the same search over joint actions. The
advantage of a learning team over this one is therefore due to learning alone.
"""

from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np

from ..numerics import FloatArray, IntArray
from ..values.rule_base import RuleBase
from .learner import LearnerSettings
from .td import Frozen


class WrittenSettings(LearnerSettings):
    """No learning: a hand-written value function. A control, like ``frozen``."""

    kind: Literal["written"] = "written"
    factory: ClassVar[str] = f"{__name__}:Written"
    value: Mapping[str, float] = {}
    """Weight of the absolute value of each named state variable; other variables have weight 0. The
    preset `hand-written` has one for boxes and arms."""


class Written(Frozen):
    """Never learns: f(s) is the sum over state variables of ``value`` times ``|s_j|``.

    Consequent weights are the values of f at the centers of the membership functions. f is exact
    for triangular ones between the outermost centers, if one center is 0.

    Raises
    ------
    ValueError
        If a variable is unknown, or no term of the rule base is over it alone.
    """

    def __init__(self, settings: WrittenSettings, rules: RuleBase, rows: IntArray) -> None:
        super().__init__(settings, rules, rows)
        self.theta[:] = _weights(settings.value, rules)


def _weights(value: Mapping[str, float], rules: RuleBase) -> FloatArray:
    """Return the consequent weights ``(n_rules,)`` of a written value."""
    weights = np.zeros(rules.n_rules)
    for name, worth in value.items():
        if name not in rules.names:
            known = ", ".join(rules.names)
            raise ValueError(f"learner.value.{name}: unknown state variable, known: {known}")
        variable = rules.names.index(name)
        if (variable,) not in rules.terms:
            raise ValueError(
                "learner.rule_base.order: must be 1, because a written value is a sum over single "
                "variables"
            )
        term = rules.terms.index((variable,))
        first = sum(rules.sizes[:term])
        centers = np.array(rules.partitions[variable].centers)
        weights[first : first + len(centers)] = worth * np.abs(centers)
    return weights
