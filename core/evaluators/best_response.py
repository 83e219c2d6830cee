"""Best responses around a plan: joint actions of large teams, found by local search.

The first agent to decide makes a plan for all agents that it sees below it. The plan starts from
the best of a few joint actions: those in which all bodies do the same, and those in which the team
is cut in two and the agents of either part do the same. (To turn a wide box half a team must slow
down, and no agent gains by doing so alone.) One round of best responses improves it: body by body,
each takes what is best while the others keep to the plan (iterated best response, Gauss-Seidel;
Shoham and Leyton-Brown 2009, Section 7.7).

Then the agents decide in the order of the hierarchy, as ever. Each values its own actions and those
of its body's agents below it; what it is told is decided, and all others are taken to keep to the
plan. An agent's plan is its own, made with its weights for those that it considers, unless one
above it that considers all others whom it does hands its plan down with what it tells, kept up with
what is decided: so in a chain. If all work out the same plan (``plan = "common"``), it is made with
the weights and tie-breaks of the first agent before anything is decided; that is no message, but
common knowledge of states and weights, and costs computing in every agent. Of what is decided
nobody learns more by it than it is told.

If the unseen are expected to keep to the plan, an agent plans for all of whom it was told nothing.

The number of joint actions tried grows linearly with the number of bodies.
"""

from abc import abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ..interface.prediction import Exploring, Prediction
from ..numerics import FloatArray, IntArray, greatest
from ..plugins.settings import unwritten
from ..values.rule_base import PooledWeights, RuleBase
from .drawing import drawn_equal
from .enumeration import combinations
from .evaluator import Aggregation, DecisionProblem, Deliberation, EvaluatorSettings

MOST_AHEAD = 4
"""Bodies that are valued at a time, if most keep to the plan: more would be valued in vain."""
CUTS = (0.25, 0.5, 0.75)
"""Where a team is cut in two, as shares of its bodies in the order of decision."""


class Search(NamedTuple):
    """What all agents look for their best responses by, who hear all."""

    pooled: PooledWeights
    """The weights of all."""
    starts: IntArray
    """``(m, n)`` the joint actions of which the best is improved."""
    worth: Callable[[IntArray], FloatArray]
    """Values joint actions."""
    order: IntArray
    """``(n,)`` the agents in the order of decision."""
    exploring: Exploring
    """How they explore."""
    rng: np.random.Generator
    """Source of randomness."""

    def begun(self) -> IntArray:
        """Return the best of the joint actions that it starts from."""
        return self.starts[greatest(self.worth(self.starts), self.rng)]


Responses = Callable[[Search], IntArray]
"""Returns the joint action ``(n,)`` that a search comes to."""


class RespondingPrediction(Prediction):
    """A prediction that knows a way of its own to the best responses of all agents."""

    @abstractmethod
    def best_responses(self, rules: RuleBase) -> Responses | None:
        """Return what `BestResponse` comes to by such rules, but sooner; None if it cannot.

        Asked for where all agents hear all, decide body by body and by the value of the team: the
        very same joint actions, with the same draws.
        """


class BestResponseSettings(EvaluatorSettings):
    """Best responses around a plan for all that are considered."""

    kind: Literal["best-response"] = "best-response"
    sweeps: Annotated[int, Field(ge=0, le=100), unwritten(1)] = 1
    """Rounds in which every body improves the plan before anything is decided. Where all hear all
    that is decided, the decisions are a round, too: with 0 they take three quarters of the time."""

    def build(self, problem: DecisionProblem) -> Aggregation:
        """Return the evaluator of a team."""
        return BestResponse(problem, self.sweeps)


class _Known(NamedTuple):
    """The values of the joint actions of one body's agents, as last computed."""

    concerned: IntArray
    plan: IntArray
    free: tuple[int, ...]
    worths: FloatArray
    """By the action of each of the k free agents, ``(A,) * k``."""

    def holds(self, concerned: IntArray, plan: IntArray) -> bool:
        """Return whether it is of the same interest, and of the plan but for the body's agents."""
        changed = np.flatnonzero(self.plan != plan).tolist()
        return self.concerned is concerned and {*changed} <= {*self.free}


class _Ahead(NamedTuple):
    """The values of the actions of several bodies in a row, while a plan stands."""

    concerned: IntArray
    plan: IntArray
    begun: int
    """Which is the first of them, in the order of decision."""
    worths: dict[tuple[int, ...], FloatArray]
    """By the free agents of every body, ``(A ** k,)``."""


class BestResponse(Aggregation):
    """Plans for other agents by rounds of best responses.

    Parameters
    ----------
    problem
        What all decisions have in common.
    sweeps
        How many.

    Raises
    ------
    ValueError
        If the teammate model is another than best response, or nobody plans for whom all are to
        have a common plan.
    """

    plans = True

    def __init__(self, problem: DecisionProblem, sweeps: int = 1) -> None:
        super().__init__(problem)
        self._sweeps = sweeps
        why = "best-response plans for 'best-response' only"
        self.require("teammates", problem.teammates, "best-response", why)
        hierarchy, groups = problem.hierarchy, problem.groups
        n = len(hierarchy)
        nobody = problem.unseen != "plan" and not any(map(hierarchy.searched, range(n)))
        if problem.plan == "common" and nobody:
            raise ValueError(
                "learner.decision.plan = 'common': nobody considers another, so that there is "
                "nothing to plan, use private, or unseen = 'plan'"
            )
        if problem.plan == "common" and problem.is_private:
            raise ValueError(
                "learner.decision.plan = 'common': agents with errors or perception of their own "
                "have no plan in common, use private"
            )
        self._planner = _planners(problem)
        self._kept_up = _kept_up(problem, self._planner)
        self._place = np.concatenate([np.arange(len(group)) for group in groups])
        self._widest = max(map(len, groups))
        sizes = range(max(2, self._widest), 0, -1)  # the largest is refused before others are made
        self._actions = {k: combinations(tuple(range(k)), self.n_actions) for k in sizes}
        self._numbers = np.arange(len(self._actions[sizes[0]]))
        # Per agent, whom it considers, itself included, in the order of decision; those of its
        # body; the others.
        considered = [{i, *hierarchy.searched(i)} for i in range(n)]
        self._free = [tuple(j for j in hierarchy.order if j in who) for who in considered]
        body = self._body_of
        self._own = [tuple(j for j in self._free[i] if body[j] == body[i]) for i in range(n)]
        self._others = [np.setdiff1d(np.arange(n), free) for free in self._free]
        self._starts: dict[tuple[int, ...], IntArray] = {}
        # The bodies in the order of decision, if what one is worth to one agent is so to all.
        whole = {*groups}
        bodies = [own for i in hierarchy.order if (own := self._own[i]) in whole]
        self._bodies = bodies if problem.value_of == "team" else []
        self._rank = {agents: k for k, agents in enumerate(self._bodies)}
        # Whether all can decide at once: by one plan that is kept up, and body by body.
        self._order = np.array(hierarchy.order)
        self._at_once = (
            {*self._planner} == {hierarchy.order[0]}
            and all(self._kept_up)
            and problem.rule == "value"
            and sweeps == 1
            and [i for own in self._bodies for i in own] == [*hierarchy.order]
            and len({*map(len, groups)}) == 1
        )
        self._plans: dict[int, IntArray] = {}
        self._known: _Known | None = None
        self._ahead: _Ahead | None = None
        self._alike: list[tuple[IntArray, IntArray]] = []

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        agent = deliberation.agent
        if self.indifferent(deliberation):
            self.expected = deliberation.joint_action
            return np.zeros(self.n_actions)
        if self.begins(deliberation):
            self._plans = {}
            self._known = self._ahead = None
            self._alike = self._compared(deliberation.prediction)
        plan, free = self._plan(deliberation), self._own[agent]
        known, concerned = self._known, self.concerned[agent]
        if known is not None and not known.holds(concerned, plan):
            known = None
        if known is not None and set(free) < set(known.free):
            worths = known.worths[*(slice(None) if i in free else plan[i] for i in known.free)]
        else:
            value = None if known is None else known.worths.item(self._index(plan, known.free))
            self.count(agent, self.n_actions ** len(free))
            worths = self._valued(deliberation, plan, free, value)
        self._known = _Known(concerned, plan.copy(), free, worths)
        # What its body does is kept in the plan; what it takes in the end may be told.
        plan[list(free)] = self._actions[len(free)][greatest(worths.ravel(), deliberation.rng)]
        self.expected = plan
        return worths.max(axis=tuple(k for k, i in enumerate(free) if i != agent))

    def decide(self, first: Deliberation, exploring: Exploring) -> IntArray | None:
        """Return what all agents decide ``(n,)``, who all hear all, by what the `first` one knows.

        None where the prediction has no way to it but to ask every agent in its turn.
        """
        if not self._at_once:
            return None
        if self.indifferent(first):
            return drawn_equal(self._order, self.n_actions, exploring, first.rng)
        prediction = first.prediction
        if not isinstance(prediction, RespondingPrediction):
            return None
        respond = prediction.best_responses(self.rules)
        if respond is None:
            return None
        starts = self._with_starts(first, self._free[first.agent])
        each = self._numbers[: self.n_actions**self._widest]
        alike = each if prediction.alike is None else prediction.alike
        distinct = np.count_nonzero(np.broadcast_to(alike, (len(self._bodies), len(each))) == each)
        self.count(first.agent, len(starts) + int(distinct) + len(each) * len(self._bodies))
        worth = partial(self.predicted_worth, first)
        pooled = self.learned(first).pooled
        return respond(Search(pooled, starts, worth, self._order, exploring, first.rng))

    def _plan(self, deliberation: Deliberation) -> IntArray:
        """Return the plan ``(n,)`` as the deciding agent knows it."""
        agent = deliberation.agent
        planner = self._planner[agent]
        if planner not in self._plans:
            self._plans[planner] = self._planned(deliberation)
        plan = self._plans[planner]
        if not self._kept_up[agent]:
            plan = plan.copy()
        known = deliberation.told if self.problem.unseen == "plan" else self._others[agent]
        plan[known] = deliberation.joint_action[known]
        return plan

    def _valued(
        self, deliberation: Deliberation, plan: IntArray, free: tuple[int, ...], value: float | None
    ) -> FloatArray:
        """Return what all actions of the k free agents of a body are worth ``(A,) * k``.

        If that of the plan is known, the `value`, it is not predicted again, nor are actions that
        come to the same.
        """
        shape = (self.n_actions,) * len(free)
        if value is None:
            tried = _with(plan, [(free, self._actions[len(free)])])
            return self.predicted_worth(deliberation, tried).reshape(shape)
        concerned, ahead = self.concerned[deliberation.agent], self._ahead
        if ahead is None or not self._stands(ahead, concerned, plan, free):
            ahead = self._ahead = self._valued_ahead(deliberation, plan, free, value)
        return ahead.worths[free].reshape(shape)

    def _stands(
        self, ahead: _Ahead, concerned: IntArray, plan: IntArray, free: tuple[int, ...]
    ) -> bool:
        """Return whether it has what a body is worth to those, by a plan that comes to the same."""
        if free not in ahead.worths or ahead.concerned is not concerned:
            return False
        changed = set(self._body_of[plan != ahead.plan].tolist())
        groups = [(self._alike[body][0], self.problem.groups[body]) for body in changed]
        return all(
            alike[self._index(plan, group)] == alike[self._index(ahead.plan, group)]
            for alike, group in groups
        )

    def _valued_ahead(
        self, deliberation: Deliberation, plan: IntArray, free: tuple[int, ...], value: float
    ) -> _Ahead:
        """Return what the free agents of a body, and of bodies after it, are worth.

        Of these the more, the more bodies in a row have kept to the plan.
        """
        begun, last, depth = self._rank.get(free, -1), self._ahead, 1
        if last is not None and begun == last.begun + len(last.worths):
            depth = min(2 * len(last.worths), MOST_AHEAD)
        bodies = [free] if begun < 0 else self._bodies[begun : begun + depth]
        parts, changes = [], []
        for agents in bodies:
            alike, distinct = self._distinct(agents)
            planned = alike[self._index(plan, agents)]
            predicted = distinct[distinct != planned]
            parts.append((agents, alike, planned, predicted))
            changes.append((agents, self._actions[len(agents)][predicted]))
        worths: dict[tuple[int, ...], FloatArray] = {}
        varied, at = _with(plan, changes), 0
        varied_worths = self.predicted_worth(deliberation, varied) if len(varied) else np.empty(0)
        for agents, alike, planned, predicted in parts:
            each = np.empty(len(alike))
            each[planned], each[predicted] = value, varied_worths[at : at + len(predicted)]
            worths[agents], at = each[alike], at + len(predicted)
        return _Ahead(self.concerned[deliberation.agent], plan.copy(), begun, worths)

    def _distinct(self, agents: tuple[int, ...]) -> tuple[IntArray, IntArray]:
        """Return what each action of a body's agents comes to the same as, and the distinct ones.

        They are compared in agent order, even where the agents of a body decide in another.
        """
        body, every = self._body_of[agents[0]], self._numbers[: len(self._actions[len(agents)])]
        return self._alike[body] if agents == self.problem.groups[body] else (every, every)

    def _planned(self, deliberation: Deliberation) -> IntArray:
        """Return a plan ``(n,)`` for the agent and those that it plans for."""
        agent, rng = deliberation.agent, deliberation.rng
        free = self._free[agent]
        if self.problem.unseen == "plan":
            told = set(deliberation.told.tolist())
            free = tuple(i for i in self.hierarchy.order if i not in told)
        bodies: dict[int, list[int]] = {}
        for i in free:
            bodies.setdefault(int(self._body_of[i]), []).append(i)
        plan, value = self._started(deliberation, free), None
        for members in self._sweeps * list(bodies.values()):
            worths = self._valued(deliberation, plan, tuple(members), value).ravel()
            distinct = self._distinct(tuple(sorted(members)))[1]
            self.count(agent, len(distinct))
            best = distinct[greatest(worths[distinct], rng)]
            plan[members], value = self._actions[len(members)][best], worths[best]
        return plan

    def _started(self, deliberation: Deliberation, free: tuple[int, ...]) -> IntArray:
        """Return the plan ``(n,)`` that the round of best responses starts from."""
        tried = self._with_starts(deliberation, free)
        return tried[greatest(self.worth(deliberation, tried), deliberation.rng)]

    def _with_starts(self, deliberation: Deliberation, free: tuple[int, ...]) -> IntArray:
        """Return the joint actions ``(m, n)`` of which the best is taken for a plan to improve."""
        if free not in self._starts:
            self._starts[free] = self._starting(free)
        return _with(deliberation.joint_action, [(free, self._starts[free])])

    def _starting(self, free: tuple[int, ...]) -> IntArray:
        """Return actions ``(m, k)`` of the k free agents, in the order of decision."""
        bodies = list(dict.fromkeys(self._body_of[list(free)].tolist()))
        rank = np.array([bodies.index(self._body_of[i]) for i in free])
        starts = [self._actions[self._widest][:, self._place[list(free)]]]
        for cut in sorted({round(share * len(bodies)) for share in CUTS} - {0, len(bodies)}):
            starts.append(self._actions[2][:, (rank >= cut).astype(np.int64)])
        return np.unique(np.concatenate(starts), axis=0)

    def _compared(self, prediction: Prediction) -> list[tuple[IntArray, IntArray]]:
        """Return for every body which action each comes to the same as, and the distinct ones."""
        sizes = [len(self._actions[len(group)]) for group in self.problem.groups]
        alike = [self._numbers] * len(sizes) if prediction.alike is None else prediction.alike
        rows = [row[:size] for row, size in zip(alike, sizes, strict=True)]
        return [(row, np.flatnonzero(row == self._numbers[: len(row)])) for row in rows]

    def _index(self, plan: IntArray, agents: tuple[int, ...]) -> int:
        """Return which of all actions of agents of one body the plan has for them."""
        index = 0
        for i in agents:
            index = index * self.n_actions + int(plan[i])
        return index


def _planners(problem: DecisionProblem) -> list[int]:
    """Return, for every agent, whose plan it decides by: its own, or one that it has or is told."""
    hierarchy, planners = problem.hierarchy, {}
    views = {i: () if problem.unseen == "plan" else hierarchy.unseen(i) for i in hierarchy.order}
    for i, view in views.items():
        same = (j for j, other in views.items() if other == view)
        if problem.plan == "private":
            givers = hierarchy.senders(i) if problem.handed_down else ()
            same = (j for j in same if j in givers)
        planners[i] = next(same, i)
    return [planners[i] for i in range(len(hierarchy))]


def _kept_up(problem: DecisionProblem, planners: list[int]) -> list[bool]:
    """Return for every agent whether its plan is kept up by those above it: it is told all of it.

    The others have a copy of the plan as it was made, in which they write what they are told.
    """
    hierarchy, kept = problem.hierarchy, {}
    for planner in set(planners):
        users = [i for i in hierarchy.order if planners[i] == planner]
        told_all = all({*users[:k]} <= {*hierarchy.senders(i)} for k, i in enumerate(users))
        kept[planner] = problem.handed_down and told_all
    return [kept[planner] for planner in planners]


def _with(joint_action: IntArray, changes: list[tuple[tuple[int, ...], IntArray]]) -> IntArray:
    """Return the joint action ``(n,)`` with some agents' actions ``(m, k)``, set by set of them."""
    rows = sum(len(actions) for _, actions in changes)
    joint, at = np.empty((rows, len(joint_action)), dtype=np.int64), 0
    joint[:] = joint_action
    for agents, actions in changes:
        joint[at : at + len(actions), agents] = actions
        at += len(actions)
    return joint
