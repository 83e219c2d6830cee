"""How much of a sum of values over few neighbors each way to decide reaches, on box pushing.

A team is trained with the preset `default`. In situations that it then meets, every wheel values
the joint actions of itself and its neighbors on a line of wheels, all others maintaining, by the
weights that it has learned. The optimum of the sum of these values is found by elimination. What
others reach of it is told on a scale from the mean over all joint actions, 0, to the optimum, 1:

- best responses, wheel by wheel from all maintaining, until none gains;
- nested by own values: in a chain each wheel is told what is decided above it, and takes what is
  best for its own value, with the best of its neighbors below;
- nested by parts: the same for the sum of all values in which its action counts.

Run as ``python -m research.sums``.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from nested_agents import FuzzyAgents, Prediction, Session, Spec
from nested_agents.parts import Elimination, MaxPlus, Scope
from nested_agents.study import EVALUATION_WORLDS, trials_of, world_seed

from . import FloatArray, IntArray

EVERY = 5
"""Decisions from one situation to the next."""


def total(scopes: Sequence[Scope], tables: Sequence[FloatArray], joint: IntArray) -> float:
    """Return the sum of all tables at a joint action ``(n,)``."""
    return float(sum(t[tuple(joint[list(scope)])] for scope, t in zip(scopes, tables, strict=True)))


def tables_of(
    session: Session, prediction: Prediction, scopes: Sequence[Scope]
) -> list[FloatArray]:
    """Return what each agent's value makes of the joint actions of its scope."""
    team, tables = session.team, []
    a = len(team.action_set)
    for i, scope in enumerate(scopes):
        tried = np.indices((a,) * len(scope)).reshape(len(scope), -1).T
        joint = np.full((len(tried), len(scopes)), team.action_set.neutral)
        joint[:, list(scope)] = tried
        states = prediction.states(i, joint)
        theta = team.only(FuzzyAgents).learner.theta[team.only(FuzzyAgents).rows[i]]
        tables.append(
            team.only(FuzzyAgents).evaluator.rules.values(theta, states).reshape((a,) * len(scope))
        )
    return tables


def best_responses(scopes: Sequence[Scope], tables: list[FloatArray], start: IntArray) -> IntArray:
    """Return a joint action that no agent can improve alone, from a given one."""
    joint, gained = start.copy(), True
    while gained:
        gained = False
        for i in range(len(joint)):
            values = _own_values(scopes, tables, joint, i, ())
            if values.max() > values[joint[i]] + 1e-12:
                joint[i], gained = int(values.argmax()), True
    return joint


def nested(
    scopes: Sequence[Scope], tables: list[FloatArray], start: IntArray, *, own: bool
) -> IntArray:
    """Return what a chain decides, each agent by its own table or by all in which it takes part."""
    joint = start.copy()
    for i in range(len(joint)):
        mine = [k for k in range(len(scopes)) if i in scopes[k] and (k == i or not own)]
        below = tuple(sorted({j for k in mine for j in scopes[k] if j > i}))
        part = [scopes[k] for k in mine], [tables[k] for k in mine]
        joint[i] = int(_own_values(*part, joint, i, below).argmax())
    return joint


def _own_values(
    scopes: Sequence[Scope], tables: Sequence[FloatArray], joint: IntArray, agent: int,
    free: tuple[int, ...],
) -> FloatArray:  # fmt: skip
    """Return the greatest sum ``(A,)`` of each own action over the actions of free agents."""
    a, tried = tables[0].shape[0], joint.copy()
    mine = [(s, t) for s, t in zip(scopes, tables, strict=True) if agent in s or free]
    best: FloatArray = np.full(a, -np.inf)
    for actions in product(range(a), repeat=1 + len(free)):
        tried[[agent, *free]] = actions
        worth = sum(float(t[tuple(tried[list(s)])]) for s, t in mine)
        best[actions[0]] = max(best[actions[0]], worth)
    return best


def situations(robots: int, seed: int, episodes: int) -> Iterator[tuple[Session, Prediction]]:
    """Train a team, and yield what it predicts in the situations of two further episodes."""
    table = {
        "seeds": [seed], "episodes": episodes, "steps": 200, "evaluation": 0,
        "scenario": {"robots": robots},
    }  # fmt: skip
    (trial,) = trials_of(Spec.of(table))
    session = Session(trial)
    session.train(episodes)
    for episode in range(2):
        world = world_seed(seed, EVALUATION_WORLDS + episode)
        states = session.scenario.reset(world, episode)
        for step in range(100):
            if step % EVERY == 0:
                yield session, session.scenario.predict()
            seen = session.team.observe(session.scenario, states)
            decision = session.team.act(seen, explore=False)
            transition = session.scenario.step(decision.joint_action)
            states = transition.states
            if transition.terminated:
                break


def shares(robots: int, seed: int, episodes: int) -> dict[str, float]:
    """Return the mean share of the optimum that each way reaches with one trained team."""
    n = 2 * robots
    scopes = [tuple(j for j in (i - 1, i, i + 1) if 0 <= j < n) for i in range(n)]
    by_way: dict[str, list[float]] = {}
    for session, prediction in situations(robots, seed, episodes):
        tables = tables_of(session, prediction, scopes)
        a, start = tables[0].shape[0], np.full(n, session.team.action_set.neutral)
        best = total(scopes, tables, Elimination(scopes, n, a).best(tables))
        mean = float(sum(table.mean() for table in tables))
        if best - mean < 1e-9:
            continue
        reached = {
            "max-plus": MaxPlus(scopes, n, a).best(tables),
            "best responses": best_responses(scopes, tables, start),
            "nested by own values": nested(scopes, tables, start, own=True),
            "nested by parts": nested(scopes, tables, start, own=False),
            "nested by parts, then best responses": best_responses(
                scopes, tables, nested(scopes, tables, start, own=False)
            ),
        }
        for name, joint in reached.items():
            share = (total(scopes, tables, joint) - mean) / (best - mean)
            by_way.setdefault(name, []).append(share)
    return {name: float(np.mean(each)) for name, each in by_way.items()} | {
        "situations": float(len(next(iter(by_way.values()), [])))
    }


def main() -> None:
    """Print the shares seed by seed, and their means."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, nargs="+", default=[2, 4, 8])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--episodes", type=int, default=6)
    given = parser.parse_args()
    for robots in given.robots:
        rows = []
        for seed in range(given.seeds):
            rows.append(shares(robots, seed, given.episodes))
            text = ", ".join(f"{name} {value:.3g}" for name, value in rows[-1].items())
            print(f"{robots} robots, seed {seed}: {text}", flush=True)
        for name in rows[0]:
            values = [row[name] for row in rows]
            between = f"({min(values):.3g}-{max(values):.3g})"
            print(f"{robots} robots, {name}: {np.mean(values):.3g} {between}")


if __name__ == "__main__":
    main()
