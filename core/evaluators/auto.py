"""The evaluator that suits a team: exact for few agents, sampled for some, planned for many.

Of many agents best responses around a plan reach greater values than a sample, in half of its time.
They are also taken for some, if the values of others decide too, and wherever there must be a plan.
"""

from typing import Annotated, Literal

from pydantic import Field

from . import EVALUATORS
from .evaluator import MOST_JOINT_ACTIONS, DecisionProblem, Evaluator, EvaluatorSettings
from .exact import Samples, SamplingSettings


class AutoSettings(EvaluatorSettings):
    """Exact enumeration as long as it is quick, then sampling, then best responses."""

    kind: Literal["auto"] = "auto"
    exact_up_to: Annotated[int, Field(ge=1, le=10)] = 5
    """Agents that may still be free for exact enumeration."""
    sampling_up_to: Annotated[int, Field(ge=1)] = 12
    """Agents that may still be free for sampling, if agents decide by their own value and expect
    best responses."""
    samples: Samples = 64
    """Joint actions that are tried by sampling, as of the evaluator ``sampling``."""

    def build(self, problem: DecisionProblem) -> Evaluator:
        """Return the evaluator of a team."""
        return self.chosen(problem).build(problem)

    def chosen(self, problem: DecisionProblem) -> EvaluatorSettings:
        """Return the settings of the evaluator that a team gets."""
        hierarchy = problem.hierarchy
        if problem.unseen == "plan" or problem.plan == "common":
            return EVALUATORS.parsed("best-response")
        free = max(1 + len(hierarchy.below(i)) for i in range(len(hierarchy)))
        if free <= self.exact_up_to and problem.n_actions ** (free - 1) <= MOST_JOINT_ACTIONS:
            return EVALUATORS.parsed("exact")
        is_large = free > self.sampling_up_to or problem.value_of != "own"
        if is_large and problem.teammates == "best-response":
            return EVALUATORS.parsed("best-response")
        return SamplingSettings(samples=self.samples)
