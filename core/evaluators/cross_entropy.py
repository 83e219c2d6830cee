"""Plans of several decisions by the cross-entropy method: a model-predictive controller.

The first agent to decide plans for all. Sequences of joint actions are drawn, each agent and each
decision by probabilities of their own, and valued by the discounted sum of the rewards that are
predicted on the way, from predicted states. The probabilities move to the frequencies among the
best sequences, and sequences are drawn anew (Rubinstein and Kroese 2004; as a controller with a
learned model Chua et al. 2018). What the best sequence begins with is done; the next decision plans
from nothing. It learns nothing and has the reward function: a control for what does learn.
"""

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..interface.spaces import Prediction
from ..numerics import FloatArray, IntArray
from .evaluator import Aggregation, DecisionProblem, Deliberation, EvaluatorSettings

NAME = "cross-entropy"


class CrossEntropySettings(EvaluatorSettings):
    """Plan several decisions ahead by the cross-entropy method; decides by rewards alone."""

    kind: Literal["cross-entropy"] = "cross-entropy"
    factory: ClassVar[str] = f"{__name__}:CrossEntropy"
    horizon: Annotated[int, Field(ge=1, le=50)] = 4
    """Decisions that a plan looks ahead."""
    samples: Annotated[int, Field(ge=2, le=100_000)] = 32
    """Plans that are drawn in an iteration."""
    iterations: Annotated[int, Field(ge=1, le=100)] = 3
    """How often plans are drawn."""
    elite: Annotated[float, Field(gt=0, le=1)] = 0.25
    """Fraction of the plans of an iteration whose frequencies the next one draws by."""
    smoothing: Annotated[float, Field(ge=0, le=1)] = 0.1
    """Weight of equal probabilities in those that the next iteration draws by."""


class CrossEntropy(Aggregation):
    """Gives one to the action that the plan holds for an agent, and zero to the others.

    Raises
    ------
    ValueError
        If it is not to decide by rewards, or nobody is above all others and could plan for them.
    """

    continues = True
    """It needs a prediction with ``after``."""

    def __init__(self, settings: CrossEntropySettings, problem: DecisionProblem) -> None:
        super().__init__(problem)
        self.require("rule", "reward", f"{NAME} plans by 'reward' only")
        hierarchy = problem.hierarchy
        if len(hierarchy.below(hierarchy.order[0])) < len(hierarchy) - 1:
            raise ValueError(
                f"learner.decision.evaluator = {NAME!r}: needs a topology whose first agent is "
                "above all others and plans for them, as in a chain"
            )
        self.settings = settings
        self._prediction: Prediction | None = None
        self._plan: IntArray = np.zeros(len(hierarchy), dtype=np.int64)

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        agent = deliberation.agent
        if agent == self.hierarchy.order[0] or deliberation.prediction is not self._prediction:
            self._prediction = deliberation.prediction
            self._plan = self._planned(deliberation)
        values = np.zeros(self.n_actions)
        values[self._plan[agent]] = 1.0
        return values

    def _planned(self, deliberation: Deliberation) -> IntArray:
        """Return the joint action ``(n,)`` that the best plan begins with."""
        s, rng = self.settings, deliberation.rng
        prediction: Any = deliberation.prediction
        shape = s.horizon, len(self.hierarchy), self.n_actions
        probabilities = np.full(shape, 1.0 / self.n_actions)
        n_elite = max(1, round(s.elite * s.samples))
        best: IntArray | None = None
        for _ in range(s.iterations):
            ladder = probabilities.cumsum(axis=2)[:, :, :-1]
            draws = rng.random((s.samples, *shape[:2], 1))
            plans = (draws >= ladder).sum(axis=3)
            if best is not None:
                plans[0] = best
            worths = self._worths(deliberation.agent, prediction, plans)
            elite = plans[np.argsort(-worths, kind="stable")[:n_elite]]
            best = elite[0]
            seen = (elite[..., None] == np.arange(self.n_actions)).mean(axis=0)
            probabilities = s.smoothing / self.n_actions + (1.0 - s.smoothing) * seen
        assert best is not None
        return best[0]

    def _worths(self, agent: int, prediction: Any, plans: IntArray) -> FloatArray:
        """Return what plans ``(samples, horizon, n)`` are paid, predicted once where they agree."""
        worths = np.zeros(len(plans))
        waiting = [(prediction, np.arange(len(plans)), 0)]
        while waiting:
            seen, rows, step = waiting.pop()
            tried, which = np.unique(plans[rows, step], axis=0, return_inverse=True)
            which = which.reshape(-1)
            self.count(agent, len(tried))
            worths[rows] += self.problem.discount**step * seen.rewards(tried)[which]
            if step + 1 < self.settings.horizon:
                waiting += [
                    (seen.after(j), rows[which == k], step + 1) for k, j in enumerate(tried)
                ]
        return worths
