"""Best responses around a plan: joint actions of large teams, found by local search.

The first agent to decide makes a plan for all agents over whose actions it searches. The plan
starts from the best of a few joint actions: those in which all bodies act alike, and those in which
the team is cut in two and each part acts alike. (To turn a wide box, half a team must slow down; no
agent gains by doing so alone.) One round of best responses improves the plan: body by body, each
takes its best actions while the others keep to the plan (iterated best response, Gauss-Seidel;
Shoham and Leyton-Brown 2009, Section 7.7).

The agents then decide in the order of the hierarchy. Each values its own actions together with
those of the agents of its body below it. Actions that it was told are given, and all other agents
are assumed to keep to the plan. Each agent makes a plan with its own weights, unless an agent above
it that searches over the same agents hands its plan down with its messages, updated with the
actions decided since. This is the case in a chain. With ``plan = "common"`` all agents work out the
same plan, with the weights and tie-breaks of the first agent, before anything is decided. This
takes no message but common knowledge of states and weights, and every agent computes it. No agent
learns more of the decisions than it is told.

With ``unseen = "plan"`` an agent plans for all agents whose actions it was not told.

The number of evaluated joint actions grows linearly with the number of bodies.

With a budget, an agent first reserves the joint actions of its own decision: those of its body, or
only its own actions if its share is smaller. The rest of its share is spent on the plan: on the
joint actions to start from (a random sample of them if they are too many), then on bodies in the
order of decision, until the next body would exceed the share.
"""

from functools import partial
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from ..interface.prediction import NOT_EXPLORING, Exploring, Prediction
from ..numerics import FloatArray, IntArray, greatest
from .drawing import choose_among_equal
from .enumeration import combinations
from .evaluator import Aggregation, DecisionContext, DecisionProblem, EvaluatorSettings
from .responding import RespondingPrediction, Search

CUTS = (0.25, 0.5, 0.75)
"""Shares of the bodies, in the order of decision, at which a team is cut in two."""


class BestResponseSettings(EvaluatorSettings):
    """Best responses around a plan for all agents that are searched over."""

    kind: Literal["best-response"] = "best-response"
    sweeps: Annotated[int, Field(ge=0, le=100)] = 1
    """Rounds in which every body improves the plan before the first decision. If all agents receive
    all decisions, these are a further round: with 0 rounds, decisions take three quarters of the
    time."""

    def build(self, problem: DecisionProblem) -> Aggregation:
        """Return the evaluator of a team."""
        return BestResponse(problem, self.sweeps)


_BodyValues = tuple[IntArray, IntArray, tuple[int, ...], FloatArray]
"""Values of the joint actions of one body's agents: agents that share the averaged value, actions
``(n,)`` of all agents, the k agents that vary theirs, and values ``(A,) * k``."""


class BestResponse(Aggregation):
    """Plans for other agents by rounds of best responses.

    Parameters
    ----------
    problem
        Properties that all decisions of the team share.
    sweeps
        Number of rounds before the first decision.

    Raises
    ------
    ValueError
        If the teammate model is not ``best-response``, or a common plan is wanted where there is
        nothing to plan or agents have views of their own, or the budget is below the actions of
        every agent.
    """

    name = "best-response"
    plans = True

    def __init__(self, problem: DecisionProblem, sweeps: int = 1) -> None:
        super().__init__(problem)
        self._sweeps = sweeps
        why = "best-response plans for 'best-response' only"
        self.require("teammates", problem.teammates, "best-response", why)
        _check_common_plan(problem)
        hierarchy, groups = problem.hierarchy, problem.groups
        n = len(hierarchy)
        self._planner = _planners(problem)
        self._shares_plan = _shared_plans(problem, self._planner)
        self._place = np.concatenate([np.arange(len(group)) for group in groups])
        self._widest = max(map(len, groups))
        sizes = range(max(2, self._widest), 0, -1)  # the largest is refused before others are made
        self._actions = {k: combinations(tuple(range(k)), self.n_actions) for k in sizes}
        # By agent: the agents that it searches over and itself, in the order of decision; those of
        # its body among them; the agents outside the search.
        searched = [{i, *hierarchy.searched(i)} for i in range(n)]
        self._free = [tuple(j for j in hierarchy.order if j in who) for who in searched]
        body = self._body_of
        self._own = [tuple(j for j in self._free[i] if body[j] == body[i]) for i in range(n)]
        self._others = [np.setdiff1d(np.arange(n), free) for free in self._free]
        self._starts: dict[tuple[int, ...], IntArray] = {}
        self._shares = self.shares([self._need(i) for i in range(n)], least=self.n_actions)
        self._order = np.array(hierarchy.order)
        self._decides_jointly = self._can_decide_jointly()
        self._plans: dict[int, IntArray] = {}
        self._last: _BodyValues | None = None
        self._equivalent: list[IntArray] = []

    def _need(self, agent: int) -> int:
        """Return the maximum number of joint actions that an agent tries without a budget."""
        decision = self.n_actions ** len(self._own[agent])
        if self._planner[agent] != agent:
            return decision
        starts = len(self._starting_actions(self.hierarchy.order))
        improvements = sum(self.n_actions ** len(group) for group in self.problem.groups)
        return decision + starts + self._sweeps * improvements

    def _can_decide_jointly(self) -> bool:
        """Return whether all agents share one plan and decide body by body, by the team's value."""
        problem = self.problem
        order = problem.hierarchy.order
        bodies = [self._own[i] for i in order if self._own[i] in problem.groups]
        return (
            {*self._planner} == {order[0]}
            and all(self._shares_plan)
            and problem.rule == "value"
            and problem.value_of == "team"
            and self._sweeps == 1
            and tuple(i for agents in bodies for i in agents) == order
            and len({*map(len, problem.groups)}) == 1
            and (problem.budget is None or self._joint_need() <= problem.budget)
        )

    def _joint_need(self) -> int:
        """Return the maximum number of joint actions of a joint search."""
        decisions = sum(self.n_actions ** len(group) for group in self.problem.groups)
        return self._need(self.problem.hierarchy.order[0]) + decisions

    def values(self, context: DecisionContext) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        agent = context.agent
        if self.all_values_zero(context):
            self.expected = context.joint_action
            return np.zeros(self.n_actions)
        if self.begins(context):
            self._plans = {}
            self._last = None
            self._equivalent = self._equivalent_actions(context.prediction)
        free = self._own[agent]
        if self.n_actions ** len(free) > self._shares[agent]:
            free = (agent,)
        plan = self._plan(context, self._shares[agent] - self.n_actions ** len(free))
        last, concerned = self._last, self.concerned[agent]
        value = None
        varied: tuple[int, ...] = ()
        if last is not None and last[0] is concerned:
            changed = np.flatnonzero(last[1] != plan).tolist()
            if {*changed} <= {*last[2]}:  # the last values hold for this plan, too
                _, _, varied, known = last
                value = known.item(self._index(plan, varied))
        if set(free) < set(varied):
            values = known[*(slice(None) if i in free else plan[i] for i in varied)]
        else:
            self.count(agent, self.n_actions ** len(free))
            values = self._body_values(context, plan, free, value)
        self._last = concerned, plan.copy(), free, values
        # The plan keeps the best actions of the body; a message may then report other ones.
        best = greatest(values.ravel(), context.rng)
        plan[list(free)] = self._actions[len(free)][best]
        self.expected = plan
        return values.max(axis=tuple(k for k, i in enumerate(free) if i != agent))

    def decide(self, first: DecisionContext, exploring: Exploring) -> IntArray | None:
        """Return the joint action ``(n,)`` if one search decides for all agents, else None."""
        if not self._decides_jointly:
            return None
        if self.all_values_zero(first):
            return choose_among_equal(self._order, self.n_actions, exploring, first.rng)
        prediction = first.prediction
        if not isinstance(prediction, RespondingPrediction):
            return None
        respond = prediction.best_responses(self.rules)
        if respond is None:
            return None
        search = self._search(first, exploring)
        every = np.arange(self.n_actions**self._widest)
        alike = every if prediction.alike is None else prediction.alike
        n_bodies = len(self.problem.groups)
        distinct = np.count_nonzero(np.broadcast_to(alike, (n_bodies, len(every))) == every)
        self.count(first.agent, len(search.starts) + int(distinct) + len(every) * n_bodies)
        return respond(search)

    def _search(self, first: DecisionContext, exploring: Exploring) -> Search:
        """Return the input of one search for all agents."""
        starts = self._with_starts(first, self._free[first.agent])
        value = partial(self.predicted_worth, first)
        return Search(self.pooled(first), starts, value, self._order, exploring, first.rng)

    def prepare_kernels(self, context: DecisionContext) -> None:
        """Begin to compile what later decisions call, while all values are zero."""
        prediction = context.prediction
        if self._decides_jointly and isinstance(prediction, RespondingPrediction):
            prediction.prepare_responses(self.rules, self._search(context, NOT_EXPLORING))
        else:
            super().prepare_kernels(context)

    def _plan(self, context: DecisionContext, budget: int) -> IntArray:
        """Return the plan ``(n,)`` as the deciding agent knows it, within a budget if it is new."""
        agent = context.agent
        planner = self._planner[agent]
        if planner not in self._plans:
            self._plans[planner] = self._new_plan(context, budget)
        plan = self._plans[planner]
        if not self._shares_plan[agent]:
            plan = plan.copy()
        known = context.told if self.problem.unseen == "plan" else self._others[agent]
        plan[known] = context.joint_action[known]
        return plan

    def _body_values(
        self, context: DecisionContext, plan: IntArray, free: tuple[int, ...], value: float | None
    ) -> FloatArray:
        """Return the values ``(A,) * k`` of all actions of the k free agents of a body.

        If the `value` of the plan is known, neither the plan nor equivalent actions are predicted.
        """
        shape = (self.n_actions,) * len(free)
        actions = self._actions[len(free)]
        if value is None:
            joint = _with_actions(plan, free, actions)
            return self.predicted_worth(context, joint).reshape(shape)
        equivalent = self._equivalent_of(free)
        planned = equivalent[self._index(plan, free)]
        distinct = _distinct(equivalent)
        predicted = distinct[distinct != planned]
        values = np.empty(len(actions))
        values[planned] = value
        if len(predicted):
            joint = _with_actions(plan, free, actions[predicted])
            values[predicted] = self.predicted_worth(context, joint)
        return values[equivalent].reshape(shape)

    def _equivalent_of(self, agents: tuple[int, ...]) -> IntArray:
        """Return the first equivalent action of each action of a body's agents."""
        body = self._body_of[agents[0]]
        if agents == self.problem.groups[body]:  # otherwise equivalence is unknown
            return self._equivalent[body]
        return np.arange(self.n_actions ** len(agents))

    def _new_plan(self, context: DecisionContext, budget: int) -> IntArray:
        """Return a plan ``(n,)`` for the agent and those that it plans for."""
        agent, rng = context.agent, context.rng
        free = self._free[agent]
        if self.problem.unseen == "plan":
            told = set(context.told.tolist())
            free = tuple(i for i in self.hierarchy.order if i not in told)
        bodies: dict[int, list[int]] = {}
        for i in free:
            bodies.setdefault(int(self._body_of[i]), []).append(i)
        plan = self._start(context, free, budget)
        budget -= min(budget, len(self._starts[free]))
        value = None
        for members in self._sweeps * list(bodies.values()):
            budget -= self.n_actions ** len(members)
            if self.problem.budget is not None and budget < 0:
                break
            values = self._body_values(context, plan, tuple(members), value).ravel()
            distinct = _distinct(self._equivalent_of(tuple(sorted(members))))
            self.count(agent, len(distinct))
            best = distinct[greatest(values[distinct], rng)]
            plan[members] = self._actions[len(members)][best]
            value = values[best]
        return plan

    def _start(self, context: DecisionContext, free: tuple[int, ...], budget: int) -> IntArray:
        """Return the best ``(n,)`` of the joint actions to start from that the budget covers."""
        starts, rng = self._with_starts(context, free), context.rng
        if self.problem.budget is not None and budget < len(starts):
            if budget == 0:
                return context.joint_action.copy()
            starts = starts[rng.choice(len(starts), budget, replace=False)]
        return starts[greatest(self.worth(context, starts), rng)]

    def _with_starts(self, context: DecisionContext, free: tuple[int, ...]) -> IntArray:
        """Return the joint actions ``(m, n)`` that a plan may start from."""
        if free not in self._starts:
            self._starts[free] = self._starting_actions(free)
        return _with_actions(context.joint_action, free, self._starts[free])

    def _starting_actions(self, free: tuple[int, ...]) -> IntArray:
        """Return actions ``(m, k)`` of the k free agents, in the order of decision."""
        bodies = list(dict.fromkeys(self._body_of[list(free)].tolist()))
        rank = np.array([bodies.index(self._body_of[i]) for i in free])
        starts = [self._actions[self._widest][:, self._place[list(free)]]]
        for cut in sorted({round(share * len(bodies)) for share in CUTS} - {0, len(bodies)}):
            starts.append(self._actions[2][:, (rank >= cut).astype(np.int64)])
        return np.unique(np.concatenate(starts), axis=0)

    def _equivalent_actions(self, prediction: Prediction) -> list[IntArray]:
        """Return, by body, the first equivalent action of each action."""
        sizes = [self.n_actions ** len(group) for group in self.problem.groups]
        if prediction.alike is None:
            return [np.arange(size) for size in sizes]
        return [row[:size] for row, size in zip(prediction.alike, sizes, strict=True)]

    def _index(self, plan: IntArray, agents: tuple[int, ...]) -> int:
        """Return the index of the planned actions of agents among all of their joint actions."""
        index = 0
        for i in agents:
            index = index * self.n_actions + int(plan[i])
        return index


def _distinct(equivalent: IntArray) -> IntArray:
    """Return the actions that are the first of their equivalent ones."""
    return np.flatnonzero(equivalent == np.arange(len(equivalent)))


def _check_common_plan(problem: DecisionProblem) -> None:
    """Refuse a common plan where there is nothing to plan or agents have views of their own."""
    if problem.plan != "common":
        return
    n = len(problem.hierarchy)
    if problem.unseen != "plan" and not any(map(problem.hierarchy.searched, range(n))):
        raise ValueError(
            "learner.decision.plan = 'common': no agent searches over the actions of others, so "
            "that there is nothing to plan; use private, or unseen = 'plan'"
        )
    if problem.is_private:
        raise ValueError(
            "learner.decision.plan = 'common': agents have errors or perception of their "
            "own, so their plans differ; use private"
        )


def _planners(problem: DecisionProblem) -> list[int]:
    """Return the planner of each agent: itself, or another agent that shares its plan."""
    hierarchy, planners = problem.hierarchy, {}
    views = {i: () if problem.unseen == "plan" else hierarchy.unseen(i) for i in hierarchy.order}
    for i, view in views.items():
        same = (j for j, other in views.items() if other == view)
        if problem.plan == "private":
            givers = hierarchy.senders(i) if problem.handed_down else ()
            same = (j for j in same if j in givers)
        planners[i] = next(same, i)
    return [planners[i] for i in range(len(hierarchy))]


def _shared_plans(problem: DecisionProblem, planners: list[int]) -> list[bool]:
    """Return for every agent whether it shares an updated plan: it is told all decisions in it.

    The others have a copy of the original plan, which they update by the messages they receive.
    """
    hierarchy, kept = problem.hierarchy, {}
    for planner in set(planners):
        users = [i for i in hierarchy.order if planners[i] == planner]
        told_all = all({*users[:k]} <= {*hierarchy.senders(i)} for k, i in enumerate(users))
        kept[planner] = problem.handed_down and told_all
    return [kept[planner] for planner in planners]


def _with_actions(joint_action: IntArray, agents: tuple[int, ...], actions: IntArray) -> IntArray:
    """Return joint actions ``(m, n)``: one with the actions ``(m, k)`` of some agents replaced."""
    joint = np.tile(joint_action, (len(actions), 1))
    joint[:, agents] = actions
    return joint
