"""Evaluators of fuzzy agents for their part of a team."""

from __future__ import annotations

from ..hierarchy.hierarchy import Hierarchy
from ..interface.abilities import PartiallyObserved
from ..interface.agents import AgentContext
from ..interface.scenario import Scenario
from ..learners.learner import LearnerSettings
from ..numerics import IntArray
from ..plugins.words import must_inherit
from ..search.budget import check_budget
from ..search.evaluator import DecisionProblem, Evaluator, ValueOf, concerned
from ..values.rule_base import RuleBase


def is_private(settings: LearnerSettings, scenario: Scenario) -> bool:
    """Return whether every agent has a view of its own, see `views`."""
    return settings.decision.errors is not None or isinstance(scenario, PartiallyObserved)


def evaluator_of(
    settings: LearnerSettings,
    rules: RuleBase,
    learned: Evaluator | None,
    context: AgentContext,
    hierarchy: Hierarchy,
    left: IntArray,
) -> Evaluator | None:
    """Return the evaluator of some agents, or None if they act at random.

    Parameters
    ----------
    settings, rules
        Settings and rule base of the agents.
    learned
        The learner, if it evaluates actions itself.
    context
        Where they act.
    hierarchy
        Hierarchy of the agents that are present; agents that have left have no edges.
    left
        ``(k,)`` agents that have left.

    Raises
    ------
    ValueError
        If they decide by values of agents of another part; one line.
    """
    decision = settings.decision
    if decision.rule == "random":
        return None
    members = context.members.tolist()
    own = set(members) - set(left.tolist())
    if decision.rule != "reward" and not context.is_whole:
        _check_values(hierarchy, set(members), decision.value_of)
    if learned is not None:
        n_tried = len(own) * len(context.scenario.action_set)
        check_budget(decision.budget, n_tried, settings.kind)
        return learned
    private = is_private(settings, context.scenario)
    problem = DecisionProblem(
        rules=rules,
        hierarchy=hierarchy,
        n_actions=len(context.scenario.action_set),
        groups=context.scenario.groups,
        rule=decision.rule,
        teammates=decision.teammates,
        discount=settings.discount,
        value_of=decision.value_of,
        unseen=decision.unseen,
        plan=decision.plan,
        handed_down=hierarchy.communication == "ancestors"
        and not context.messages_fail
        and not private,
        members=tuple(i for i in hierarchy.order if i in own) or (members[0],),
        is_private=private,
        budget=decision.budget,
    )
    evaluator: Evaluator = decision.evaluator.build(problem)
    must_inherit("learner.decision.evaluator", evaluator, Evaluator)
    if decision.budget is not None and not evaluator.keeps_budget:
        raise ValueError(
            f"learner.decision.budget = {decision.budget}: learner.decision.evaluator = "
            f"{decision.evaluator.kind!r} cannot keep to a budget; use sampling, best-response or "
            "exact"
        )
    return evaluator


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
