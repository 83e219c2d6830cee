"""An episode of a matrix game in one compiled loop, thousands of plays in a few milliseconds.

A play is a few table look-ups and a random number; in the control loop nearly all of its time goes
into passing it from part to part: compiled, an episode takes a 150th of it, and the study `games`
some minutes in place of four hours. `run` does the same as `control_loop`, by the same random
numbers in the same order, for teams made of parts that it knows; the control loop is the reference
that it is tested against. Games are those of `nested_agents.scenarios.matrix_games.scenario`.

It knows exact enumeration by an agent's own value, with all teammate models and hierarchies; tables
(rule bases of full order) that stay as they are, or are learned without discount by `TDLambda`,
`OptimisticTD` or `FMQ`; exploration by `Boltzmann`, and by `EpsilonDecreasingBoltzmann`
if that explores uniformly and else takes the greatest value.
"""

from typing import Any

import numpy as np

from ...core.agents.loop import EpisodeSummary
from ...core.agents.team import Team
from ...core.decision.exploration import Boltzmann, EpsilonDecreasingBoltzmann
from ...core.evaluators.exact import ExactEnumeration
from ...core.learners.one_step import FMQ, OptimisticTD
from ...core.learners.td import Frozen, TDLambda
from ...core.numerics.arrays import FloatArray, IntArray
from .kernel import DECREASING, GREEDY, SAMPLED, Deciding, Exploring, Learning, play

TEAMMATES = ("best-response", "uniform", "empirical", "conditional")
"""Teammate models in the order of the kernel."""
NONE: FloatArray = np.zeros((0, 0))
STILL = Learning(False, 0.0, 1.0, 0.0, NONE, NONE, NONE, NONE)
NO_EXPLORATION = Exploring(GREEDY, 0.0, 0.0, 0.0)


Parts = tuple[Deciding, Exploring, Learning]
"""A team as the kernel knows it."""


def parts_of(game: Any, team: Team, *, learn: bool) -> Parts | None:
    """Return what a team is made of; None if it has a part that the kernel does not know."""
    if type(team.evaluator) is not ExactEnumeration or not _is_table(team.evaluator):
        return None
    if team.messages.fail or team.evaluator.problem.unseen != "maintain":
        return None
    if team.predictor is not None:
        return None
    learning = _learning(team.learner) if learn else STILL
    exploring = _exploring(team.explorer) if learn else NO_EXPLORATION
    if learning is None or exploring is None:
        return None
    return _deciding(game, team, team.evaluator), exploring, learning


def run(game: Any, team: Team, parts: Parts, plays: int) -> EpisodeSummary:
    """Run an episode that has begun."""
    deciding, exploring, learning = parts
    n, learner = len(team.hierarchy), team.learner
    joints, paid = np.zeros((2, n), dtype=np.int64), np.zeros(2)
    payoffs = game.payoffs.reshape(2, -1)[: 2 if game.is_stochastic else 1]
    total, optima = play(
        team.rng, game.rng, plays, payoffs, game.optimal.ravel(), learner.theta, team.rows,
        deciding, exploring, team.explorer.memory, learning, team.seen, team.given, joints, paid,
    )  # fmt: skip
    updates = 0
    if learning.learns:
        updates = max(0, plays - 2) * (1 + bool(len(learning.weights))) * learner.theta.size
        updates *= learning.step_size > 0.0
        # The learner is shown the last two plays, and is left as they leave it.
        for k in range(2)[-plays:]:
            updates += learner.observe(game.states_after(joints[k]), float(paid[k]), False)
    if team.evaluator is not None:
        counts, tried = team.evaluator.counts, team.hierarchy.joint_actions(len(team.action_set))
        counts.joint_actions += plays * tried
        counts.rule_evaluations += plays * tried * learner.theta.shape[1]
        counts.weight_updates += updates
    measures = {
        "success": bool(game.optimal[tuple(joints[1])]),
        "optimal_plays": optima / plays,
        "payoff": total / plays,
    }
    return EpisodeSummary(plays, measures, total)


def _is_table(evaluator: ExactEnumeration) -> bool:
    """Return whether agents decide by own values, and every state fires one rule alone."""
    rules, problem = evaluator.rules, evaluator.problem
    whole = tuple(range(len(rules.partitions)))
    actions = tuple(float(a) for a in range(evaluator.n_actions))
    at_actions = all(partition.centres == actions for partition in rules.partitions)
    own = problem.rule == "value" and problem.value_of == "own"
    return own and rules.compact and at_actions and rules.terms == (whole,)


def _deciding(game: Any, team: Team, evaluator: ExactEnumeration) -> Deciding:
    n, a = len(team.hierarchy), evaluator.n_actions
    below, above = np.zeros((2, n, n), dtype=np.int64)
    for i in range(n):
        below[i, list(team.hierarchy.below(i))] = 1
        above[i, list(team.hierarchy.above(i))] = 1
    every = np.indices((a,) * n).reshape(n, -1).T
    states = game.states_after(every).astype(np.int64)  # (A ** n, n, d)
    places = a ** np.arange(states.shape[2] - 1, -1, -1, dtype=np.int64)
    cells: IntArray = np.ascontiguousarray((states @ places).T)
    teammates = TEAMMATES.index(evaluator.problem.teammates)
    order = np.array(team.hierarchy.order, dtype=np.int64)
    return Deciding(order, below, above, teammates, team.action_set.neutral, cells)


def _learning(learner: Any) -> Learning | None:
    """Return how a learner learns; None if it is not known."""
    known = STILL._replace(learns=True)
    if type(learner) is Frozen:
        return known
    if getattr(learner, "discount", 1.0) > 0.0:
        return None
    if type(learner) is TDLambda and learner.settings.averaging == 1:
        return known._replace(step_size=learner.settings.step_size)
    if type(learner) is OptimisticTD:
        s = learner.settings
        return known._replace(step_size=s.step_size, falling=s.falling)
    if type(learner) is FMQ:
        tables = learner.weights, learner.greatest, learner.hits, learner.visits
        return Learning(True, learner.settings.step_size, 1.0, learner.settings.weight, *tables)
    return None


def _exploring(explorer: Any) -> Exploring | None:
    """Return how an explorer explores; None if it is not known."""
    if type(explorer) is Boltzmann:
        s = explorer.settings
        return Exploring(SAMPLED, s.max_temperature, s.decay, 0.0)
    if type(explorer) is EpsilonDecreasingBoltzmann:
        p = explorer.settings
        if (p.explore, p.exploit) == ("uniform", "greatest"):
            return Exploring(DECREASING, p.max_temperature, p.decay, p.epsilon)
    return None
