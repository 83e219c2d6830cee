"""Nested agents and the single agent learn one task: what they learn beside what they cost.

Section VII compares them by formula. Here both run, on the line-up task, whose joint state of three
agents still fits: the same learner (online TD lambda, full product of sigmoid rules, decision by
value), the same worlds. Step sizes are chosen for each contender apart, on seeds of their own, so
that neither is handicapped by the other's; the frozen control tells learning from luck.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import joblib
import numpy as np
from numpy.typing import NDArray

from ...core.cost import Problem
from ...core.loop import control_loop, policy_seed
from ...core.learners.frozen import FrozenSettings
from ...core.learners.td import TDLambdaSettings
from ...core.team import Team
from ...scenarios.line_up import LineUpSettings
from ...topologies import parse
from ..analysis.statistics import Estimate, rate
from ..trials.trial import EVALUATION_WORLDS
from .cost import LEARNER, RULES

CONTENDERS = ("nested", "single", "frozen")
"""The chain, the single agent, and a chain that never learns."""
AGENTS = (1, 2, 3)
STEP_SIZES = (0.1, 0.3, 1.0)
"""Tried for each contender; normalised by the squared length of the feature vector."""
EPISODES, STEPS, EVALUATION = 100, 40, 20
SEEDS = tuple(range(10))
TUNING_SEEDS = tuple(range(100, 106))
BLOCK = 20
"""Episodes at the end of training that the table averages over."""


@dataclass(frozen=True)
class Run:
    """One contender's training on one seed.

    Attributes
    ----------
    success
        ``(EPISODES,)`` whether every training episode reached the goal.
    greedy
        ``(EVALUATION,)`` the same, afterwards, without exploration and learning.
    seconds
        Of deciding and learning, per step.
    rule_evaluations
        Counted, per step.
    """

    success: NDArray[np.float64]
    greedy: NDArray[np.float64]
    seconds: float
    rule_evaluations: float


@dataclass(frozen=True)
class Contest:
    """One contender with n agents, over all seeds.

    Attributes
    ----------
    agents, contender, step_size
        Who, with the step size that its own tuning seeds chose.
    curves
        ``(n_seeds, EPISODES)`` training success.
    last, greedy
        Success over the last `BLOCK` episodes of training, and afterwards.
    weights
        Consequent weights of all its agents.
    formula
        Operations of one iteration by Eq. 18 or 23.
    rule_evaluations
        Counted, per step.
    seconds
        Median over seeds, per step.
    """

    agents: int
    contender: str
    step_size: float
    curves: NDArray[np.float64]
    last: Estimate
    greedy: Estimate
    weights: int
    formula: int
    rule_evaluations: float
    seconds: float


def compare(
    agents: Sequence[int] = AGENTS,
    seeds: Sequence[int] = SEEDS,
    *,
    episodes: int = EPISODES,
    jobs: int = 1,
) -> list[Contest]:
    """Let all contenders learn, for every number of agents."""
    cases = [(n, contender) for n in agents for contender in CONTENDERS]
    with joblib.Parallel(n_jobs=jobs) as parallel:
        tried = [
            (case, size, seed)
            for case in cases
            for size in (STEP_SIZES if case[1] != "frozen" else STEP_SIZES[:1])
            for seed in TUNING_SEEDS
        ]
        runs = parallel(
            joblib.delayed(run)(*case, size, seed, episodes) for case, size, seed in tried
        )
        scores: dict[tuple[int, str], dict[float, float]] = {case: {} for case in cases}
        for (case, size, _), found in zip(tried, runs, strict=True):
            score = found.success[-BLOCK:].mean() + found.greedy.mean()
            scores[case][size] = scores[case].get(size, 0.0) + score
        chosen = {case: max(by_size, key=by_size.__getitem__) for case, by_size in scores.items()}
        wanted = [(case, seed) for case in cases for seed in seeds]
        runs = parallel(
            joblib.delayed(run)(*case, chosen[case], seed, episodes) for case, seed in wanted
        )
    k = len(seeds)
    return [
        _contest(*case, chosen[case], runs[i * k : (i + 1) * k]) for i, case in enumerate(cases)
    ]


def run(n: int, contender: str, step_size: float, seed: int, episodes: int) -> Run:
    """Train one contender on one seed, then evaluate it greedily."""
    topology = parse("single-agent" if contender == "single" else "chain")
    scenario, hierarchy = topology.arrange(LineUpSettings(carts=n).build())
    base = LEARNER.rule_base.model_copy(update={"order": scenario.state_space.n_variables})
    learner: TDLambdaSettings | FrozenSettings = TDLambdaSettings(
        rule_base=base, decision=LEARNER.decision, step_size=step_size, normalised=True
    )
    if contender == "frozen":
        learner = FrozenSettings(rule_base=base, decision=LEARNER.decision)
    team = Team.build(learner, scenario, hierarchy, policy_seed(seed))
    success, seconds = [], []
    for record in control_loop(scenario, team, episodes=episodes, steps=STEPS, seed=seed):
        seconds.append(record.deciding + record.learning)
        if record.last:
            success.append(record.transition.terminated)
    assert team.evaluator is not None
    evaluations = team.evaluator.counts.rule_evaluations / len(seconds)
    greedy = [
        record.transition.terminated
        for record in control_loop(
            scenario, team, episodes=EVALUATION, steps=STEPS, seed=seed,
            first_episode=EVALUATION_WORLDS, learn=False,
        )
        if record.last
    ]  # fmt: skip
    return Run(
        np.array(success, dtype=float),
        np.array(greedy, dtype=float),
        float(np.median(seconds)),
        evaluations,
    )


def _contest(n: int, contender: str, step_size: float, runs: Sequence[Run]) -> Contest:
    curves = np.stack([r.success for r in runs])
    problem = Problem(rules=RULES, iterations=1)
    single = contender == "single"
    return Contest(
        n,
        contender,
        step_size,
        curves,
        rate(curves[:, -BLOCK:]),
        rate(np.stack([r.greedy for r in runs])),
        RULES**n if single else n * RULES,
        problem.single_agent(n) if single else problem.nested(range(n)),
        float(np.mean([r.rule_evaluations for r in runs])),
        float(np.median([r.seconds for r in runs])),
    )
