"""Fitted Q iteration: action values without a predictor (Ernst, Geurts and Wehenkel 2005).

An agent evaluates its own actions in its present state, given the actions that it is told. It needs
no predictor and does not search over the actions of others. Its rule base is over its state
variables and, for each sender, a variable with a membership function at every action and one for
a missing sender. Every rule has one consequent per action. The hierarchy thus determines the inputs
of an agent's policy; agents without messages are independent learners.

Learning is that of batch TD with another target. Let x be the knowledge of an agent at a decision,
u its action, r the reward, and (x', u') the next decision::

    Q(x, u) = r + gamma max_v Q(x', v)

The maximum is over the agent's own actions; messages are part of x'. There is one reward and one
target for each *joint* step, so that no agent learns from another agent's turn.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from ..interface.agents import Counts
from ..interface.spaces import ActionSet, StateSpace, choice
from ..numerics import FloatArray, IntArray
from ..plugins.models import Plugged
from ..plugins.settings import Positive
from ..search.evaluator import DecisionContext, Evaluator
from ..search.exploration import EXPLORATIONS, BurstExploration, ExplorationSettings
from ..search.settings import DecisionSettings
from ..values.partitions import Partition
from ..values.rule_base import RuleBase
from .batch import BatchTD, Function, add_gram, row_values, solver
from .learner import LearnerSettings


class FittedQSettings(LearnerSettings):
    """Fitted Q iteration: action values without a predictor."""

    kind: Literal["fitted-q"] = "fitted-q"
    factory: ClassVar[str] = f"{__name__}:FittedQ"
    values_actions = True
    ridge: Positive = 0.1
    """Penalty on squared weights, relative to squared errors of rewards scaled by 100."""
    regression_iterations: Annotated[int, Field(ge=1, le=10_000)] = 8
    """Number of regressions per update, each with new targets."""
    target_averaging_rate: Annotated[float, Field(gt=0, le=1)] = 1.0
    """Step from the old weights to those of the last regression."""
    interval: Annotated[int, Field(ge=1)] = 1_000_000
    """Number of decisions between updates within an episode."""
    trace_decay: ClassVar[float] = 0.0
    forgetting: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """Share of its weight that old experience loses per update, because its rewards depend on the
    former actions of the other agents."""
    mirrored: bool = False
    """Whether to learn from the mirror image of every step, too; only for agents without
    messages."""
    exploration: Annotated[ExplorationSettings, Plugged(EXPLORATIONS)] = BurstExploration(
        rate=1.0, decay=0.85, floor=0.05, length=1.0
    )
    """Exploration. Without a predictor, agents begin with random actions."""

    @property
    def is_mirrored(self) -> bool:
        """Whether to learn from the mirror image of every step, too."""
        return self.mirrored

    def rules_over(
        self, space: StateSpace, actions: ActionSet, n_told: int
    ) -> tuple[StateSpace, RuleBase]:
        """Return the inputs of the value function, the own action last, and their rule base."""
        self._check_decision()
        if self.mirrored and n_told:
            raise ValueError(
                "learner.mirrored = true: messages have no mirror image; set "
                "topology.communication = 'none'"
            )
        told = [choice(f"told{k + 1}", (*actions.names, "missing")) for k in range(n_told)]
        names = tuple(variable.name for variable in told)
        known = StateSpace(
            space.name, (*space.variables, *told), space.n_own, actions=(*space.actions, *names)
        )
        base = RuleBase.build(known, self.rule_base)
        action = choice("action", actions.names)
        own = Partition.of(action, self.rule_base.membership, None, self.rule_base.steepness)
        terms = [(*term, len(base.partitions)) for term in base.terms]
        rules = RuleBase((*base.partitions, own), terms)
        return StateSpace(space.name, (*known.variables, action)), rules

    def _check_decision(self) -> None:
        """Refuse decision settings that need a predictor."""
        given, usual = dict(self.decision), dict(DecisionSettings())
        for key in ("teammates", "value_of", "plan", "evaluator"):
            if given[key] != usual[key]:
                value = self.decision.evaluator.kind if key == "evaluator" else given[key]
                raise ValueError(
                    f"learner.decision.{key} = {value!r}: fitted-q predicts nothing and decides by "
                    "its own value; leave it out, or set preset = 'fitted-q'"
                )
        if self.decision.rule not in ("value", "random") or self.decision.unseen == "plan":
            raise ValueError(
                "learner.decision: fitted-q has neither predicted rewards nor plans, allowed: rule "
                "= value or random, unseen = maintain or last"
            )
        if self.self_model.enabled or self.calibration.enabled:
            raise ValueError("learner.self_model, calibration: fitted-q has no predictor to adapt")


class FittedQ(BatchTD, Evaluator):
    """Fitted Q iteration: learns action values and evaluates actions by them.

    Weights are laid out rule by rule, the own action last: ``theta.reshape(-1, A)`` has a column
    for each action. The normal equations are kept separately for each action. Every decision is
    added to them once.
    """

    values_decisions = True

    def __init__(self, settings: FittedQSettings, rules: RuleBase, rows: IntArray) -> None:
        super().__init__(settings, rules, rows)
        self.counts = Counts()
        self._n_actions = rules.partitions[-1].size
        self._known = RuleBase(rules.partitions[:-1], [term[:-1] for term in rules.terms])
        k = self._known.n_rules
        self._gram: FloatArray = np.zeros((len(self.theta), self._n_actions, k, k))
        self._weights: list[FloatArray] = [np.zeros(0)] * len(self.theta)
        """Weight of each decision in the sums, by row."""

    def values(self, context: DecisionContext) -> FloatArray:
        """Return the value ``(A,)`` of each action in the agent's present state."""
        active, strengths = self._known.active(context.present[[context.agent]])
        self.counts.joint_actions += self._n_actions
        self.counts.rule_evaluations += len(context.own_weights)
        weights = context.own_weights.reshape(-1, self._n_actions)
        return strengths[0] @ weights[active[0]]

    def observe_decision(
        self,
        left: FloatArray,
        joint_action: IntArray,
        states: FloatArray,
        reward: float | FloatArray,
        terminated: bool,
        duration: int = 1,
    ) -> int:
        """Store a decision with its outcome; regress if an update is due."""
        known = np.column_stack([left, joint_action])
        return self.observe(known, reward, terminated, duration)

    def _active_of(self, states: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the active rules of decisions, by the action that was taken, and strengths."""
        active, strengths = self._known.active(states[:, :-1])
        return active * self._n_actions + states[:, -1:].astype(np.int64), strengths

    def _equations(self, row: int, known: FloatArray) -> tuple[FloatArray, Function, Function]:
        """Solve as in batch TD, by action. The value of a state is that of its best action."""
        (taken, strengths), n_actions = self._active[row], self._n_actions
        active, ridge = taken // n_actions, self.settings.ridge * np.eye(self._known.n_rules)
        gram, weights = self._sums(row, known)
        solvers = [solver(own + ridge) for own in gram]

        def values_of(theta: FloatArray) -> FloatArray:
            columns = np.ascontiguousarray(theta.reshape(-1, n_actions).T)
            return np.max([row_values(own, active, strengths) for own in columns], axis=0)

        def solve(moment: FloatArray) -> FloatArray:
            columns = zip(solvers, moment.reshape(-1, n_actions).T, strict=True)
            return np.stack([solve_one(own) for solve_one, own in columns], axis=1).ravel()

        return weights, values_of, solve

    def _sums(self, row: int, known: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the sums of phi phi' ``(A, k, k)`` of a row, and the weights ``(N,)`` in them.

        Old sums are reduced by `forgetting`, then new decisions are added. The last decision of a
        running episode is added later, because its outcome is unknown.
        """
        end = len(known) - self._is_running * self._counts[row]
        new = slice(len(self._weights[row]), end)
        kept = 1.0 - self.settings.forgetting
        taken, strengths = self._active[row]
        self._gram[row] *= kept
        self._weights[row] = np.append(kept * self._weights[row], known[new])
        self._add(row, taken[new], strengths[new], known[new])
        return self._gram[row], np.append(self._weights[row], np.zeros(len(known) - end))

    def _add(self, row: int, taken: IntArray, strengths: FloatArray, weights: FloatArray) -> None:
        """Add phi phi' of weighted decisions to the sums of a row, each to that of its action."""
        for action, gram in enumerate(self._gram[row]):
            of_action = weights * (taken[:, 0] % self._n_actions == action)
            add_gram(gram, taken // self._n_actions, strengths, of_action)

    def state_dict(self) -> dict[str, FloatArray]:
        """Return weights, all experience, and its sums."""
        held = np.cumsum([len(weights) for weights in self._weights])
        sums = {"gram": self._gram, "weights": np.concatenate(self._weights), "held": held}
        return super().state_dict() | sums

    def load_state_dict(self, state: Mapping[str, FloatArray]) -> None:
        """Continue from a `state_dict`."""
        super().load_state_dict(state)
        self._gram = state["gram"].copy()
        self._weights = np.split(state["weights"], state["held"].astype(int)[:-1])

    def warm_start(self, former: Self, rows: IntArray) -> None:
        """Start from the weights and experience of another team, between its episodes.

        The number of messages may differ: see `carried_weights` and `_with_told`.

        Raises
        ------
        ValueError
            If it differs and rules have several variables.
        """
        super().warm_start(former, rows)
        self._weights = [former._weights[row].copy() for row in rows]
        if former.rules.n_rules == self.rules.n_rules:
            self._gram = former._gram[rows]
            return
        self.theta = carried_weights(former.rules, self.rules, self.theta)
        self._experience["states"] = [self._with_told(self._all("states"))]
        for row, weights in enumerate(self._weights):
            taken, strengths = self._active_of(self.states_of(row)[: len(weights)])
            self._add(row, taken, strengths, weights)

    def _with_told(self, states: FloatArray) -> FloatArray:
        """Return earlier decisions with this team's number of messages; mark missing senders."""
        missing = max(len(self.rules.partitions) - states.shape[1], 0)
        known = states[:, : len(self.rules.partitions) - 1 - missing]
        nobody = np.full((len(states), missing), float(self._n_actions))
        return np.hstack([known, nobody, states[:, -1:]])


def carried_weights(former: RuleBase, rules: RuleBase, theta: FloatArray) -> FloatArray:
    """Convert the weights ``(k, n)`` of one rule base to those ``(k, n_rules)`` of another.

    The rule bases differ in the number of messages only. The value does not depend on a new
    message; a removed message is fixed to a missing sender.

    Raises
    ------
    ValueError
        If rules have several variables besides the own action.
    """
    if max(len(term) for base in (former, rules) for term in base.terms) > 2:
        raise ValueError(
            "learner.rule_base.order: agents receive another number of messages than when they "
            "learned, which needs order = 1"
        )
    blocks = np.split(theta, np.cumsum(former.sizes)[:-1], axis=1)
    kept = blocks[: len(rules.sizes)]
    n_actions = rules.partitions[-1].size
    for block in blocks[len(kept) :]:  # the last membership function is that of a missing sender
        kept[0] = kept[0] + np.tile(block[:, -n_actions:], rules.sizes[0] // n_actions)
    new = [np.zeros((len(theta), size)) for size in rules.sizes[len(kept) :]]
    return np.concatenate([*kept, *new], axis=1)
