"""Episodes of random actions, recorded step by step and compared bit for bit."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product, zip_longest

import numpy as np

from ...core.agents.loop import world_seed
from ...core.interface.abilities import measurements_of
from ...core.interface.scenario import Scenario, Transition, checked_scenario
from ...core.numerics import IntArray
from ...core.plugins.words import expect

StepRecord = dict[str, object]
"""Values of one step by dotted name, without measured times."""
HOLD_PROBABILITY = 0.7
"""Probability that a random action is repeated."""


@dataclass(frozen=True)
class CheckPlan:
    """The scenario under test and the episodes to play."""

    factory: Callable[[], object]
    """Makes a new instance of the scenario, which may be of a plain class."""
    steps: int
    """Maximum number of steps of an episode."""
    seeds: tuple[int, ...]
    """At least two seeds."""
    episodes: tuple[int, ...]
    """Numbers of the episodes, by which failures are scheduled."""
    skipped: dict[str, str] = field(default_factory=dict)
    """Reasons why something was not checked, by name; checks write them."""

    @property
    def runs(self) -> Iterator[tuple[int, int]]:
        """All pairs of a seed and an episode number."""
        return product(self.seeds, self.episodes)

    def make(self) -> Scenario:
        """Return a new instance of the scenario."""
        return checked_scenario(self.factory())

    def actions(self, scenario: Scenario, seed: int) -> IntArray:
        """Return random joint actions ``(steps, n)``, most of which are held for some steps."""
        rng = np.random.default_rng(seed)
        shape = self.steps, len(scenario.agents)
        actions = rng.integers(len(scenario.action_set), size=shape)
        is_held = rng.random(shape) < HOLD_PROBABILITY
        for step in range(1, self.steps):
            actions[step, is_held[step]] = actions[step - 1, is_held[step]]
        return actions

    def play(
        self,
        scenario: Scenario,
        seed: int,
        episode: int,
        actions: IntArray | None = None,
        *,
        predicting: bool = False,
    ) -> Iterator[StepRecord]:
        """Yield the records of an episode, first that of the reset.

        Parameters
        ----------
        scenario
            Scenario, which is modified.
        seed, episode
            Seed and number of the episode, as in the control loop.
        actions
            ``(steps, n)`` joint actions. By default those of the seed. The episode may end earlier.
        predicting
            Whether to ask for predictions and measurements before every step.
        """
        yield start(scenario, seed, episode)
        for action in self.actions(scenario, seed) if actions is None else actions:
            if predicting:
                ask_for_predictions(scenario)
            record = _copied(transition_fields(scenario.step(action)))
            yield record
            if record["terminated"] or record["truncated"]:
                return


def start(scenario: Scenario, seed: int, episode: int) -> StepRecord:
    """Reset a scenario and return the record of its initial state."""
    states = scenario.reset(world_seed(seed, episode), episode)
    return _copied(_flat({"states": states, "info": measurements_of(scenario)}))


def transition_fields(transition: Transition) -> Iterator[tuple[str, object]]:
    """Yield the values of a transition by dotted name, not copied."""
    expect("a Transition", Transition, step=transition)
    fields = dict(vars(transition), twists=transition.measured_twists())
    return _flat({name: value for name, value in fields.items() if name != "absorbing"})


def ask_for_predictions(scenario: Scenario) -> None:
    """Ask a scenario for measurements and for predictions of two joint actions."""
    measurements_of(scenario)
    prediction = scenario.predict()
    if prediction is None:
        return
    n = len(scenario.agents)
    joint_actions = np.repeat([[0], [len(scenario.action_set) - 1]], n, axis=1)
    for agent in range(n):
        prediction.states(agent, joint_actions)
    prediction.rewards(joint_actions)
    measurements_of(scenario)


def differences(
    expected: Iterable[StepRecord], actual: Iterable[StepRecord], claim: str
) -> Iterator[str]:
    """Yield the differences of two episodes, step by step, each after a claim about them."""
    for step, (one, other) in enumerate(zip_longest(expected, actual)):
        place = f"{claim} {when(step)}:"
        if one is None or other is None:
            yield f"{place} one of them has ended"
        elif one.keys() != other.keys():
            yield f"{place} one of them has no {min(one.keys() ^ other.keys())}"
        else:
            for name in one:
                if bits(one[name]) != bits(other[name]):
                    values = (" ".join(str(record[name]).split()) for record in (one, other))
                    yield f"{place} {name} = {' and '.join(f'{value:.40}' for value in values)}"


def bits(value: object) -> tuple[object, ...]:
    """Return a representation of a value that is equal if and only if all bits are."""
    array = np.asarray(value)
    content = repr(value) if array.dtype == object else array.tobytes()
    return array.shape, array.dtype.str, content


def when(step: int) -> str:
    """Return the time of a step for messages; step 0 is the reset."""
    return "at the start" if step == 0 else f"at step {step}"


def _flat(table: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def _copied(values: Iterable[tuple[str, object]]) -> StepRecord:
    return {
        name: value.copy() if isinstance(value, np.ndarray) else value
        for name, value in values
        if not name.startswith("info.seconds")
    }
