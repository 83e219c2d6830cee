"""The values of an agent's own actions, over what the agents below it may do (Section V).

Agent i proposes each of its actions; the actions above are fixed, the unseen maintain, and the
joint actions of the agents below are tried. Their next states are predicted and valued, and the
values are aggregated per own action, by the teammate model: their maximum (best response), their
mean (uniform), or their mean weighted with how often the agents below were seen to act so
(empirical frequencies). Evaluators differ in which joint actions they try.
"""

from .evaluator import EVALUATORS, EvaluatorSettings

__all__ = ["EVALUATORS", "EvaluatorSettings"]
