"""What robots believe their wheels to do: the self-model against the robots as they were built."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.adaptation.self_model import SelfModel
from ...core.numerics.arrays import FloatArray

ROWS = (("ahead", "m/s"), ("left", "m/s"), ("turning", "rad/s"))
"""The rows of an effect, in units per m/s of wheel speed."""
LEAST_CHANGE = 0.25
"""A smaller change of a wheel's drive is not spoken of."""
Effects = tuple[FloatArray, ...]


@dataclass
class Bodies:
    """What the robots were believed to be at some moments.

    Attributes
    ----------
    moments
        Effects of all robots by moment: ``built``, perhaps ``before`` the first failure, ``after``
        all training.
    deviations
        Standard deviations of the last of them, as the self-model has them.
    """

    moments: dict[str, Effects]
    deviations: Effects

    def note(self, moment: str, model: SelfModel) -> None:
        """Note what is believed now."""
        self.moments[moment] = tuple(effect.copy() for effect in model.effects)
        self.deviations = model.deviations


def table(bodies: Bodies, wheels: Sequence[str]) -> Iterator[str]:
    """Yield the effects of every robot's wheels, row by row and moment by moment."""
    for r, own in enumerate(by_robot(bodies, wheels)):
        names = [name.rpartition(".")[2].replace("-", "-\n") for name in own]
        wide, lines = headed([*names, "constant"], 8)
        for i, line in enumerate(lines):
            yield ((body_name(own, r) if i == len(lines) - 1 else "").ljust(16) + line).rstrip()
        for row, (name, _) in enumerate(ROWS):
            if not any(effects[r][row].any() for effects in bodies.moments.values()):
                continue  # a joint can but turn
            for moment, effects in bodies.moments.items():
                values = "".join(f"{v:+.2f}".rjust(wide) for v in effects[r][row])
                yield f"{name if moment == 'built' else '':<9}{moment:<7}{values}"
        yield ""


def body_name(own: Sequence[str], number: int) -> str:
    """Return how a body is called: by its number, or like the one agent that it is.

    >>> body_name(["robot1.left", "robot1.right"], 0), body_name(["joint2"], 1)
    ('robot 1', 'joint2')
    """
    return f"robot {number + 1}" if "." in own[0] else own[0]


def headed(names: Sequence[str], least: int) -> tuple[int, list[str]]:
    """Return the width of columns and the lines of their heads, which may have several each."""
    heads = [name.split("\n") for name in names]
    wide = max([least, *(len(part) + 1 for head in heads for part in head)])
    depth = max(map(len, heads))
    padded = [[""] * (depth - len(head)) + head for head in heads]
    return wide, ["".join(head[i].rjust(wide) for head in padded) for i in range(depth)]


def verdicts(bodies: Bodies, wheels: Sequence[str]) -> Iterator[str]:
    """Yield, for every wheel whose drive is not what it was built with, what it is taken for.

    Its drive is the part of its effect that is along the one it was built with; a change within
    two of its standard deviations is said to be uncertain.
    """
    built, last = bodies.moments["built"], bodies.moments["after"]
    for r, names in enumerate(by_robot(bodies, wheels)):
        # A turning rate counts as the speed of a wheel that is built to turn most.
        unit = np.array([1.0, 1.0, 1.0 / max(1.0, float(np.abs(built[r][2]).max()))]) ** 2
        for wheel, name in enumerate(names):
            own = unit * built[r][:, wheel]
            length = float(own @ built[r][:, wheel])
            left = float(own @ last[r][:, wheel]) / length
            around = float(np.sqrt(own**2 @ bodies.deviations[r][:, wheel] ** 2)) / length
            if abs(left - 1.0) > LEAST_CHANGE:
                doubt = "" if abs(left - 1.0) > 2.0 * around else "; uncertain"
                share = f"{left:+.2f} ± {around:.2f} of its drive"
                yield f"{name}: {share}, {_like(left)}{doubt}"


def by_robot(bodies: Bodies, wheels: Sequence[str]) -> Iterator[Sequence[str]]:
    """Yield the names of every robot's wheels."""
    first = 0
    for effect in bodies.moments["built"]:
        yield wheels[first : first + effect.shape[1] - 1]
        first += effect.shape[1] - 1


def _like(left: float) -> str:
    if left < -LEAST_CHANGE:
        return "as if it were reversed"
    if left <= LEAST_CHANGE:
        return "as if it did not drive"
    return "as if it were weak" if left < 1.0 else "more than it was built for"
