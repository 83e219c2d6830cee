"""Whether a rule base can hold CartPole at all: ``python -m research.cartpole``.

The equations of Gymnasium's CartPole are given, and 12,000 states drawn evenly over its track. The
values of a rule base are regressed on the *better* of the two actions from each, 200 times over
(fitted value iteration; 0 a step and -1 at the fall). Decided is as our agents decide: by the value
of the state that an action leads to if it is held for some steps. What does not hold the pole here
cannot be put down to predictor, exploration or experience.
"""

from __future__ import annotations

import argparse
from itertools import combinations

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from nested_agents import Partition, RuleBase

LIMITS = np.array([2.4, 3.0, 0.21, 3.0])
"""Of position [m], its speed, angle [rad] and its speed: ends of the membership functions."""
STATES, ITERATIONS, EPISODES, STEPS = 12_000, 200, 40, 500
DISCOUNT, RIDGE = 0.99, 1.0


def main() -> None:
    """Print the mean number of steps by order and steps held."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--orders", type=int, nargs="+", default=[2, 3])
    parser.add_argument("--held", type=int, nargs="+", default=[1, 3, 5])
    arguments = parser.parse_args()
    for order in arguments.orders:
        rules = RuleBase(
            [Partition(tuple(np.linspace(-end, end, 5)), "triangular") for end in LIMITS],
            list(combinations(range(4), order)),
        )
        theta = values_of(rules, np.random.default_rng(1))
        for held in arguments.held:
            steps = lasted(rules, theta, held, np.random.default_rng(2))
            print(f"order {order}, held for {held}: {steps.mean():.0f} steps, least {steps.min()}")


def moved(states: np.ndarray, action: np.ndarray | int) -> np.ndarray:
    """Return the states ``(m, 4)`` 0.02 s later, pushed by 10 N to the left (0) or right (1)."""
    _, speed, angle, turn = states.T
    cos, sin, force = np.cos(angle), np.sin(angle), np.where(action, 10.0, -10.0)
    pushed = (force + 0.05 * turn**2 * sin) / 1.1
    falling = (9.8 * sin - cos * pushed) / (0.5 * (4.0 / 3.0 - 0.1 * cos**2 / 1.1))
    rates = speed, pushed - 0.05 * falling * cos / 1.1, turn, falling
    return np.asarray(states + 0.02 * np.stack(rates, axis=1))


def fallen(states: np.ndarray) -> np.ndarray:
    """Return whether the cart has left its track or the pole has fallen."""
    return (np.abs(states[:, 0]) > 2.4) | (np.abs(states[:, 2]) > np.radians(12.0))


def values_of(rules: RuleBase, rng: np.random.Generator) -> np.ndarray:
    """Return the weights ``(n_rules,)`` of fitted value iteration."""
    states = rng.uniform(-1.0, 1.0, (STATES, 4)) * LIMITS
    phi = rules.features(states)
    factor = cho_factor(phi.T @ phi + RIDGE * np.eye(phi.shape[1]))
    after = [moved(states, action) for action in (0, 1)]
    ends, ahead = [fallen(s) for s in after], [rules.features(s) for s in after]
    theta = np.zeros(phi.shape[1])
    for _ in range(ITERATIONS):
        each = [
            np.where(end, -100.0, DISCOUNT * (features @ theta))
            for end, features in zip(ends, ahead, strict=True)
        ]
        targets = np.clip(np.maximum(*each), -100.0, 0.0)
        theta = cho_solve(factor, phi.T @ targets)
    return theta


def lasted(rules: RuleBase, theta: np.ndarray, held: int, rng: np.random.Generator) -> np.ndarray:
    """Return after how many steps ``(EPISODES,)`` the pole has fallen, `STEPS` at most."""
    states = rng.uniform(-0.05, 0.05, (EPISODES, 4))
    stands, steps = np.ones(EPISODES, dtype=bool), np.zeros(EPISODES, dtype=int)
    for _ in range(STEPS):
        values = []
        for action in (0, 1):
            ahead = states
            for _ in range(held):
                ahead = moved(ahead, action)
            values.append(rules.features(ahead) @ theta)
        states = moved(states, values[1] > values[0])
        stands &= ~fallen(states)
        steps += stands
    return steps


if __name__ == "__main__":
    main()
