"""What is played to examine a scenario, and what came out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from ...core.interface.scenario import Scenario
from ...core.numerics.arrays import IntArray
from .frames import Frame, copied, fields, look_ahead, opening, random_actions
from .sensing import MetVariable

SMALL = 0.02
"""Error of prediction, in ranges of the variable, of which no word is lost."""
FAR = 10
"""Ranges beyond its own at which a variable looks as if it were in another unit."""


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
        """Return the actions that are tried in the world of a seed."""
        return random_actions(scenario, self.steps, seed)

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


class Findings(NamedTuple):
    """What came of a check that found no fault."""

    passed: tuple[str, ...]
    """Names of the checks that were passed."""
    unchecked: Mapping[str, str]
    """Why something was not checked, by its name."""
    variables: tuple[MetVariable, ...]
    """What was met of every variable and of the reward."""

    def warnings(self) -> Iterator[str]:
        """Yield what is allowed and looks wrong, a line each."""
        for variable in self.variables:
            low, high = variable.claimed or variable.met
            least, greatest = variable.met
            if variable.error >= max(variable.persistence, SMALL * (high - low)) > 0:
                yield f"{variable.name} is predicted no better than if it stayed as it is"
            if max(low - least, greatest - high) > FAR * (high - low):
                yield f"{variable.name} goes more than {FAR} times its range beyond it"
