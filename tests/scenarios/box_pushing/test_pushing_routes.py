"""Ways around a box."""

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.pushing_points import moved, paths
from nested_agents.scenarios.box_pushing.world.boxes import BOXES


def test_constant_twists_lead_along_arcs() -> None:
    start = np.array([[1.0, 2.0, np.pi / 2]] * 2)
    straight, arc = moved(start, np.array([[0.1, 0, 0], [0.1, 0, 1.0]]), np.pi / 2)
    np.testing.assert_allclose(straight, [1.0, 2.0 + 0.05 * np.pi, np.pi / 2])
    # A quarter of a circle of radius 0.1 to the left.
    np.testing.assert_allclose(arc, [0.9, 2.1, np.pi], atol=1e-12)


def test_ways_lead_around_the_box() -> None:
    box = BOXES["square"]
    edges, target = box.outline.edges, np.array([0.0, 0.3])
    poses = np.array([[0.2, 0.3, 0.0], [0.0, -0.3, 0.0], [0.0, 0.12, 0.0]])
    free, around, near = paths(poses, target, np.zeros(3), edges, 0.0, 0.04, box.reach)
    assert free == pytest.approx(0.2)
    ring = box.reach + 0.05
    assert around == pytest.approx(np.pi * ring + 2 * (0.3 - ring))
    assert near == pytest.approx(0.18 + 20 * 0.02)  # too close to the box
