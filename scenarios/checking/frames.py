"""Episodes played as frames: what every step gave, copied, and compared to the last bit."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest

import numpy as np

from ...core.agents.loop import world_seed
from ...core.interface.plain import as_scenario
from ...core.interface.scenario import Scenario, Transition
from ...core.numerics import IntArray

Frame = dict[str, object]
"""What one step gave, by dotted name; without the measured times."""


@dataclass(frozen=True)
class Examination:
    """What is played, and what could not be checked."""

    make: Callable[[], object]
    """Makes a new instance of the scenario, which may be of a user's plain class."""
    steps: int
    """Most steps of an episode."""
    seeds: tuple[int, ...]
    """At least two seeds of worlds."""
    episodes: tuple[int, ...]
    """Numbers under which episodes are played: failures may be scheduled by them."""
    unchecked: dict[str, str] = field(default_factory=dict)
    """Why something could not be checked, by its name; checks write it."""

    def factory(self) -> Scenario:
        """Return a new instance of the scenario."""
        return as_scenario(self.make())

    def actions(self, scenario: Scenario, seed: int) -> IntArray:
        """Return joint actions ``(steps, n)`` drawn by a seed, most of them held for some steps."""
        rng = np.random.default_rng(seed)
        shape = self.steps, len(scenario.agents)
        actions = rng.integers(len(scenario.action_set), size=shape)
        held = rng.random(shape) < 0.7
        for step in range(1, self.steps):
            actions[step, held[step]] = actions[step - 1, held[step]]
        return actions

    def play(
        self,
        scenario: Scenario,
        seed: int,
        episode: int,
        actions: IntArray | None = None,
        *,
        predicting: bool = False,
    ) -> Iterator[Frame]:
        """Yield the frames of an episode, the opening first.

        Parameters
        ----------
        scenario
            What is played; modified.
        seed, episode
            As in the control loop.
        actions
            ``(steps, n)`` joint actions; none: those of the seed. The episode may end earlier.
        predicting
            Whether predictions and measurements are asked for before every step.
        """
        yield opening(scenario, seed, episode)
        for action in self.actions(scenario, seed) if actions is None else actions:
            if predicting:
                look_ahead(scenario)
            frame = copied(dict(fields(scenario.step(action))))
            yield frame
            if frame["terminated"] or frame["truncated"]:
                return


def opening(scenario: Scenario, seed: int, episode: int) -> Frame:
    """Reset a scenario and return the frame of the start."""
    states = scenario.reset(world_seed(seed, episode), episode)
    return copied({"states": states, "info": scenario.measure()})


def fields(transition: Transition) -> Iterator[tuple[str, object]]:
    """Yield what a transition holds, by dotted name, not copied."""
    table = {
        "states": transition.states,
        "reward": transition.reward,
        "terminated": transition.terminated,
        "truncated": transition.truncated,
        "twists": transition.twists,
        "info": transition.info,
    }
    return _flat(table)


def differences(
    expected: Iterable[Frame], actual: Iterable[Frame], words: str = "they differ"
) -> Iterator[str]:
    """Yield at which step the frames of two runs differ and in what, after words for it."""
    for step, (one, other) in enumerate(zip_longest(expected, actual)):
        here = f"{words} {at(step)}:"
        if one is None or other is None:
            yield f"{here} one of them has ended"
        elif one.keys() != other.keys():
            yield f"{here} one of them has no {min(one.keys() ^ other.keys())}"
        else:
            for name in one:
                if bits(one[name]) != bits(other[name]):
                    yield f"{here} {name}{_contrast(one[name], other[name])}"


def bits(value: object) -> tuple[object, ...]:
    """Return what equal values share, to the last bit."""
    array = np.asarray(value)
    content = repr(value) if array.dtype == object else array.tobytes()
    return array.shape, array.dtype.str, content


def at(step: int) -> str:
    """Return where in an episode a step is, in words."""
    return "at the start" if step == 0 else f"at step {step}"


def _contrast(value: object, other_value: object) -> str:
    one = np.asarray(value)
    other = np.asarray(other_value)
    if one.shape != other.shape or one.dtype != other.dtype:
        return f" of shapes {one.shape} and {other.shape}, types {one.dtype} and {other.dtype}"
    if not one.ndim:
        return f" = {one} and {other}"
    where = next(i for i in np.ndindex(one.shape) if bits(one[i]) != bits(other[i]))
    return f"{list(where)} = {one[where]} and {other[where]}"


def look_ahead(scenario: Scenario) -> None:
    """Ask for predictions, of a scenario that predicts, and measurements."""
    scenario.measure()
    prediction = scenario.predict()
    if prediction is None:
        return
    some = np.repeat([[0], [len(scenario.action_set) - 1]], len(scenario.agents), axis=1)
    for agent in range(len(scenario.agents)):
        prediction.states(agent, some)
    prediction.rewards(some)
    scenario.measure()


def _flat(table: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def copied(table: Mapping[str, object]) -> Frame:
    """Return what is in a table, by dotted name, without the measured times."""
    return {
        name: value.copy() if isinstance(value, np.ndarray) else value
        for name, value in _flat(table)
        if not name.startswith("info.seconds")
    }
