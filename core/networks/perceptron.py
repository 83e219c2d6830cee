"""Perceptrons in NumPy, with their gradients by hand, and Adam (Kingma and Ba 2015).

Weights of several networks are one array of single precision, so that a step of Adam is a few
operations. Gradients agree with finite differences, see ``tests/core/networks``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from ..interface.agents import Memory
from ..numerics import AnyArray, FloatArray

SQRT2 = float(np.sqrt(2.0))


class Perceptron:
    """Layers with tanh between them.

    Parameters
    ----------
    sizes
        Number of inputs, of units layer by layer, of outputs.

    Attributes
    ----------
    n_weights
        How many weights and biases there are.
    """

    def __init__(self, sizes: Sequence[int]) -> None:
        self.sizes = tuple(sizes)
        self.n_weights = sum((a + 1) * b for a, b in pairwise(sizes))

    def lie_in(self, weights: FloatArray, gradient: FloatArray) -> None:
        """Take weights ``(n_weights,)`` for one's own, and write gradients into another array."""
        self._layers = self._views(weights)
        self._gradients = self._views(gradient)

    def _views(self, flat: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        views = []
        done = 0
        for a, b in pairwise(self.sizes):
            into = flat[done : done + a * b].reshape(a, b)
            done += a * b
            views.append((into, flat[done : done + b]))
            done += b
        return views

    def begin_orthogonal(self, rng: np.random.Generator, last: float) -> None:
        """Begin with orthogonal weights, gain sqrt 2, that of the `last` layer apart; no biases."""
        for k, (into, shift) in enumerate(self._layers):
            gain = last if k == len(self._layers) - 1 else SQRT2
            into[:] = gain * orthogonal(rng, *into.shape)
            shift[:] = 0.0

    def take_from(self, other: Perceptron) -> None:
        """Take the weights of another one of the same layers, those of inputs apart."""
        self._layers[0][1][:] = other._layers[0][1]
        for own, given in zip(self._layers[1:], other._layers[1:], strict=True):
            own[0][:] = given[0]
            own[1][:] = given[1]

    @property
    def first(self) -> FloatArray:
        """What every input weighs ``(inputs, units)``."""
        return self._layers[0][0]

    def __call__(self, inputs: FloatArray) -> FloatArray:
        """Return the outputs ``(m, k)`` for inputs ``(m, d)``."""
        return self.activations(inputs)[-1]

    def activations(self, inputs: FloatArray) -> list[FloatArray]:
        """Return inputs, units layer by layer, and outputs, each ``(m, ...)``."""
        passed = [inputs]
        for k, (into, shift) in enumerate(self._layers):
            outputs = passed[-1] @ into
            outputs += shift
            if k < len(self._layers) - 1:
                np.tanh(outputs, out=outputs)
            passed.append(outputs)
        return passed

    def descend(self, passed: Sequence[FloatArray], slopes: FloatArray) -> None:
        """Write the gradient of a loss, given its slopes by the outputs ``(m, k)``."""
        for k in range(len(self._layers) - 1, -1, -1):
            into, shift = self._gradients[k]
            np.matmul(passed[k].T, slopes, out=into)
            slopes.sum(axis=0, out=shift)
            if k:
                slopes = slopes @ self._layers[k][0].T
                slopes *= 1.0 - passed[k] ** 2


def orthogonal(rng: np.random.Generator, rows: int, columns: int) -> FloatArray:
    """Return a matrix with orthonormal rows or columns, whichever are fewer (Saxe et al. 2014)."""
    drawn = rng.normal(size=(max(rows, columns), min(rows, columns)))
    q, r = np.linalg.qr(drawn)
    q *= np.sign(np.diag(r))
    return q if rows >= columns else q.T


class Adam:
    """Steps along gradients, each scaled by its own recent size.

    Parameters
    ----------
    weights, gradient
        ``(k,)`` what is changed, and where its gradient will stand.
    """

    DECAY = 0.9
    DECAY_OF_SQUARES = 0.999
    SMALL = 1e-5

    def __init__(self, weights: FloatArray, gradient: FloatArray) -> None:
        self._weights = weights
        self._gradient = gradient
        self._mean = np.zeros_like(weights)
        self._squares = np.zeros_like(weights)
        self._steps = 0

    def step(self, size: float, most: float) -> None:
        """Go one step; a gradient longer than `most` is cut to it."""
        g = self._gradient
        length = float(np.sqrt(np.dot(g, g)))
        if length > most:
            g *= np.float32(most / (length + 1e-6))
        self._steps += 1
        self._mean += (1.0 - self.DECAY) * (g - self._mean)
        self._squares += (1.0 - self.DECAY_OF_SQUARES) * (g * g - self._squares)
        mean_share = 1.0 - self.DECAY**self._steps
        square_share = 1.0 - self.DECAY_OF_SQUARES**self._steps
        scale = np.sqrt(self._squares / np.float32(square_share)) + np.float32(self.SMALL)
        self._weights -= np.float32(size / mean_share) * self._mean / scale

    def memory(self) -> Memory:
        """Return what it remembers."""
        steps = np.array(self._steps)
        return {"mean": self._mean.copy(), "squares": self._squares.copy(), "steps": steps}

    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Continue from what `memory` returned."""
        self._mean[:] = memory["mean"]
        self._squares[:] = memory["squares"]
        self._steps = int(memory["steps"])


class RunningMoments:
    """Mean and variance of all numbers so far, taken in many at a time (Chan et al. 1979)."""

    def __init__(self) -> None:
        self._count = 1e-4
        self._mean = 0.0
        self._squares = 1e-4

    def add(self, values: FloatArray) -> None:
        """Take in values of any shape."""
        size = float(values.size)
        mean = float(values.mean())
        gap = mean - self._mean
        total = self._count + size
        self._squares += float(((values - mean) ** 2).sum()) + gap**2 * self._count * size / total
        self._mean += gap * size / total
        self._count = total

    @property
    def mean(self) -> float:
        """Mean so far."""
        return self._mean

    @property
    def deviation(self) -> float:
        """Standard deviation so far."""
        return float(np.sqrt(self._squares / self._count))

    def memory(self) -> AnyArray:
        """Return what it remembers ``(3,)``."""
        return np.array([self._count, self._mean, self._squares])

    def restore(self, memory: AnyArray) -> None:
        """Continue from what `memory` returned."""
        self._count, self._mean, self._squares = memory.tolist()
