"""Search of fuzzy agents for their part of a team."""

from __future__ import annotations

from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.stages import is_fully_communicating
from ..interface.abilities import PartiallyObserved
from ..interface.agents import AgentContext, Counts
from ..interface.prediction import Prediction
from ..learners.learner import LearnerSettings
from ..numerics import IntArray
from ..plugins.words import must_inherit
from ..search.budget import check_budget
from ..search.evaluator import NO_AGENTS, DecisionProblem, Evaluator, ValueOf, concerned
from ..values.rule_base import RuleBase


class TeamSearch:
    """Search of some agents for their actions, also after agents have left the team.

    Parameters
    ----------
    settings, rules
        Settings and rule base of the agents.
    learned
        The learner, if it evaluates actions itself.
    context
        Where the agents act.

    Attributes
    ----------
    evaluator
        Evaluates actions; None if actions are drawn at random.
    hierarchy
        Hierarchy of the agents that are present; agents that have left have no edges.
    left, actions_of_left
        ``(k,)`` agents that have left, and their actions, which all agents know.
    is_private
        Whether every agent has a view of its own, see `views`.
    is_joint
        Whether one search finds the actions of all agents, if the evaluator has one.

    Raises
    ------
    ValueError
        If the agents decide by values of agents of another part; one line.
    """

    def __init__(
        self,
        settings: LearnerSettings,
        rules: RuleBase,
        learned: Evaluator | None,
        context: AgentContext,
    ) -> None:
        self._settings = settings
        self._rules = rules
        self._learned = learned
        self._context = context
        self._is_checked = False
        self.hierarchy = context.hierarchy
        self.left = NO_AGENTS
        self.actions_of_left = NO_AGENTS
        is_partial = isinstance(context.scenario, PartiallyObserved)
        self.is_private = is_partial or settings.decision.errors is not None
        self.evaluator = self._build()
        self._evaluators = {self.hierarchy: self.evaluator}
        self.is_joint = (
            self.evaluator is not None
            and type(self.evaluator).decide is not Evaluator.decide
            and context.is_whole
            and not self.is_private
            and not context.messages_fail
            and is_fully_communicating(self.hierarchy)
        )

    def _build(self) -> Evaluator | None:
        """Return the evaluator for the agents that are present."""
        decision = self._settings.decision
        if decision.rule == "random":
            return None
        context = self._context
        members = context.members.tolist()
        present = set(members) - set(self.left.tolist())
        n_actions = len(context.scenario.action_set)
        if decision.rule != "reward" and not context.is_whole:
            _check_values(self.hierarchy, set(members), decision.value_of)
        if self._learned is not None:
            check_budget(decision.budget, len(present) * n_actions, self._settings.kind)
            return self._learned
        is_informed = not context.messages_fail and not self.is_private
        problem = DecisionProblem(
            rules=self._rules,
            hierarchy=self.hierarchy,
            n_actions=n_actions,
            groups=context.scenario.groups,
            discount=self._settings.discount,
            handed_down=is_informed and self.hierarchy.communication == "ancestors",
            members=tuple(i for i in self.hierarchy.order if i in present) or (members[0],),
            is_private=self.is_private,
            **decision.model_dump(exclude={"evaluator", "errors"}),
        )
        evaluator: Evaluator = decision.evaluator.build(problem)
        must_inherit("learner.decision.evaluator", evaluator, Evaluator)
        if decision.budget is not None and not evaluator.keeps_budget:
            raise ValueError(
                f"learner.decision.budget = {decision.budget}: learner.decision.evaluator = "
                f"{decision.evaluator.kind!r} cannot keep to a budget; use sampling, "
                "best-response or exact"
            )
        return evaluator

    @property
    def counts(self) -> Counts:
        """Number of evaluations so far."""
        return Counts() if self.evaluator is None else self.evaluator.counts

    def rearrange(self, hierarchy: Hierarchy, left: IntArray, actions: IntArray) -> None:
        """Search in a repaired hierarchy, without the agents that have left."""
        counts = self.counts
        self.hierarchy = hierarchy
        self.left = left
        self.actions_of_left = actions
        if hierarchy not in self._evaluators:
            self._evaluators[hierarchy] = self._build()
        self.evaluator = self._evaluators[hierarchy]
        if self.evaluator is not None:
            self.evaluator.counts = counts

    def check(self, prediction: Prediction, neutral: IntArray) -> None:
        """Refuse a prediction without what the search requires, when first used.

        Raises
        ------
        ValueError
            If rewards or predictions from predicted states are missing; one line.
        """
        rule = self._settings.decision.rule
        if self._is_checked or self.evaluator is None or rule == "value":
            return
        if prediction.rewards(neutral[None]) is None:
            raise ValueError(
                f"learner.decision.rule = {rule!r}: no rewards are predicted, use value"
            )
        if self.evaluator.continues and prediction.after(neutral) is None:
            raise ValueError(
                "learner.decision.evaluator: plans of several decisions need a scenario that "
                "predicts from predicted states"
            )
        self._is_checked = True


def _check_values(hierarchy: Hierarchy, own: set[int], value_of: ValueOf) -> None:
    """Refuse to decide by values of agents of other parts, because their weights are unknown."""
    agents = hierarchy.agents
    valued = concerned(hierarchy, value_of)
    for agent in own:
        for other in sorted(set(valued[agent].tolist()) - own):
            raise ValueError(
                f"learner.decision.value_of = {value_of!r}: values of {agents[other]!r} are "
                f"unknown to {agents[agent]!r}, which belongs to another part; use 'own'"
            )
