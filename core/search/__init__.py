"""Search over joint actions: values of an agent's own actions (Section V).

Agent i considers each of its actions together with joint actions of the agents below it. The
actions of the agents above are given, and unseen agents maintain. The next states are predicted and
evaluated, and the values are aggregated per own action by the teammate model: the maximum
(best response), the mean (uniform), or the mean weighted by observed frequencies (empirical).
Evaluators differ in the joint actions that they evaluate.
"""

from .evaluator import EVALUATORS, EvaluatorSettings

__all__ = ["EVALUATORS", "EvaluatorSettings"]
