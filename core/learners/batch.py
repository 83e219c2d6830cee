"""Learning by ridge regression on all experience (Ernst, Geurts and Wehenkel 2005).

After every episode, and during long ones, several times over: give every after-state s in memory a
target, and find the weights that minimise the squared errors of f plus ``ridge`` times the squared
weights. Batch TD(lambda) aims at the lambda-return of what followed. Targets are clipped to the
range that discounted sums of the rewards seen so far can reach: no extrapolation can run away.
Agents that share weights share the regression: the experience of all of them is pooled.

Fitted Q regresses values of actions, without a predictor. An agent values its own actions in the
state that it is in, given the actions that it is told; it needs no prediction of where they lead,
and considers nobody. Its rule base is over its state variables and, for each agent that tells it
something, a variable with a membership function at every action and one for ``nobody``; every rule
has as many consequents as the agent has actions. So the hierarchy says what an agent can make its
action depend on: agents that are told nothing are independent learners.

Learning is that of batch TD, but for the target. With x what an agent
knew at a decision, u what it did then, r what all this paid, and (x', u') the next decision::

    Q(x, u) = r + gamma max_v Q(x', v)

The maximum is the agent's own: what it was told is part of x', and is not maximised over. There is
one reward and one target for each *joint* step, so that no agent learns from another's turn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ..decision.exploration import EXPLORATIONS, BurstExploration, ExplorationSettings
from ..evaluators.evaluator import Counts, Deliberation
from ..interface.spaces import ActionSet, StateSpace, choice
from ..numerics import FloatArray, IntArray, njit
from ..plugins.registry import Plugged
from ..plugins.settings import Fraction, Positive
from ..rules.kernels.fuzzy import Partition
from ..rules.rule_base import RuleBase
from .learner import Decision, LearnerSettings

TERMINAL, CUT_OFF = -1, -2
"""In place of the index of the next after-state: it is entered for ever; it is not known."""
REWARD_SCALE = 100.0
"""Rewards are of the order of 0.01; the ridge weighs against rewards times this."""
MOST_RULES = 4096
"""Of one agent: more make normal equations that take too long to be solved densely."""
Function = Callable[[FloatArray], FloatArray]


class BatchTDSettings(LearnerSettings):
    """Batch TD(lambda): towards what followed, regressing on all experience."""

    kind: Literal["batch-td"] = "batch-td"
    factory: ClassVar[str] = f"{__name__}:BatchTD"
    ridge: Positive = 10.0
    """Weight of the squared consequents against squared errors of rewards scaled by 100: larger, if
    values are jagged; smaller, if they are flat."""
    regression_iterations: Annotated[int, Field(ge=1, le=10_000)] = 30
    """Regressions on freshly discounted targets each time."""
    target_averaging_rate: Annotated[float, Field(gt=0, le=1)] = 0.5
    """Share of the way that the weights go towards the last regression's: below 1 the policy does
    not jump from episode to episode."""
    interval: Annotated[int, Field(ge=1)] = 100
    """Decisions of an episode after which is regressed without waiting for its end."""
    mirrored: bool = False
    """Whether what the mirror image of the team would have met is experience as well."""
    trace_decay: Fraction = 0.0
    """Trace decay lambda: 0 bootstraps from the next state, 1 sums the rewards of an episode."""


def solver(gram: FloatArray) -> Function:
    """Return what solves ``gram theta = moment`` for theta, the matrix being factored once."""
    from scipy.linalg import cho_factor
    from scipy.linalg.lapack import dpotrs  # `cho_solve` without what that does around it

    factor, lower = cho_factor(gram, check_finite=False)
    return lambda moment: dpotrs(factor, moment, lower)[0]


class Earlier(NamedTuple):
    """After-states of a row that agents of another team met."""

    states: FloatArray
    """``(m, d)``."""
    rewards: FloatArray
    """``(m,)``, as they were received."""
    follower: IntArray
    """``(m,)`` index of the next after-state among them, `TERMINAL` or `CUT_OFF`."""


class BatchTD:
    """Batch TD(lambda): a memory of after-states, and regressions on all of them.

    Raises
    ------
    ValueError
        If the rule base is too large for its normal equations to be solved densely.
    """

    def __init__(self, settings: Any, rules: RuleBase, rows: IntArray) -> None:
        if rules.n_rules > MOST_RULES:
            raise ValueError(
                f"learner.kind: batch learners solve for all rules at once: {rules.n_rules} rules, "
                f"allowed up to {MOST_RULES}; lower learner.rule_base.order"
            )
        self.settings, self.rules, self._n_agents = settings, rules, len(rows)
        self.members = [np.flatnonzero(rows == row) for row in range(int(rows.max()) + 1)]
        """The agents ``(k,)`` of every row."""
        self.theta: FloatArray = np.zeros((len(self.members), rules.n_rules), rules.dtype)
        d = len(rules.partitions)
        nothing = Earlier(np.zeros((0, d)), np.zeros(0), np.zeros(0, dtype=np.int64))
        self._earlier = [nothing] * len(self.members)
        self._states: list[FloatArray] = []
        self._rewards: list[FloatArray] = []
        self._follower: list[int] = []
        self._begun = 0  # the first after-state of the running episode
        # By row, active rules and strengths of the after-states so far regressed on.
        self._active: list[tuple[IntArray, FloatArray]] = []
        self._regressed = 0
        # By row, the ridge and the sum of phi phi' over so many of these.
        self._summed: dict[int, tuple[FloatArray, int]] = {}

    def begin_episode(self) -> None:
        """Note that the first after-state follows none, even if the last episode was given up."""
        self._cut_off()
        self._begun = len(self._states)

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Remember an after-state; regress if the episode has gone on for long enough."""
        self._states.append(states.copy())
        self._rewards.append(np.broadcast_to(np.asarray(reward, dtype=float), (len(states),)))
        self._follower.append(TERMINAL if terminated else len(self._states))
        lasted = len(self._states) - self._begun
        return 0 if terminated or lasted % self.settings.interval else self._regress()

    def end_episode(self) -> int:
        """Regress on all experience."""
        self._cut_off()
        return self._regress() if self._states else 0

    def _cut_off(self) -> None:
        if self._follower and self._follower[-1] == len(self._states):
            self._follower[-1] = CUT_OFF

    def _regress(self) -> int:
        """Return how many weights have changed: all of them."""
        self._extend()
        s = self.settings
        for row, (taken, strengths) in enumerate(self._active):
            rewards, follower = self._outcomes(row)
            rewards = REWARD_SCALE * rewards
            weights, values_of, solve = self._equations(row, (follower != CUT_OFF).astype(float))
            low, high = np.array([rewards.min(), rewards.max()]) / (1.0 - s.discount)
            theta = self.theta[row].astype(float) * REWARD_SCALE
            for _ in range(s.regression_iterations):
                values = values_of(theta)
                returns = lambda_returns(values, rewards, follower, s.discount, s.trace_decay)
                targets = weights * np.clip(returns, low, high)
                theta = solve(moment(taken, strengths, targets, theta.size))
            change = theta / REWARD_SCALE - self.theta[row]
            self.theta[row] += s.target_averaging_rate * change
        return self.theta.size

    def _equations(self, row: int, known: FloatArray) -> tuple[FloatArray, Function, Function]:
        """Return the weights ``(N,)`` of after-states, and how their values and theta follow.

        Parameters
        ----------
        row
            Whose.
        known
            ``(N,)`` 1 for after-states of which it is known what followed, 0 for others.
        """
        active, strengths = self._active[row]
        k = self.rules.n_rules
        gram, begin = self._summed.get(row, (self.settings.ridge * np.eye(k), 0))
        # The last is added once it is known what followed.
        end = len(known) if known[-1] else len(known) - len(self.members[row])
        add_gram(gram, active[begin:end], strengths[begin:end], known[begin:end])
        self._summed[row] = gram, end
        return known, lambda theta: row_values(theta, active, strengths), solver(gram)

    def _extend(self) -> None:
        """Find the active rules of the after-states that are new since the last regression."""
        if self._regressed == len(self._states):
            return
        rows = range(len(self.theta))
        active = [self._active_of(self.states_of(row, self._regressed)) for row in rows]
        if self._active:
            active = [
                (np.concatenate([old[0], new[0]]), np.concatenate([old[1], new[1]]))
                for old, new in zip(self._active, active, strict=True)
            ]
        self._active, self._regressed = active, len(self._states)

    def _active_of(self, states: FloatArray) -> tuple[IntArray, FloatArray]:
        return self.rules.active(states)

    def _outcomes(self, row: int) -> tuple[FloatArray, IntArray]:
        """Return rewards and followers of all after-states of a row, the earlier ones first.

        Of k agents and N steps, after-state ``s * k + j`` is that of agent j after step s.
        """
        earlier, members = self._earlier[row], self.members[row]
        k, before = len(members), len(earlier.states)
        steps = np.array(self._follower, dtype=np.int64)[:, None]
        steps[steps == len(steps)] = CUT_OFF  # of a running episode: not known yet
        follower = np.where(steps < 0, steps, before + steps * k + np.arange(k)).ravel()
        rewards = np.array(self._rewards).reshape(-1, self._n_agents)[:, members].ravel()
        return np.append(earlier.rewards, rewards), np.append(earlier.follower, follower)

    def states_of(self, row: int, since: int = 0) -> FloatArray:
        """Return the after-states ``(m, d)`` of a row, those since a step of this team alone."""
        d = len(self.rules.partitions)
        new = np.array(self._states[since:]).reshape(-1, self._n_agents, d)
        own = new[:, self.members[row]].reshape(-1, d)
        return own if since else np.concatenate([self._earlier[row].states, own])

    def arrays(self) -> dict[str, FloatArray]:
        """Return weights and all experience."""
        n, d = self._n_agents, len(self.rules.partitions)
        held = [len(earlier.states) for earlier in self._earlier]
        return {
            "theta": self.theta,
            "states": np.array(self._states).reshape(-1, n, d),
            "rewards": np.array(self._rewards).reshape(-1, n),
            "follower": np.array(self._follower, dtype=np.int64),
            "earlier_rows": np.repeat(np.arange(len(held)), held),
            **{
                f"earlier_{name}": np.concatenate([getattr(e, name) for e in self._earlier])
                for name in Earlier._fields
            },
        }

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        self.theta = arrays["theta"].copy()
        self._states = list(arrays["states"])
        self._rewards = list(arrays["rewards"])
        self._follower = [int(f) for f in arrays["follower"]]
        ended = [s for s, f in enumerate(self._follower) if f in (TERMINAL, CUT_OFF)]
        self._begun = ended[-1] + 1 if ended else 0
        rows = arrays["earlier_rows"]
        self._earlier = [
            Earlier(*(arrays[f"earlier_{name}"][rows == row] for name in Earlier._fields))
            for row in range(len(self.theta))
        ]
        self._active, self._regressed, self._summed = [], 0, {}

    def continue_from(self, former: BatchTD, rows: IntArray) -> None:
        """Begin with weights and experience of another team, of which no episode is under way."""
        self.theta = former.theta[rows]
        self._earlier = [Earlier(former.states_of(row), *former._outcomes(row)) for row in rows]


@njit(cache=True)
def add_gram(
    gram: FloatArray, active: IntArray, strengths: FloatArray, weights: FloatArray
) -> None:
    """Add the weighted phi phi' of every row to `gram`."""
    for s in range(len(active)):
        for a in range(active.shape[1]):
            weighted = weights[s] * strengths[s, a]
            if weighted > 0.0:
                for b in range(active.shape[1]):
                    gram[active[s, a], active[s, b]] += weighted * strengths[s, b]


@njit(cache=True)
def row_values(theta: FloatArray, active: IntArray, strengths: FloatArray) -> FloatArray:
    """Return f ``(N,)`` of all rows."""
    values = np.zeros(len(active))
    for s in range(len(active)):
        for a in range(active.shape[1]):
            values[s] += strengths[s, a] * theta[active[s, a]]
    return values


@njit(cache=True)
def moment(
    active: IntArray, strengths: FloatArray, targets: FloatArray, n_rules: int
) -> FloatArray:
    """Return the sum of phi times target over all rows."""
    moment = np.zeros(n_rules)
    for s in range(len(active)):
        for a in range(active.shape[1]):
            moment[active[s, a]] += strengths[s, a] * targets[s]
    return moment


@njit(cache=True)
def lambda_returns(
    values: FloatArray, rewards: FloatArray, follower: IntArray, discount: float, decay: float
) -> FloatArray:
    """Return the lambda-return of every row, by recursion from the end of each episode.

    ``G(s) = R(s) + gamma ((1 - lambda) f(s') + lambda G(s'))``
    """
    returns = np.empty(len(values))
    for s in range(len(values) - 1, -1, -1):
        if follower[s] == TERMINAL:
            returns[s] = rewards[s] / (1.0 - discount)
        elif follower[s] == CUT_OFF:
            returns[s] = values[s]
        else:
            after = follower[s]
            ahead = (1.0 - decay) * values[after] + decay * returns[after]
            returns[s] = rewards[s] + discount * ahead
    return returns


NOBODY = "nobody"
"""What an agent is told by a sender that it has not."""


class FittedQSettings(LearnerSettings):
    """Fitted Q: values of actions, without a predictor."""

    kind: Literal["fitted-q"] = "fitted-q"
    factory: ClassVar[str] = f"{__name__}:FittedQ"
    values_actions = True
    ridge: Positive = 0.1
    """Weight of the squared consequents against squared errors of rewards scaled by 100."""
    regression_iterations: Annotated[int, Field(ge=1, le=10_000)] = 8
    """Regressions on freshly discounted targets each time."""
    target_averaging_rate: Annotated[float, Field(gt=0, le=1)] = 1.0
    """Share of the way that the weights go towards the last regression's."""
    interval: Annotated[int, Field(ge=1)] = 1_000_000
    """Decisions of an episode after which is regressed without waiting for its end."""
    trace_decay: ClassVar[float] = 0.0
    forgetting: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """Share of its weight that experience loses from regression to regression: what it was worth to
    act so depends on what the others did then."""
    mirrored: bool = False
    """Whether what the mirror image of the team would have met is experience as well; of agents
    that are told nothing."""
    exploration: Annotated[ExplorationSettings, Plugged(EXPLORATIONS)] = BurstExploration(
        rate=1.0, decay=0.85, floor=0.05, length=1.0
    )
    """How agents explore: without a predictor they begin at random."""

    def rules_over(
        self, space: StateSpace, actions: ActionSet, n_told: int
    ) -> tuple[StateSpace, RuleBase]:
        """Return what values are functions of, the own action last, and their rule base."""
        self._check_decision()
        if self.mirrored and n_told:
            raise ValueError(
                "learner.mirrored = true: messages have no mirror image; set topology.told = 'none'"
            )
        told = [choice(f"told{k + 1}", (*actions.names, NOBODY)) for k in range(n_told)]
        names = tuple(variable.name for variable in told)
        known = StateSpace(
            space.name, (*space.variables, *told), space.n_own, actions=(*space.actions, *names)
        )
        base = RuleBase.build(known, self.rule_base)
        action = choice("action", actions.names)
        own = Partition.of(action, self.rule_base.membership, None, self.rule_base.steepness)
        terms = [(*term, len(base.partitions)) for term in base.terms]
        rules = RuleBase((*base.partitions, own), terms, dtype=self.rule_base.precision)
        return StateSpace(space.name, (*known.variables, action)), rules

    def _check_decision(self) -> None:
        """Refuse what takes a prediction."""
        taken = Decision(rule=self.decision.rule, unseen=self.decision.unseen)
        for key, allowed in taken:
            if (value := getattr(self.decision, key)) != allowed:
                raise ValueError(
                    f"learner.decision.{key} = {getattr(value, 'kind', value)!r}: fitted-q "
                    "predicts nothing and decides by its own value; leave it out, or set preset = "
                    "'fitted-q'"
                )
        if self.decision.rule not in ("value", "random") or self.decision.unseen == "plan":
            raise ValueError(
                "learner.decision: fitted-q has neither predicted rewards nor plans, allowed: rule "
                "= value or random, unseen = maintain or last"
            )
        if self.self_model.enabled or self.calibration.enabled:
            raise ValueError("learner.self_model, calibration: fitted-q has no predictor to adapt")


class FittedQ(BatchTD):
    """Fitted Q: learns the values of actions, and tells them.

    Weights are laid out rule by rule, the own action last: ``theta.reshape(-1, A)`` has a column
    for each action. Their normal equations are sums over what agents did: of each decision only the
    first time, and for each action by itself.
    """

    def __init__(self, settings: FittedQSettings, rules: RuleBase, rows: IntArray) -> None:
        super().__init__(settings, rules, rows)
        self.counts = Counts()
        self._n_actions = rules.partitions[-1].size
        self._known = RuleBase(rules.partitions[:-1], [term[:-1] for term in rules.terms])
        k = self._known.n_rules
        self._gram: FloatArray = np.zeros((len(self.theta), self._n_actions, k, k))
        self._weights: list[FloatArray] = [np.zeros(0)] * len(self.theta)
        """By row, with what weight the sums hold each decision."""

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action in the agent's present state."""
        active, strengths = self._known.active(deliberation.present[[deliberation.agent]])
        self.counts.joint_actions += self._n_actions
        self.counts.rule_evaluations += len(deliberation.own_weights)
        weights = deliberation.own_weights.reshape(-1, self._n_actions)
        return strengths[0] @ weights[active[0]]

    def observe(  # type: ignore[override]  # what is asked for by name is given
        self,
        states: FloatArray,
        reward: float | FloatArray,
        terminated: bool,
        *,
        left: FloatArray,
        joint_action: IntArray,
    ) -> int:
        """Remember what the agents knew, did and got; regress if the episode has gone on."""
        return super().observe(np.column_stack([left, joint_action]), reward, terminated)

    def _active_of(self, states: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the active rules of decisions, by the action that was taken, and strengths."""
        active, strengths = self._known.active(states[:, :-1])
        return active * self._n_actions + states[:, -1:].astype(np.int64), strengths

    def _equations(self, row: int, known: FloatArray) -> tuple[FloatArray, Function, Function]:
        """As in batch TD, action by action; a state is worth its best action."""
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

        What is new is added. The last decision of a running episode has no outcome yet, and is
        added later.
        """
        is_running = self._follower[-1] == len(self._states)
        begin, end = len(self._weights[row]), len(known) - is_running * len(self.members[row])
        kept, new = 1.0 - self.settings.forgetting, slice(begin, end)
        taken, strengths = self._active[row][0][new], self._active[row][1][new]
        self._gram[row] *= kept
        self._weights[row] = np.append(kept * self._weights[row], known[new])
        for action, gram in enumerate(self._gram[row]):
            weights = known[new] * (taken[:, 0] % self._n_actions == action)
            add_gram(gram, taken // self._n_actions, strengths, weights)
        return self._gram[row], np.append(self._weights[row], np.zeros(len(known) - end))

    def arrays(self) -> dict[str, FloatArray]:
        """Return weights, all experience, and its sums."""
        held = np.cumsum([len(weights) for weights in self._weights])
        sums = {"gram": self._gram, "weights": np.concatenate(self._weights), "held": held}
        return super().arrays() | sums

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        super().restore(arrays)
        self._gram = arrays["gram"].copy()
        self._weights = np.split(arrays["weights"], arrays["held"].astype(int)[:-1])

    def continue_from(self, former: Any, rows: IntArray) -> None:
        """Begin with weights and experience of another team, of which no episode is under way.

        Raises
        ------
        ValueError
            If the agents are told by another number of others; one line.
        """
        if former.rules.n_rules != self.rules.n_rules:
            fewer = len(self.rules.partitions) - len(former.rules.partitions)
            raise ValueError(
                f"topology: an agent is told by {abs(fewer)} {'more' if fewer > 0 else 'fewer'} "
                "others than when it learned what to make of it; allowed: as many"
            )
        super().continue_from(former, rows)
        self._gram = former._gram[rows]
        self._weights = [former._weights[row].copy() for row in rows]
