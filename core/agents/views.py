"""What fuzzy agents decide by: one view that all share, or a view of each agent's own.

As a rule the agents of a team share one prediction and know each other's consequent weights. With
``[learner.decision.errors]``, or in a scenario that agents perceive each for itself, every agent
decides by
a view of its own. Then it plans for itself, too: no plan is handed down, and what it is told are
actions alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..interface.agents import AgentContext
from ..interface.experience import Observation
from ..interface.measures import Measure
from ..interface.prediction import Prediction
from ..learners.learner import LearnerSettings
from ..models.team_model import TeamModel
from ..numerics import FloatArray, IntArray
from ..search.errors import Errors
from ..search.evaluator import concerned

UNKNOWN: FloatArray = np.zeros(0)
"""The weights of agents of another part."""
COSTS = (
    Measure("agreement", "agreement", gathering="mean", better="higher", least=0.0, greatest=1.0),
    Measure("received", "actions received", "1/decision", gathering="mean", least=0.0),
    Measure("broadcast", "states broadcast", "1/decision", gathering="mean", least=0.0),
)
"""What is measured of agents with views of their own, as means of an episode: in how many of the
others an agent was right about what they then did (those that told it are among them), where it
makes plans; and what was
communicated in a decision, the actions told and the states of other bodies sent to an agent."""


class OwnView(NamedTuple):
    """What one agent decides by."""

    prediction: Prediction
    """What it predicts joint actions to lead to."""
    weights: list[FloatArray]
    """What it takes for the consequent weights of every agent."""


@dataclass
class FuzzyInputs:
    """What fuzzy agents decide by."""

    left: FloatArray
    """``(n, d)`` the states that they are in; where they value actions, with a column for each
    action that they are told, filled in stage by stage."""
    previous: IntArray | None
    """``(n,)`` what all did in the decision before; none: there was none, or nobody asks."""
    prediction: Prediction
    """What joint actions would lead to."""
    weights: list[FloatArray]
    """The consequent weights of every agent."""
    frequencies: FloatArray
    """``(n, A)`` how often each agent was seen to take each action, rows summing to one."""
    explore: bool
    """Whether they explore."""
    values: dict[int, FloatArray] | None = None
    """Values ``(A,)`` of actions by agent, if the decision is inspected."""
    joint_action: IntArray | None = None
    """``(n,)`` the joint action, if one search has found the actions of all agents."""
    views: dict[int, OwnView] = field(default_factory=dict)
    """By agent, what it decides by in place of prediction and weights; empty: all by these."""
    expected: dict[int, IntArray] = field(default_factory=dict)
    """By agent with a view and a plan, the joint action that it expected when it decided."""
    agreement: float = 1.0
    """How far these were right, see `nested_agents.core.agents.views`."""


class Views:
    """The views of agents that each have one of their own.

    Parameters
    ----------
    settings, context
        Of the agents.
    rows
        Per agent of the team the row of its weights; none: they are not known.
    n_rules
        Rules of the rule base.
    model
        What they predict by.
    plans
        Whether they make plans, so that they expect something of the others.

    Attributes
    ----------
    costs
        What is measured of them in an episode.

    Raises
    ------
    ValueError
        If constants shall be wrong that the scenario's predictor has not; one line.
    """

    def __init__(
        self,
        settings: LearnerSettings,
        context: AgentContext,
        rows: list[int | None],
        n_rules: int,
        model: TeamModel,
        *,
        plans: bool,
    ) -> None:
        self.costs = COSTS if plans else COSTS[1:]
        self._members = context.members.tolist()
        self._rows = rows
        self._model = model
        hierarchy = context.hierarchy
        # Who values its own actions where it is predicts nothing, and needs no state but its own.
        perceived = context.scenario.perceived[context.members]
        self._broadcast = 0.0 if settings.values_actions else float(perceived.sum())
        self._errors: Errors | None = None
        if settings.decision.errors is not None:
            bodies = context.scenario.embodiment() if settings.decision.errors.constants else None
            whose = concerned(hierarchy, settings.decision.value_of)
            n_constants = 0 if bodies is None else len(bodies.constants)
            self._errors = Errors(
                settings.decision.errors, whose, rows, n_rules, n_constants, context.seed
            )

    def by_agent(
        self, seen: Observation, shared: Prediction, theta: FloatArray
    ) -> dict[int, OwnView]:
        """Return by agent what it takes for true, of a prediction and of weights."""
        views: dict[int, OwnView] = {}
        for agent in self._members:
            prediction = shared
            own = theta
            if self._errors is not None:
                own = self._errors.weights(agent, theta)
                constants = self._errors.constants(agent)
                if constants is not None:
                    prediction = self._model.predict(seen, constants) or shared
            views[agent] = OwnView(prediction.of(agent), weights_by_agent(self._rows, own))
        return views

    def decision_costs(self, inputs: FuzzyInputs, hierarchy: Hierarchy) -> Mapping[str, float]:
        """Return how far expectations were right, and what was communicated in a decision."""
        share = len(self._members) / len(hierarchy)  # those of other parts add theirs
        spent = {
            "agreement": inputs.agreement * share,
            "received": float(sum(len(hierarchy.senders(i)) for i in self._members)),
            "broadcast": self._broadcast,
        }
        return {measure.name: spent[measure.name] for measure in self.costs}


def weights_by_agent(rows: list[int | None], theta: FloatArray) -> list[FloatArray]:
    """Return the consequent weights of every agent by the rows that agents have."""
    return [UNKNOWN if row is None else theta[row] for row in rows]


def agreement(expected: dict[int, IntArray], joint_action: IntArray) -> float:
    """Return in how many of the others an agent was right, on average, as a share.

    Parameters
    ----------
    expected
        By agent, the joint action ``(n,)`` that it expected when it decided.
    joint_action
        ``(n,)`` what all then did.

    Examples
    --------
    >>> agreement({0: np.array([1, 2, 0]), 1: np.array([1, 1, 3])}, np.array([1, 1, 3]))
    0.5
    """
    n = len(joint_action)
    if n == 1 or not expected:
        return 1.0
    right = 0
    for agent, plan in expected.items():
        hit = plan == joint_action
        right += int(hit.sum()) - int(hit[agent])
    return right / (len(expected) * (n - 1))


def senders_of(settings: LearnerSettings, hierarchy: Hierarchy) -> list[list[int]]:
    """Return, by agent, whose actions are part of its state, in the order of decision."""
    if not settings.values_actions:
        return []
    if hierarchy.neighbors:
        raise ValueError(
            f"learner.kind = {settings.kind!r}: agents act on received actions, and neighbors send "
            "none; set topology.decision_order"
        )
    every = range(len(hierarchy))
    return [sorted(hierarchy.senders(i), key=hierarchy.order.index) for i in every]
