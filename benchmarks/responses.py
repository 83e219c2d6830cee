"""Decisions of boxes at once over those asked for one by one: ``python -m benchmarks.responses``.

Teams with drawn weights decide in turns, in the same situations and with the same random numbers:
all best responses in one compiled call, and agent by agent. Printed are the least processor times
of a decision, prediction included, the median ratio of the pairs, and whether the joint actions
are the same.
"""

from __future__ import annotations

import argparse
from time import thread_time

import numpy as np

from nested_agents.core.agents.fuzzy import FuzzyAgents
from nested_agents.core.agents.loop import world_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.interface.experience import Observation
from nested_agents.core.numerics import FloatArray, IntArray
from nested_agents.scenarios.box_pushing.prediction.prediction import BoxPrediction
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session
from nested_agents.studies.trials.trial import trials_of

WARM = 3
"""Pairs that are not timed: kernels are compiled."""
AT_ONCE = BoxPrediction.best_responses


def one_by_one(prediction: BoxPrediction, rules: object) -> None:
    """Know no way but to ask every agent."""


def timed(team: Team, seen: Observation) -> tuple[float, IntArray]:
    """Return the processor time of a decision [s], and the joint action; nothing is remembered."""
    with team.drawing_apart():
        begun = thread_time()
        joint = team.act(seen, explore=False).joint_action
        return thread_time() - begun, joint


def pairs(robots: int, number: int) -> tuple[FloatArray, bool]:
    """Return times ``(number, 2)`` [s], and whether all joint actions are the same."""
    (trial,) = trials_of(Spec.of({"seeds": 1, "scenario": {"robots": robots}}))
    session = Session(trial)
    scenario, team = session.scenario, session.team
    theta = team.only(FuzzyAgents).learner.theta
    theta[:] = np.random.default_rng(0).normal(size=theta.shape)
    seed = world_seed(0, 0)
    seen = Observation(scenario.reset(seed, 0), scenario)
    team.begin_world(seed, 0)
    times = np.empty((WARM + number, 2))
    same = True
    for pair in times:
        decided = []
        for way, at in ((AT_ONCE, 0), (one_by_one, 1)):
            BoxPrediction.best_responses = way  # type: ignore[method-assign]
            pair[at], joint = timed(team, seen)
            decided.append(joint)
        same = same and np.array_equal(*decided)
        seen = Observation(scenario.step(decided[0]).states, scenario)
    return times[WARM:], same


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.responses", description=__doc__)
    parser.add_argument("--robots", type=int, nargs="+", default=(4, 8, 16, 64), metavar="N")
    parser.add_argument("--number", type=int, default=30, help="pairs of decisions")
    options = parser.parse_args()
    print("robots  at once [ms]  one by one [ms]  ratio  same joint actions")
    for robots in options.robots:
        times, same = pairs(robots, options.number)
        once, asked = 1e3 * times.min(axis=0)
        ratio = np.median(times[:, 0] / times[:, 1])
        print(f"{robots:>6} {once:>13.2f} {asked:>16.2f} {ratio:>6.2f}  {same}")


if __name__ == "__main__":
    main()
