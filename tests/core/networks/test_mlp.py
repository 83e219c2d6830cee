"""Perceptrons, Adam and running moments against hand-worked numbers and finite differences."""

import numpy as np
import pytest

from nested_agents.core.networks.mlp import MLP, Adam, RunningMoments, orthogonal


def bound(sizes, weights):
    network = MLP(sizes)
    gradient = np.zeros_like(weights)
    network.bind_storage(weights, gradient)
    return network, gradient


def test_outputs_by_hand():
    network, _ = bound((2, 1, 2), np.array([1.0, -1.0, 0.5, 2.0, 3.0, 10.0, 20.0]))
    hidden = np.tanh(3.0 - 1.0 + 0.5)
    assert network.n_weights == 7
    assert network(np.array([[3.0, 1.0]])) == pytest.approx(
        np.array([[2.0 * hidden + 10.0, 3.0 * hidden + 20.0]])
    )


def test_gradients_agree_with_finite_differences():
    rng = np.random.default_rng(0)
    sizes = (3, 5, 4, 2)
    weights = rng.normal(size=MLP(sizes).n_weights)
    network, gradient = bound(sizes, weights)
    inputs, slopes = rng.normal(size=(7, 3)), rng.normal(size=(7, 2))
    network.backward(network.forward(inputs), slopes)
    for k in range(len(weights)):
        ends = []
        for step in (1e-6, -1e-6):
            weights[k] += step
            ends.append(float((network(inputs) * slopes).sum()))
            weights[k] -= step
        assert gradient[k] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-6)


def test_inputs_keep_their_weights_elsewhere():
    rng = np.random.default_rng(0)
    former, _ = bound((2, 3, 1), rng.normal(size=13))
    wider, _ = bound((3, 3, 1), rng.normal(size=16))
    wider.warm_start(former, [1, None, 0])
    assert wider(np.array([[5.0, 99.0, 7.0]])) == pytest.approx(former(np.array([[7.0, 5.0]])))


@pytest.mark.parametrize("shape", [(3, 7), (7, 3), (4, 4)])
def test_orthogonal(shape):
    drawn = orthogonal(np.random.default_rng(0), *shape)
    short = drawn @ drawn.T if shape[0] <= shape[1] else drawn.T @ drawn
    assert np.allclose(short, np.eye(min(shape)))


def test_adam_by_hand():
    weights, gradient = np.array([1.0, 1.0]), np.array([0.0, 0.0])
    adam = Adam(weights, gradient)
    gradient[:] = 3.0, 4.0
    adam.step(0.1, max_norm=0.5)  # scaled to (0.3, 0.4): the first step has the size of the rate
    assert weights == pytest.approx([0.9, 0.9], abs=1e-5)
    gradient[:] = -0.3, 0.0
    adam.step(0.1, max_norm=0.5)
    mean = (0.9 * 0.03 - 0.03) / (1 - 0.9**2)
    squares = (0.999 * 0.00009 + 0.00009) / (1 - 0.999**2)
    assert weights[0] == pytest.approx(0.9 - 0.1 * mean / np.sqrt(squares), abs=1e-5)


def test_moments_are_those_of_all_values():
    parts = [np.arange(5.0), np.array([[10.0, -3.0]]), np.full(3, 2.0)]
    moments = RunningMoments()
    for part in parts:
        moments.add(part)
    values = np.concatenate([part.ravel() for part in parts])
    assert moments.memory[1] == pytest.approx(values.mean(), abs=1e-3)
    assert moments.deviation == pytest.approx(values.std(), abs=1e-2)
