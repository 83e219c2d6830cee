"""Recovery table: the cost of faults for any policy in any environment, and its recovery.

A policy runs the same episodes twice, with the faults and without: same worlds, same random
numbers. Returns are sums of rewards, of a parallel environment their mean over agents. Of `BLOCK`
episodes each there are the level *before* the onset, *just after* it and at the *end*. The
*cumulative loss* is what the episodes from the onset on fall short of their like without fault. The
*recovery time* is the number of episodes from the onset until `BLOCK` episodes in a row have
regained `REGAINED` of what was lost just after it and all faults have begun, always compared with
the same episodes without fault. A seed that does not recover counts with all the episodes that were
run: a lower bound.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ...core.numerics import FloatArray
from ...scenarios.faults.wrappers import ActuatorFault, FaultyEnv, FaultyParallelEnv
from ...scenarios.library_types import Data, Environment
from ..presentation.reports import Report
from ..presentation.tables import SummaryTable, tabulate
from ..results.analysis import Summary, has_lower_bounds
from ..results.notation import wrapped
from ..results.recovery import BLOCK, LOWER_BOUND, REGAINED, recovery
from ..results.statistics import bootstrap, censored, exactly, rate

Policy: TypeAlias = Any
"""Policy: a function that returns the action for an observation, or for observations by agent; or a
trained model with a method `predict` such as those of stable-baselines3, which is asked without
exploration. Its method ``begin(seed)``, if it has one, is called when a run begins."""


class RandomPolicy:
    """Acts at random.

    Parameters
    ----------
    space
        The action space; by agent for a parallel environment.
    """

    def __init__(self, space: Data) -> None:
        self.space = space

    def begin(self, seed: int) -> None:
        """Start the random numbers of a run."""
        spaces = self.space.values() if isinstance(self.space, Mapping) else [self.space]
        for i, space in enumerate(spaces):
            space.seed(seed + i)

    def __call__(self, observation: Data) -> Data:
        """Return an action, or one of every agent that observes."""
        if isinstance(self.space, Mapping):
            return {agent: self.space[agent].sample() for agent in observation}
        return self.space.sample()


class FaultCourse(NamedTuple):
    """The returns of one policy under one schedule of faults."""

    name: str
    """Policy and schedule."""
    onset: int
    """Episode in which the first fault begins."""
    healthy: FloatArray
    """``(n_seeds, n_episodes)`` returns without the faults."""
    faulty: FloatArray
    """``(n_seeds, n_episodes)`` returns with the faults."""
    last_onset: int
    """Episode in which the last fault begins."""
    end: int | None = None
    """Episode from which on no fault is left, if there is one."""

    @property
    def shortfall(self) -> FloatArray:
        """Return of the same episodes without faults minus that with faults, from the onset on."""
        return np.asarray((self.healthy - self.faulty)[:, self.onset :])

    def recovery(self) -> tuple[FloatArray, FloatArray]:
        """Return per seed whether it recovered, and after how many episodes."""
        lost = np.maximum(self.shortfall[:, :BLOCK].mean(axis=1, keepdims=True), 0.0)
        return recovery(self.shortfall, (1.0 - REGAINED) * lost, self.last_onset - self.onset)

    def summary(self) -> Summary:
        """Return its line of the table."""
        recovered, episodes = self.recovery()
        k = self.onset
        blocks = {
            "return before": self.faulty[:, k - BLOCK : k],
            "return just after": self.faulty[:, k : k + BLOCK],
        }
        if self.end is not None:
            blocks["return after its end"] = self.faulty[:, self.end : self.end + BLOCK]
        ends = {"": self.faulty, ", no fault": self.healthy}
        blocks |= {f"return at the end{what}": own[:, -BLOCK:] for what, own in ends.items()}
        estimates = {title: bootstrap(block.mean(axis=1)) for title, block in blocks.items()}
        if self.end is not None:
            estimates["fault ends [episode]"] = exactly(self.end)
        estimates |= {
            "cumulative loss": bootstrap(self.shortfall.sum(axis=1)),
            "recovered": rate(recovered[:, None]),
            "recovery time": censored(
                bootstrap(episodes, bounds=(0.0, self.shortfall.shape[1])), recovered == 0.0
            ),
        }
        return Summary(self.name, len(self.faulty), estimates)


@dataclass(frozen=True, repr=False)
class RecoveryTable(Report):
    """Cost of faults by policy; printed or shown by a notebook."""

    courses: tuple[FaultCourse, ...]
    """The returns behind every line."""

    @cached_property
    def table(self) -> SummaryTable:
        """The table in all its forms."""
        return tabulate([course.summary() for course in self.courses])

    @property
    def notes(self) -> tuple[str, ...]:
        """Meaning of the columns."""
        levels = f"Returns are means of {BLOCK} episodes; recovery time is in episodes."
        return (levels, *(wrapped(LOWER_BOUND) if has_lower_bounds(self.table.lines) else ()))


def recovery_table(
    make: Callable[[], Environment],
    policies: Mapping[str, Policy],
    faults: Mapping[str, Sequence[ActuatorFault]],
    *,
    seeds: int | Sequence[int] = 5,
    episodes: int = 20,
    steps: int = 1000,
    **wrapping: Any,
) -> RecoveryTable:
    """Run policies through schedules of faults, paired with the same runs without.

    Parameters
    ----------
    make
        Makes the environment, of Gymnasium or PettingZoo's parallel kind.
    policies
        By name; see `Policy`.
    faults
        Schedules by name.
    seeds
        How many, or which.
    episodes
        Of each run; `BLOCK` or more come before the first fault, and as many from it on.
    steps
        Most steps of an episode.
    **wrapping
        Further arguments of `FaultyEnv`.

    Raises
    ------
    ValueError
        If there are no seeds or too few episodes, a policy cannot act, or as `FaultyEnv` does.
    """
    run = range(seeds) if isinstance(seeds, int) else seeds
    if len(run) == 0:
        raise ValueError("seeds = 0, allowed: 1 or more")
    for name, schedule in faults.items():
        onset = min((fault.episode for fault in schedule), default=0)
        if not BLOCK <= onset <= episodes - BLOCK:
            raise ValueError(
                f"faults {name!r}: the first begins in episode {onset}, allowed {BLOCK} to "
                f"{episodes - BLOCK} of {episodes} episodes"
            )
    courses = []
    for acting, policy in policies.items():
        healthy = np.array([returns(make, policy, (), s, episodes, steps, **wrapping) for s in run])
        for name, schedule in faults.items():
            faulty = [returns(make, policy, schedule, s, episodes, steps, **wrapping) for s in run]
            begins, ends = zip(*(fault.span for fault in schedule), strict=True)
            end = max(episodes if end is None else end for end in ends)
            course = FaultCourse(
                f"{acting}: {name}", min(begins), healthy, np.array(faulty), max(begins),
                end if end < episodes else None,
            )  # fmt: skip
            courses.append(course)
    return RecoveryTable(tuple(courses))


def returns(
    make: Callable[[], Environment],
    policy: Policy,
    faults: Sequence[ActuatorFault],
    seed: int,
    episodes: int,
    steps: int,
    **wrapping: Any,
) -> FloatArray:
    """Return the returns ``(episodes,)`` of one run; see `recovery_table`."""
    bare = make()
    is_parallel = hasattr(bare, "possible_agents")
    wrap: Callable[..., Environment] = FaultyParallelEnv if is_parallel else FaultyEnv
    env = wrap(bare, faults, **wrapping)
    act = _function_of(policy)
    if begin := getattr(policy, "begin", None):
        begin(seed)
    totals = np.zeros(episodes)
    for episode, world in enumerate(np.random.SeedSequence(seed).generate_state(episodes)):
        observation, _ = env.reset(seed=int(world), options={"fault_episode": episode})
        for _ in range(steps):
            observation, reward, terminated, truncated, _ = env.step(act(observation))
            if is_parallel:
                totals[episode] += sum(reward.values()) / len(env.possible_agents)
                is_over = not env.agents
            else:
                totals[episode] += float(reward)
                is_over = terminated or truncated
            if is_over:
                break
    env.close()
    return totals


def _function_of(policy: Policy) -> Callable[[Data], Data]:
    try:
        return partial(_predict, policy.predict)
    except AttributeError:
        if callable(policy):
            return policy
        what = "must be a function, or have a method predict"
        raise ValueError(f"policy = {policy!r:.60}: {what}") from None


def _predict(predict: Callable[..., tuple[Data, object]], observation: Data) -> Data:
    """Return the action of a model; of observations by agent, those of each apart."""
    if isinstance(observation, Mapping):
        return {agent: _predict(predict, own) for agent, own in observation.items()}
    action, _ = predict(observation, deterministic=True)
    return action
