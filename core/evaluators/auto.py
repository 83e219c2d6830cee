"""The evaluator that suits a team: exact for few agents, sampled for some, additive for many.

If the values of others decide too, it is best responses for all but the few.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from .additive import ExtremesSettings, MomentsSettings
from .best_response import BestResponseSettings
from .evaluator import DecisionProblem, Evaluator, EvaluatorSettings
from .exact import MOST_JOINT_ACTIONS, ExactSettings
from .sampling import Samples, SamplingSettings


class AutoSettings(EvaluatorSettings):
    """Exact enumeration as long as it is quick, then sampling, then sums where there are any."""

    kind: Literal["auto"] = "auto"
    exact_up_to: Annotated[int, Field(ge=1, le=10)] = 5
    """Agents that may still be free for exact enumeration."""
    sampling_up_to: Annotated[int, Field(ge=1)] = 12
    """Agents that may still be free for sampling, if predictions can be had as sums."""
    samples: Samples = 64
    """Joint actions that are tried by sampling, as of the evaluator ``sampling``."""

    def build(self, problem: DecisionProblem) -> Evaluator:
        """Return the evaluator of a team."""
        return self.chosen(problem).build(problem)

    def chosen(self, problem: DecisionProblem) -> EvaluatorSettings:
        """Return the settings of the evaluator that a team gets."""
        hierarchy = problem.hierarchy
        free = max(1 + len(hierarchy.below(i)) for i in range(len(hierarchy)))
        if free <= self.exact_up_to and problem.n_actions**free <= MOST_JOINT_ACTIONS:
            return ExactSettings()
        best_response = problem.teammates == "best-response"
        if problem.value_of != "own" and best_response:
            return BestResponseSettings()
        by_sums = problem.additive and problem.rule == "value" and problem.value_of == "own"
        if free <= self.sampling_up_to or not by_sums:
            return SamplingSettings(samples=self.samples)
        return ExtremesSettings() if best_response else MomentsSettings()
