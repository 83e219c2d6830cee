"""Multilayer perceptrons with their gradients, Adam, and running moments.

Weights of several networks share one array of single precision, so that a step of Adam is a few
operations. Gradients are compared with finite differences in ``tests/core/networks``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from ..interface.agents import StateDict
from ..numerics import AnyArray, FloatArray

HIDDEN_GAIN = float(np.sqrt(2.0))
"""Gain of the orthogonal initialization of hidden layers."""


class MLP:
    """Multilayer perceptron with hyperbolic tangents between its layers.

    Parameters
    ----------
    sizes
        Numbers of inputs, of units layer by layer, and of outputs.

    Attributes
    ----------
    n_weights
        Number of weights and biases.

    Examples
    --------
    >>> network = MLP((2, 1))
    >>> network.bind_storage(np.array([2.0, 3.0, 1.0]), np.zeros(3))
    >>> network(np.array([[10.0, 100.0]])).tolist()
    [[321.0]]
    """

    def __init__(self, sizes: Sequence[int]) -> None:
        self.sizes = tuple(sizes)
        self.n_weights = sum((a + 1) * b for a, b in pairwise(sizes))

    def bind_storage(self, weights: FloatArray, gradient: FloatArray) -> None:
        """Use slices of the caller's arrays ``(n_weights,)`` as weights and as gradient."""
        self._layers = self._views(weights)
        self._gradients = self._views(gradient)

    def _views(self, flat: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Return matrix and biases of every layer as views of a flat array."""
        views = []
        start = 0
        for a, b in pairwise(self.sizes):
            matrix = flat[start : start + a * b].reshape(a, b)
            start += a * b
            views.append((matrix, flat[start : start + b]))
            start += b
        return views

    def initialize(self, rng: np.random.Generator, output_gain: float) -> None:
        """Initialize matrices orthogonally (Saxe et al. 2014), and biases with zeros."""
        for k, (matrix, biases) in enumerate(self._layers):
            gain = output_gain if k == len(self._layers) - 1 else HIDDEN_GAIN
            matrix[:] = gain * orthogonal(rng, *matrix.shape)
            biases[:] = 0.0

    def warm_start(self, other: MLP, rows: Sequence[int | None]) -> None:
        """Copy the weights of a network of equal layers; the inputs may differ.

        Parameters
        ----------
        other
            The other network.
        rows
            Per input the row of the same input in the other network. An input that the other
            network does not have gets zero weights.
        """
        for (matrix, biases), (given, shift) in zip(self._layers, other._layers, strict=True):
            biases[:] = shift
            if matrix is not self._layers[0][0]:
                matrix[:] = given
        inputs = self._layers[0][0]
        for row, source in enumerate(rows):
            inputs[row] = 0.0 if source is None else other._layers[0][0][source]

    def __call__(self, inputs: FloatArray) -> FloatArray:
        """Return the outputs ``(m, k)`` for inputs ``(m, d)``."""
        return self.forward(inputs)[-1]

    def forward(self, inputs: FloatArray) -> list[FloatArray]:
        """Return the inputs, the activations of hidden layers, and the outputs."""
        activations = [inputs]
        for k, (matrix, biases) in enumerate(self._layers):
            outputs = activations[-1] @ matrix
            outputs += biases
            if k < len(self._layers) - 1:
                np.tanh(outputs, out=outputs)
            activations.append(outputs)
        return activations

    def backward(self, activations: Sequence[FloatArray], gradient: FloatArray) -> None:
        """Write the gradient of a loss by weights, given that by the outputs ``(m, k)``."""
        for k in range(len(self._layers) - 1, -1, -1):
            matrix, biases = self._gradients[k]
            np.matmul(activations[k].T, gradient, out=matrix)
            gradient.sum(axis=0, out=biases)
            if k:
                gradient = gradient @ self._layers[k][0].T
                gradient *= 1.0 - activations[k] ** 2


def orthogonal(rng: np.random.Generator, rows: int, columns: int) -> FloatArray:
    """Return a random matrix with orthonormal rows, or columns if these are fewer."""
    normal = rng.normal(size=(max(rows, columns), min(rows, columns)))
    q, r = np.linalg.qr(normal)
    q *= np.sign(np.diag(r))
    return q if rows >= columns else q.T


class Adam:
    """Adam optimizer (Kingma and Ba 2015).

    Parameters
    ----------
    weights, gradient
        ``(k,)`` arrays that the optimizer changes, and that hold the gradient.
    """

    BETA1 = 0.9
    BETA2 = 0.999
    EPSILON = 1e-5

    def __init__(self, weights: FloatArray, gradient: FloatArray) -> None:
        self._weights = weights
        self._gradient = gradient
        self._mean = np.zeros_like(weights)
        self._squares = np.zeros_like(weights)
        self._steps = 0

    def step(self, learning_rate: float, max_norm: float) -> None:
        """Take one step; a gradient longer than `max_norm` is scaled to it."""
        g = self._gradient
        norm = float(np.sqrt(np.dot(g, g)))
        if norm > max_norm:
            g *= np.float32(max_norm / (norm + 1e-6))
        self._steps += 1
        self._mean += (1.0 - self.BETA1) * (g - self._mean)
        self._squares += (1.0 - self.BETA2) * (g * g - self._squares)
        mean_share = 1.0 - self.BETA1**self._steps
        square_share = 1.0 - self.BETA2**self._steps
        scale = np.sqrt(self._squares / np.float32(square_share)) + np.float32(self.EPSILON)
        self._weights -= np.float32(learning_rate / mean_share) * self._mean / scale

    def state_dict(self) -> StateDict:
        """Return moments and number of steps."""
        steps = np.array(self._steps)
        return {"mean": self._mean.copy(), "squares": self._squares.copy(), "steps": steps}

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`."""
        self._mean[:] = state["mean"]
        self._squares[:] = state["squares"]
        self._steps = int(state["steps"])


class RunningMoments:
    """Mean and variance of all values so far, updated by batches (Chan et al. 1979)."""

    def __init__(self) -> None:
        self.memory = np.array([1e-4, 0.0, 1e-4])
        """Number of values, their mean, and the sum of squared deviations."""

    def add(self, values: FloatArray) -> None:
        """Add values of any shape."""
        count, former, squares = self.memory.tolist()
        size = float(values.size)
        mean = float(values.mean())
        gap = mean - former
        total = count + size
        squares += float(((values - mean) ** 2).sum()) + gap**2 * count * size / total
        self.memory[:] = total, former + gap * size / total, squares

    @property
    def deviation(self) -> float:
        """Standard deviation so far."""
        count, _, squares = self.memory.tolist()
        return float(np.sqrt(squares / count))
