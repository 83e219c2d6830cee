"""Inputs of decisions of fuzzy agents: one view that all share, or one view for each agent.

The agents of a team usually share one prediction and know each other's consequent weights. With
``[learner.decision.errors]``, or if every agent has its own sensors, every agent decides by a view
of its own. It then also plans for itself: agents send actions, but no plans.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..interface.abilities import PartiallyObserved
from ..interface.agents import AgentContext
from ..interface.measures import Measure
from ..interface.prediction import Prediction
from ..learners.learner import LearnerSettings
from ..numerics import FloatArray, IntArray
from ..search.errors import Errors
from ..search.evaluator import NO_AGENTS, concerned

UNKNOWN: FloatArray = np.zeros(0)
"""Weights of agents of another part, which are unknown."""
COSTS = (
    Measure("agreement", "agreement", gathering="mean", better="higher", least=0.0, greatest=1.0),
    Measure("received", "actions received", "1/decision", gathering="mean", least=0.0),
    Measure("broadcast", "states broadcast", "1/decision", gathering="mean", least=0.0),
)
"""Measures of agents with views of their own, as means of an episode: share of other agents whose
actions an agent expected rightly (with plans only; senders count as well), and numbers of received
actions and of received states of other bodies."""


OwnView = tuple[Prediction, list[FloatArray]]
"""Prediction and consequent weights of every agent, by which one agent decides."""


@dataclass
class FuzzyInputs:
    """Inputs of one decision of fuzzy agents."""

    left: FloatArray
    """``(n, d)`` present states. For learners of action values, further columns hold the received
    actions, which are filled in stage by stage."""
    previous: IntArray | None
    """``(n,)`` previous joint action, if unseen agents are assumed to repeat it; else None."""
    prediction: Prediction
    """Prediction that all agents share."""
    weights: list[FloatArray]
    """Consequent weights of every agent."""
    frequencies: FloatArray
    """``(n, A)`` relative frequencies of the actions of every agent."""
    explore: bool
    """Whether the agents explore."""
    values: dict[int, FloatArray] | None = None
    """Values ``(A,)`` of actions by agent, if the decision is inspected."""
    joint_action: IntArray | None = None
    """``(n,)`` joint action, if one search has found the actions of all agents."""
    views: dict[int, OwnView] = field(default_factory=dict)
    """Own views by agent; empty if all agents share prediction and weights."""
    decided: set[int] = field(default_factory=set)
    """Agents that have decided; absent ones do not, and learn nothing."""
    received: int = 0
    """Number of received actions."""
    expected: dict[int, IntArray] = field(default_factory=dict)
    """Joint action that an agent expected when it decided, for agents with own views and plans."""


class Views:
    """Views of agents that each have one of their own.

    Parameters
    ----------
    settings, context
        Settings and context of the agents.
    rows
        Row of weights of every agent of the team; None if its weights are unknown.
    n_rules
        Number of rules of the rule base.
    plans
        Whether the agents plan, so that they expect actions of the others.

    Attributes
    ----------
    costs
        Measures of the agents, see `COSTS`.

    """

    def __init__(
        self,
        settings: LearnerSettings,
        context: AgentContext,
        rows: list[int | None],
        n_rules: int,
        *,
        plans: bool,
    ) -> None:
        self.costs = COSTS if plans else COSTS[1:]
        self._members = context.members.tolist()
        self._rows = rows
        hierarchy = context.hierarchy
        scenario = context.scenario
        self._broadcast: FloatArray = np.full(len(hierarchy), len(scenario.groups) - 1.0)
        if isinstance(scenario, PartiallyObserved):
            self._broadcast = scenario.perceived.astype(float)
        if settings.values_actions:  # they do not predict and need only their own states
            self._broadcast = np.zeros(len(hierarchy))
        self._errors: Errors | None = None
        if settings.decision.errors is not None:
            valued = concerned(hierarchy, settings.decision.value_of)
            self._errors = Errors(settings.decision.errors, valued, rows, n_rules, context.seed)

    def by_agent(self, shared: Prediction, theta: FloatArray) -> dict[int, OwnView]:
        """Return the view of every agent: prediction and weights, with its own errors."""
        views: dict[int, OwnView] = {}
        for agent in self._members:
            own = theta if self._errors is None else self._errors.weights(agent, theta)
            views[agent] = shared.of(agent), weights_by_agent(self._rows, own)
        return views

    def decision_costs(
        self, inputs: FuzzyInputs, joint_action: IntArray, left: IntArray
    ) -> Mapping[str, float]:
        """Return agreement and communication of a decision by the names of `costs`.

        Agents that have `left` ``(k,)`` count for nothing.
        """
        share = len(self._members) / len(joint_action)  # the other parts add their shares
        spent = {
            "agreement": agreement(inputs.expected, joint_action, left) * share,
            "received": float(inputs.received),
            "broadcast": float(self._broadcast[sorted(inputs.decided)].sum()),
        }
        return {measure.name: spent[measure.name] for measure in self.costs}


def weights_by_agent(rows: list[int | None], theta: FloatArray) -> list[FloatArray]:
    """Return the consequent weights of every agent, given the row of each agent."""
    return [UNKNOWN if row is None else theta[row] for row in rows]


def agreement(
    expected: dict[int, IntArray], joint_action: IntArray, left: IntArray = NO_AGENTS
) -> float:
    """Return the share of other agents' actions that agents expected rightly, mean over agents.

    Parameters
    ----------
    expected
        Joint action ``(n,)`` that an agent expected when it decided.
    joint_action
        ``(n,)`` joint action that was then taken.
    left
        ``(k,)`` agents that have left; the others know their actions.

    Examples
    --------
    >>> agreement({0: np.array([1, 2, 0]), 1: np.array([1, 1, 3])}, np.array([1, 1, 3]))
    0.5
    """
    n_others = len(joint_action) - len(left) - 1
    if n_others < 1 or not expected:
        return 1.0
    right = 0
    for agent, plan in expected.items():
        hit = plan == joint_action
        right += int(np.delete(hit, left).sum()) - int(hit[agent])
    return right / (len(expected) * n_others)


def senders_of(settings: LearnerSettings, hierarchy: Hierarchy) -> list[list[int]]:
    """Return the agents with actions in an agent's state, in the order of decision."""
    if not settings.values_actions:
        return []
    if hierarchy.neighbors:
        raise ValueError(
            f"learner.kind = {settings.kind!r}: agents act on received actions, and neighbors send "
            "none; set topology.decision_order"
        )
    every = range(len(hierarchy))
    return [sorted(hierarchy.senders(i), key=hierarchy.order.index) for i in every]
