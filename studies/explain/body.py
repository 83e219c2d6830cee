"""What bodies believe their actuators to do: the self-model against the bodies as built."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.adaptation.self_model import SelfModel
from ...core.agents.joint_agents import body_of
from ...core.numerics.arrays import FloatArray
from ...core.plugins.deferred import pd
from .rules import WIDTH

ROWS = ("ahead", "left", "turning")
"""The rows of an effect [m/s, m/s, rad/s], per unit of commanded speed."""
LEAST_CHANGE = 0.25
"""A smaller change of an actuator's drive is not spoken of."""
Effects = tuple[FloatArray, ...]


@dataclass
class Bodies:
    """What the bodies were believed to be at some moments."""

    moments: dict[str, Effects]
    """Effects of all bodies by moment: ``built``, perhaps ``before`` the first failure, ``after``
    all training."""
    deviations: Effects
    """Standard deviations of the last of them, as the self-model has them."""

    def note(self, moment: str, model: SelfModel) -> None:
        """Note what is believed now."""
        self.moments[moment] = tuple(effect.copy() for effect in model.effects)
        self.deviations = model.deviations


def table(bodies: Bodies, actuators: Sequence[str]) -> str:
    """Return the effects of every body's actuators, row by row and moment by moment."""
    rows = {}
    for r, own in enumerate(by_body(bodies, actuators)):
        names = [*(name.rpartition(".")[2] for name in own), "constant"]
        for i, row in enumerate(ROWS):
            for moment, effects in bodies.moments.items():
                rows[body_of(own[0]), row, moment] = pd.Series(effects[r][i], names)
    frame = pd.DataFrame(rows).T
    moving = frame.groupby(level=[0, 1]).transform("any").any(axis=1)  # a joint can but turn
    text: str = frame[moving].to_string(line_width=WIDTH, float_format="{:+.2f}".format)
    return text


def verdicts(bodies: Bodies, actuators: Sequence[str]) -> Iterator[str]:
    """Yield, for every actuator whose drive is not what it was built with, what it is taken for.

    Its drive is the part of its effect that is along the one it was built with; a change within
    two of its standard deviations is called uncertain.
    """
    built, last = bodies.moments["built"], bodies.moments["after"]
    for r, names in enumerate(by_body(bodies, actuators)):
        # A turning rate counts as the speed of an actuator that is built to turn most.
        unit = np.array([1.0, 1.0, 1.0 / max(1.0, float(np.abs(built[r][2]).max()))]) ** 2
        for actuator, name in enumerate(names):
            own = unit * built[r][:, actuator]
            length = float(own @ built[r][:, actuator])
            left = float(own @ last[r][:, actuator]) / length
            around = float(np.sqrt(own**2 @ bodies.deviations[r][:, actuator] ** 2)) / length
            if abs(left - 1.0) > LEAST_CHANGE:
                doubt = "" if abs(left - 1.0) > 2.0 * around else "; uncertain"
                share = f"{left:+.2f} ± {around:.2f} of its drive"
                yield f"{name}: {share}, {_like(left)}{doubt}"


def by_body(bodies: Bodies, actuators: Sequence[str]) -> Iterator[Sequence[str]]:
    """Yield the names of every body's actuators."""
    first = 0
    for effect in bodies.moments["built"]:
        yield actuators[first : first + effect.shape[1] - 1]
        first += effect.shape[1] - 1


def _like(left: float) -> str:
    if left < -LEAST_CHANGE:
        return "as if it were reversed"
    if left <= LEAST_CHANGE:
        return "as if it did not drive"
    return "as if it were weak" if left < 1.0 else "more than it was built for"
