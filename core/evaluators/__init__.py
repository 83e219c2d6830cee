"""The values of an agent's own actions, over what the agents below it may do (Section V).

Agent i proposes each of its actions; the actions above are fixed, the unseen maintain, and the
joint actions of the agents below are tried. Their next states are predicted and valued, and the
values are aggregated per own action, by the teammate model: their maximum (best response), their
mean (uniform), or their mean weighted with how often the agents below were seen to act so
(empirical frequencies). Evaluators differ in which joint actions they try.
"""

from ..plugins.registry import SettingsRegistry
from .evaluator import EvaluatorSettings

EVALUATORS = SettingsRegistry(
    "evaluator",
    {
        "auto": f"{__name__}.exact:AutoSettings",
        "exact": f"{__name__}.exact:ExactEnumeration",
        "sampling": f"{__name__}.exact:SamplingSettings",
        "variable-elimination": f"{__name__}.coordination:VariableEliminationSettings",
        "max-plus": f"{__name__}.coordination:MaxPlusSettings",
        "best-response": f"{__name__}.best_response:BestResponseSettings",
        "cross-entropy": f"{__name__}.cross_entropy:CrossEntropySettings",
    },
    EvaluatorSettings,
)
"""Evaluators by name."""

__all__ = ["EVALUATORS", "EvaluatorSettings"]
