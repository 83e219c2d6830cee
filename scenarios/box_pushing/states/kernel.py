"""The kernel that computes the built-in state variables of many situations in one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ....core.numerics import FloatArray, IntArray, njit
from ...state_variables import StateVariable
from .situations import Robot, Situation, SituationBatch, contacts_of, summarize
from .variables import BUILT_IN, NEED_CONTACT


@njit(cache=True, forceinline=True, fastmath={"contract", "nsz"})
def _situation(
    boxes: FloatArray,
    goal: FloatArray,
    origins: FloatArray,
    constants: tuple[float, float, int],
    summary: FloatArray,
    near: FloatArray,
    s: int,
) -> Situation:
    """Return situation s of a batch: the numbers that state variables read."""
    first = s if origins.shape[1] > 1 else 0
    periods, friction_radius, n_robots = constants
    return Situation(
        (boxes[0, s], boxes[1, s], boxes[2, s]),
        (goal[0], goal[1], goal[2]),
        (origins[0, first], origins[1, first], origins[2, first]),
        periods,
        friction_radius,
        n_robots,
        summary[0, s],
        summary[1, s],
        (summary[2, s], summary[3, s]),
        summary[4, s],
        (summary[5, s], summary[6, s]),
        (near[0, s], near[1, s]),
        near[2, s],
        (),
    )


@njit(cache=True, forceinline=True, fastmath={"contract", "nsz"})
def _robot(poses: FloatArray, gaps: FloatArray, near: FloatArray, r: int, i: int, s: int) -> Robot:
    """Return robot r of situation s, which is the one of number i to be evaluated."""
    return Robot(poses[r, 0, s], poses[r, 1, s], poses[r, 2, s], gaps[r, s], near[3 + i, s])


Columns = tuple[int | None, ...]
"""Number of columns; whether `Situation.contact` is needed, else None; then the column of every
built-in variable, or None."""

_TEMPLATE = """
def _evaluate(batch, robots, width, contact, {columns}):
    poses, boxes, gaps, goal, origins, periods, shape = batch
    count, _, m = poses.shape
    summary, values = summarize(batch), np.empty(m)
    near = np.zeros((3 + len(robots), m))
    if contact is not None:
        near = contacts_of(batch, robots)
    out = np.empty((len(robots), m, width))
    constants = periods, shape.friction_radius, count
    {branches}
    return out
"""
_BRANCH = """if {name}_column is not None:
        for i in range(len(robots)):
            r = robots[i]
            if {is_computed}:
                for s in range(m):
                    values[s] = {name}(
                        _situation(boxes, goal, origins, constants, summary, near, s),
                        _robot(poses, gaps, near, r, i, s),
                    )
            for s in range(m):
                out[i, s, {name}_column] = values[s]
    """


def _write_kernel() -> Callable[..., FloatArray]:
    """Write the kernel that calls the built-in functions; numba cannot call them from a list.

    Every column is an argument. Where it is None, its type, numba compiles nothing of the branch.
    """
    branches = [
        _BRANCH.format(name=name, is_computed="i == 0" if variable.common else "True")
        for name, variable in BUILT_IN.items()
    ]
    source = _TEMPLATE.format(
        columns=", ".join(f"{name}_column" for name in BUILT_IN),
        branches="".join(branches),
    )
    names: dict[str, Any] = {name: variable.function for name, variable in BUILT_IN.items()}
    names |= {"__name__": __name__, "np": np, "_situation": _situation, "_robot": _robot}
    names |= {"summarize": summarize, "contacts_of": contacts_of}
    exec(compile(source, __file__, "exec"), names)
    return njit(cache=True, fastmath={"contract", "nsz"})(names["_evaluate"])


_evaluate = _write_kernel()


@njit(cache=True)
def evaluate(batch: SituationBatch, robots: IntArray, columns: Columns) -> FloatArray:
    """Return the built-in variables ``(k, m, width)`` of k robots in m situations.

    Parameters
    ----------
    batch
        The situations. Loops over them are the inner ones, because the compiler turns them into
        vector instructions.
    robots
        ``(k,)`` indices.
    columns
        See `columns_of`. Columns of user-defined variables are left for them to fill.
    """
    return _evaluate(batch, robots, *columns)


def columns_of(variables: Sequence[StateVariable]) -> Columns:
    """Return the columns of built-in variables among others, see `evaluate`."""
    places = {v.variable.name: column for column, v in enumerate(variables) if v.trusted}
    contact = None if NEED_CONTACT.isdisjoint(places) else True
    return (len(variables), contact, *map(places.get, BUILT_IN))


_FIRST = np.zeros(1, np.int64)
_PROGRESS = columns_of(
    [replace(BUILT_IN[name], trusted=True) for name in ("box_distance", "approach", "box_turn")]
)


def progress_of(batch: SituationBatch) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return distance [m], approach [m] and turn [rad] of the box ``(m,)`` in all situations."""
    distance, approach, turn = np.ascontiguousarray(evaluate(batch, _FIRST, _PROGRESS)[0].T)
    return distance, approach, turn
