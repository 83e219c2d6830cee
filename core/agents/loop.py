"""The three-layer control loop (Section VIII) as a generator of step records.

1. *Error observation*: the scenario computes the agents' states from the goal and its sensors.
2. *Action selection*, with learning: the team predicts, evaluates and chooses a joint action.
3. *Servo control*: the scenario converts the joint action to commanded speeds and moves the bodies.

Recordings, progress bars and plots use the records; the loop knows none of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from numbers import Integral

import numpy as np

from ..interface.experience import Experience
from ..interface.scenario import Transition, checked_scenario, checked_transition
from ..numerics import FloatArray, IntArray, working_seconds
from ..plugins.words import expect
from .team import Team


@dataclass(frozen=True)
class StepRecord:
    """One step of the control loop."""

    episode: int
    """Counted from 0."""
    step: int
    """Counted from 0 in every episode."""
    states: FloatArray
    """``(n, d)`` states before the step."""
    joint_action: IntArray
    """``(n,)`` action indices, in agent order."""
    transition: Transition
    """Result of the step."""
    last: bool
    """Whether the episode ends with this step."""
    deciding: float
    """Duration of the decision [s]; scenarios report their own times in ``transition.info``."""
    learning: float
    """Duration of learning [s]."""
    decision_costs: Mapping[str, float]
    """Costs of the decision, by the names of `Team.costs`."""


def world_seed(seed: int, episode: int) -> np.random.SeedSequence:
    """Return the seed of an episode's environment, equal for all conditions of a study."""
    return np.random.SeedSequence(seed, spawn_key=(0, episode))


def policy_seed(seed: int) -> np.random.SeedSequence:
    """Return the seed of a team, independent of all environments."""
    expect("a whole number from 0", Integral, seed=seed)
    return np.random.SeedSequence(seed, spawn_key=(1,))


def control_loop(
    scenario: object,
    team: Team,
    *,
    episodes: int,
    steps: int,
    seed: int,
    first_episode: int = 0,
    first_world: int | None = None,
    learn: bool = True,
    explore: bool | None = None,
) -> Iterator[StepRecord]:
    """Run episodes and yield every step.

    Parameters
    ----------
    scenario, team
        Environment and team; both are modified.
    episodes, steps
        Number of episodes, and maximum number of steps of an episode.
    seed
        Seed of the environments, see `world_seed`.
    first_episode
        Number of the first episode, to continue a run with a saved team.
    first_world
        Number of the environment of the first episode, see `world_seed`; by default
        `first_episode`.
    learn
        Whether the team learns.
    explore
        Whether the team explores; by default it does if it learns. A team that does not learn
        explores only by its stochastic policies.

    Raises
    ------
    ValueError
        If the scenario lacks a prediction that the team requires, see `Team.check`, or returns
        invalid states or rewards, see `checked_transition`.
    """
    expect("a team", Team, team=team)
    expect("whole numbers", Integral, episodes=episodes, steps=steps, seed=seed)
    first_world = first_episode if first_world is None else first_world
    explore = learn if explore is None else explore
    world = checked_scenario(scenario)
    space = world.state_space
    for k in range(episodes):
        episode = first_episode + k
        seed_of_world = world_seed(seed, first_world + k)
        states = space.checked(world.reset(seed_of_world, episode), world.agents)
        previous = None
        team.reset(seed_of_world, episode, learn=learn)
        for step in range(steps):
            begin = working_seconds()
            seen = team.observe(world, states, previous)
            decision = team.act(seen, explore=explore)
            decided = working_seconds()
            returned = world.step(decision.joint_action.copy())
            transition = checked_transition(returned, space, world.agents)
            last = transition.terminated or transition.truncated or step == steps - 1
            moved = working_seconds()
            if learn:
                team.learn(Experience(seen, decision, transition, last))
            yield StepRecord(
                episode=episode,
                step=step,
                states=states,
                joint_action=decision.joint_action,
                transition=transition,
                last=last,
                deciding=decided - begin,
                learning=working_seconds() - moved,
                decision_costs=team.decision_costs,
            )
            if last:
                break
            states = transition.states
            previous = decision.joint_action
