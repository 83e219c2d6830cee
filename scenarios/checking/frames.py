"""Episodes played as frames: what every step gave, copied, and compared to the last bit."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Any

import numpy as np

from ...core.agents.loop import world_seed
from ...core.interface.scenario import Scenario, Transition
from ...core.numerics import IntArray

Frame = dict[str, Any]
"""What one step gave, by dotted name; without the measured times."""

FIELDS = ("states", "reward", "terminated", "truncated", "twists", "info")


@dataclass(frozen=True)
class Examination:
    """What is played, and what could not be checked."""

    factory: Callable[[], Scenario]
    """Makes a new instance of the scenario."""
    steps: int
    """Most steps of an episode."""
    seeds: tuple[int, ...]
    """At least two seeds of worlds."""
    episodes: tuple[int, ...]
    """Numbers under which episodes are played: failures may be scheduled by them."""
    unchecked: dict[str, str] = field(default_factory=dict)
    """Why something could not be checked, by its name; checks write it."""

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
    return copied({"states": states, "info": measured(scenario)})


def measured(scenario: Scenario) -> Mapping[str, Any]:
    """Return the measurements of the present state, of a scenario that has them between steps."""
    return scenario.measure()


def fields(transition: Transition) -> Iterator[tuple[str, Any]]:
    """Yield what a transition holds, by dotted name, not copied."""
    held = vars(transition)
    return _flat({name: held[name] for name in FIELDS})


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


def bits(value: Any) -> tuple[Any, ...]:
    """Return what equal values share, to the last bit."""
    array = np.asarray(value)
    content = repr(value) if array.dtype == object else array.tobytes()
    return array.shape, array.dtype.str, content


def at(step: int) -> str:
    """Return where in an episode a step is, in words."""
    return "at the start" if step == 0 else f"at step {step}"


def _contrast(one: Any, other: Any) -> str:
    one, other = np.asarray(one), np.asarray(other)
    if one.shape != other.shape or one.dtype != other.dtype:
        return f" of shapes {one.shape} and {other.shape}, types {one.dtype} and {other.dtype}"
    if not one.ndim:
        return f" = {one} and {other}"
    where = next(i for i in np.ndindex(one.shape) if bits(one[i]) != bits(other[i]))
    return f"{list(where)} = {one[where]} and {other[where]}"


def look_ahead(scenario: Scenario) -> None:
    """Ask for predictions, of a scenario that predicts, and measurements."""
    measured(scenario)
    prediction = scenario.predict()
    if prediction is None:
        return
    some = np.repeat([[0], [len(scenario.action_set) - 1]], len(scenario.agents), axis=1)
    for agent in range(len(scenario.agents)):
        prediction.states(agent, some)
    prediction.rewards(some)
    measured(scenario)


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def copied(table: Mapping[str, Any]) -> Frame:
    """Return what is in a table, by dotted name, without the measured times."""
    return {
        name: value.copy() if isinstance(value, np.ndarray) else value
        for name, value in _flat(table)
        if not name.startswith("info.seconds")
    }
