"""Nearest points, signed distances and rays: known answers and NumPy references."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from world_oracles import ray_numpy, surface_numpy

from nested_agents.scenarios.angles import cos_sin
from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.scenarios.box_pushing.world.geometry import (
    LANES,
    NEAREST,
    BoxShape,
    distances,
    nearest_points,
    ray,
    surface,
)
from nested_agents.scenarios.box_pushing.world.polygons import ring_edges

L_SHAPE = ring_edges(np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0], [0, 0], [0, 0.1], [-0.1, 0.1]]))
HOLE = ring_edges(np.array([[-0.08, -0.08], [-0.08, -0.02], [-0.02, -0.02], [-0.02, -0.08]]))
PLATE = BoxShape(np.vstack([L_SHAPE, HOLE]), 0.0, 0.1)
SQUARE = BoxShape(
    ring_edges(np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]])), 0.0, 0.1
)
DISC = BoxShape(np.zeros((1, 4)), 0.1, 0.1)
SHAPES = [PLATE, SQUARE, DISC]
coordinates = st.floats(-0.25, 0.25)


@pytest.mark.parametrize(
    ("point", "distance", "normal"),
    [
        ((0.3, 0.05), 0.2, (1, 0)),
        ((0.09, 0.02), -0.01, (1, 0)),
        ((0.1, 0.02), 0.0, (0, 0)),
        ((-0.13, -0.14), 0.05, (-0.6, -0.8)),
    ],
)
def test_square(point: tuple[float, float], distance: float, normal: tuple[float, float]) -> None:
    np.testing.assert_allclose(surface(SQUARE, *point), (distance, *normal), atol=1e-13)


def test_inside_a_hole_is_outside_the_material() -> None:
    points = np.array([[-0.05, -0.05], [-0.01, -0.05], [0.03, 0.02]])  # the last in the notch
    np.testing.assert_allclose(distances(*points.T.copy(), PLATE), [0.03, -0.01, 0.02])


@pytest.mark.parametrize("count", [1, LANES, LANES + 1, 2 * LANES + 1])
def test_the_last_block_of_points_may_be_incomplete(count: int) -> None:
    x = np.linspace(0.15, 0.3, count)
    np.testing.assert_allclose(distances(x, np.zeros(count), SQUARE), x - 0.1, atol=1e-13)


def test_rays() -> None:
    assert ray(SQUARE, -0.15, 0.0, 1.0, 0.0, 1.0) == pytest.approx(0.05)
    assert ray(SQUARE, -0.15, 0.0, -1.0, 0.0, 1.0) == 1.0
    assert ray(SQUARE, 0.05, 0.0, 1.0, 0.0, 1.0) == 0.0
    assert ray(DISC, 0.0, -0.3, 0.0, 1.0, 1.0) == pytest.approx(0.2)
    assert ray(DISC, 0.0, -0.3, 0.0, 1.0, 0.15) == 0.15
    # Out of the hole, across the wall: the wall's inner face is hit.
    assert ray(PLATE, -0.05, -0.05, 1.0, 0.0, 1.0) == pytest.approx(0.03)


@given(x=coordinates, y=coordinates, which=st.integers(0, len(SHAPES) - 1))
def test_surface_equals_its_reference(x: float, y: float, which: int) -> None:
    shape = SHAPES[which]
    distance, nx, ny = surface(shape, x, y)
    assert distance == pytest.approx(surface_numpy(shape, x, y)[0], abs=1e-12)
    if abs(distance + shape.radius) > 1e-6:
        assert np.hypot(nx, ny) == pytest.approx(1.0, abs=1e-9)
        # Along the normal lies a point of the surface.
        nearest = x - distance * nx, y - distance * ny
        assert surface_numpy(shape, *nearest)[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("name", ["square", "triangle", "T", "circle"])
@pytest.mark.parametrize("farthest", [0.05, 3.0])
def test_blocks_before_one_edge_have_the_bits_of_mixed_blocks(name: str, farthest: float) -> None:
    edges = BOXES[name].shape.edges
    rng = np.random.default_rng(0)
    for edge in edges:
        along = edge[2:] - edge[:2]
        across = np.array([along[1], -along[0]]) / max(np.hypot(*along), 1e-9)
        shares = rng.uniform(0, 1, (LANES, 1)) ** 8  # many next to an end
        points = edge[:2] + shares * along + rng.uniform(0, farthest, shares.shape) * across
        before, mixed = np.zeros(2, NEAREST)
        for block in (before, mixed):
            block.x[:], block.y[:] = points.T
        mixed.x[0] = mixed.y[0] = 0.0  # inside
        nearest_points(edges, before)
        nearest_points(edges, mixed)
        for row in ("near_x", "near_y", "distance"):
            np.testing.assert_array_equal(before[row][1:], mixed[row][1:])


@given(
    x=coordinates, y=coordinates, angle=st.floats(0, 6.28), which=st.integers(0, len(SHAPES) - 1)
)
def test_ray_equals_its_reference(x: float, y: float, angle: float, which: int) -> None:
    shape = SHAPES[which]
    direction = np.cos(angle), np.sin(angle)
    got = ray(shape, x, y, *direction, 0.3)
    reference = ray_numpy(shape, x, y, *direction, 0.3)
    if abs(got - reference) > 1e-7:
        # Only a ray that grazes the surface may be judged differently, or is given up beside it.
        traveled = min(got, reference)
        point = x + traveled * direction[0], y + traveled * direction[1]
        assert abs(surface(shape, *point)[0]) < 0.3 / 2000


@given(st.floats(-1e4, 1e4))
def test_cosine_and_sine_are_exact_to_the_last_bit_but_one(angle: float) -> None:
    np.testing.assert_allclose(cos_sin(angle), (np.cos(angle), np.sin(angle)), rtol=0, atol=3e-16)


def test_reach_is_the_farthest_point() -> None:
    assert BOXES["square"].reach == pytest.approx(0.1 * np.sqrt(2))
    assert BOXES["circle"].reach == pytest.approx(BOXES["circle"].radius)
