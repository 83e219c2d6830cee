"""Kinematics against an oracle of its own: rotations of scipy, composed link by link."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from nested_agents.scenarios.kinematic_chain.variables import forward_kinematics, jacobian


def composed(angles: np.ndarray, length: float) -> np.ndarray:
    """Joints and tip: every link stands on the frame that the joints before it have turned."""
    frame, place, places = Rotation.identity(), np.zeros(3), [np.zeros(3)]
    for angle in angles:
        frame = frame * Rotation.from_euler("z", angle)
        place = place + frame.apply([length, 0.0, 0.0])
        places.append(place)
    return np.array(places)[:, :2]


def test_a_thousand_postures() -> None:
    rng = np.random.default_rng(0)
    for n in (2, 3, 4, 6, 8, 16):
        postures = rng.uniform(-np.pi, np.pi, (170, n))
        found = forward_kinematics(postures.T, 1.0 / n).transpose(1, 0, 2)
        expected = [composed(posture, 1.0 / n) for posture in postures]
        assert np.abs(found - expected).max() < 1e-12


def test_by_hand() -> None:
    places = forward_kinematics(np.array([np.pi / 2, -np.pi / 2]), 0.5)
    assert places == pytest.approx(np.array([[0, 0], [0, 0.5], [0.5, 0.5]]))
    # The tip is half a meter up and to the right of the base, and half a meter right of joint 2.
    assert jacobian(places) == pytest.approx(np.array([[-0.5, 0.5], [0.0, 0.5]]))


@given(st.integers(2, 64), st.integers(0, 2**32 - 1))
def test_the_jacobian_is_the_slope_of_the_tip(n: int, seed: int) -> None:
    angles, small = np.random.default_rng(seed).uniform(-np.pi, np.pi, n), 1e-6
    moves = jacobian(forward_kinematics(angles, 1.0 / n))
    for i in (0, n // 2, n - 1):
        step = small * (np.arange(n) == i)
        ahead, behind = (forward_kinematics(angles + sign * step, 1.0 / n)[-1] for sign in (1, -1))
        assert moves[i] == pytest.approx((ahead - behind) / (2 * small), abs=1e-8)
