"""Compiles the kernels of a spec's trials before there is all that a trial needs.

``python -m nested_agents.studies.trials.rehearsal SPEC MODULE`` runs a few steps of each condition,
in which nothing moves: the module need not be installed, a `Still` stands in for it. A
kernel is compiled for the types of its arguments, which are the same as ever. The trials then take
it from the cache, and compile what else they call.

It takes 19 s of processor time, and the demo takes 64 s after it, not 78 s (means of two runs of
each). So it saves no work: it does the compiler's work while Box2D is built on the other core, for
which a fresh ``./dev demo`` would have to wait otherwise.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...core.numerics import FloatArray, Kernel
from ..spec.spec import Spec
from .trial import trials_of

EPISODES = 2
"""Episodes of training: in the second one learns from the first."""
STEPS = 3


class Still(float):
    """Zero, which is also each of its attributes and what it returns when it is called."""

    def __getattr__(self, name: str) -> "Still":
        """Return the same."""
        return self

    def __call__(self, *args: object, **named: object) -> "Still":
        """Return the same."""
        return self


class Stood:
    """A kernel that moves bodies, which is compiled only: bodies stand where they are.

    Parameters
    ----------
    kernel
        See `nested_agents.scenarios.box_pushing.world.stepping.advance`.
    """

    def __init__(self, kernel: object) -> None:
        assert isinstance(kernel, Kernel)
        self._kernel = kernel

    def __call__(self, *args: object) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return poses, gaps and contact times."""
        self._kernel.prepare(*args)
        bodies = args[2]
        assert isinstance(bodies, np.ndarray)
        n_robots = len(bodies) - 1
        return np.zeros((n_robots + 1, 3)), np.ones(n_robots), np.zeros(n_robots)


def rehearse(spec: Spec) -> None:
    """Train and evaluate the team of the first trial of each condition for a few steps."""
    from ...scenarios.box_pushing.world import stepping, world
    from .session import Session

    vars(world).update(step_address=lambda: 0, advance=Stood(stepping.advance))

    for trial in trials_of(spec)[: len(spec.conditions())]:
        session = Session(replace(trial, episodes=EPISODES, steps=STEPS, evaluation=1))
        session.train(EPISODES)
        session.finish()


if __name__ == "__main__":
    file, module = sys.argv[1:]
    sys.modules[module] = Still()  # type: ignore[assignment]
    rehearse(Spec.parse(Path(file).read_text(encoding="utf-8")))
