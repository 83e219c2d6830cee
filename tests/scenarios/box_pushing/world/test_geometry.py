"""Signed distance and rays: known answers, and the kernels against their NumPy references."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from world_oracles import ray_numpy, surface_numpy

from nested_agents.core.numerics import FloatArray
from nested_agents.scenarios.box_pushing.world import geometry
from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.scenarios.box_pushing.world.geometry import (
    Outline,
    ray,
    ring_edges,
    surface,
)

L_SHAPE = ring_edges(np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0], [0, 0], [0, 0.1], [-0.1, 0.1]]))
HOLE = ring_edges(np.array([[-0.08, -0.08], [-0.08, -0.02], [-0.02, -0.02], [-0.02, -0.08]]))
PLATE = np.vstack([L_SHAPE, HOLE])
SQUARE = ring_edges(np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]))
DISC = np.zeros((1, 4))
OUTLINES = [(PLATE, 0.0), (PLATE, 0.01), (SQUARE, 0.0), (DISC, 0.1)]
coordinates = st.floats(-0.25, 0.25)


@pytest.mark.parametrize(
    ("point", "distance", "normal", "nearest"),
    [
        ((0.3, 0.05), 0.2, (1, 0), (0.1, 0.05)),
        ((0.09, 0.02), -0.01, (1, 0), (0.1, 0.02)),
        ((0.1, 0.02), 0.0, (1, 0), (0.1, 0.02)),
        ((-0.13, -0.14), 0.05, (-0.6, -0.8), (-0.1, -0.1)),
    ],
)
def test_square(
    point: tuple[float, float],
    distance: float,
    normal: tuple[float, float],
    nearest: tuple[float, float],
) -> None:
    got = surface(SQUARE, 0.0, *point)
    np.testing.assert_allclose(got, (distance, *normal, *nearest), atol=1e-14)


def test_inside_a_hole_is_outside_the_material() -> None:
    assert surface(PLATE, 0.0, -0.05, -0.05)[0] == pytest.approx(0.03)
    assert surface(PLATE, 0.0, -0.01, -0.05)[0] == pytest.approx(-0.01)
    assert surface(PLATE, 0.0, 0.03, 0.02)[0] == pytest.approx(0.02)  # in the notch of the L


def test_rays() -> None:
    assert ray(SQUARE, 0.0, -0.15, 0.0, 1.0, 0.0, 1.0) == pytest.approx(0.05)
    assert ray(SQUARE, 0.0, -0.15, 0.0, -1.0, 0.0, 1.0) == 1.0
    assert ray(SQUARE, 0.0, 0.05, 0.0, 1.0, 0.0, 1.0) == 0.0
    assert ray(DISC, 0.1, 0.0, -0.3, 0.0, 1.0, 1.0) == pytest.approx(0.2)
    assert ray(DISC, 0.1, 0.0, -0.3, 0.0, 1.0, 0.15) == 0.15
    # Out of the hole, across the wall: the wall's inner face is hit.
    assert ray(PLATE, 0.0, -0.05, -0.05, 1.0, 0.0, 1.0) == pytest.approx(0.03)


@given(x=coordinates, y=coordinates, which=st.integers(0, len(OUTLINES) - 1))
def test_surface_equals_its_reference(x: float, y: float, which: int) -> None:
    edges, rounding = OUTLINES[which]
    got, reference = surface(edges, rounding, x, y), surface_numpy(edges, rounding, x, y)
    assert got[0] == pytest.approx(reference[0], abs=1e-12)
    for distance, nx, ny, px, py in (got, reference):
        assert np.hypot(nx, ny) == pytest.approx(1.0, abs=1e-12)
        # The point is its nearest surface point plus the distance along the normal. (The two may
        # choose another one of two nearest points.)
        np.testing.assert_allclose([px + distance * nx, py + distance * ny], [x, y], atol=1e-11)


@pytest.mark.parametrize("edges", [PLATE, SQUARE, DISC])
def test_nearest_points_side_by_side_are_those_of_the_surface(edges: FloatArray) -> None:
    rows = np.zeros(geometry.NEAREST_SIZE)
    block = rows.reshape(-1, geometry.LANES)
    block[:2] = np.random.default_rng(0).uniform(-0.25, 0.25, block[:2].shape)
    block[:2, 0] = edges[0, :2] + 0.25 * (edges[0, 2:] - edges[0, :2])  # on the surface
    geometry.nearest_points(edges, rows, geometry.LANES)
    for x, y, square, px, py, side, ex, ey in block.T:
        expected = surface(edges, 0.0, x, y)
        got = side * np.sqrt(square), px, py
        np.testing.assert_allclose(got, (expected[0], *expected[3:]), atol=1e-14)
        if square <= geometry.ON_SURFACE**2:
            np.testing.assert_allclose((ey, -ex), expected[1:3], atol=1e-14)


@pytest.mark.parametrize("name", ["square", "triangle", "T", "circle"])
@pytest.mark.parametrize("farthest", [0.05, 3.0])
def test_points_before_one_edge_have_the_bits_of_points_all_around(
    name: str, farthest: float
) -> None:
    edges = BOXES[name].outline.edges
    rng = np.random.default_rng(0)
    for edge in edges:
        along = edge[2:] - edge[:2]
        across = np.array([along[1], -along[0]]) / max(np.hypot(*along), 1e-9)
        shares = rng.uniform(0, 1, (geometry.LANES, 1)) ** 8  # many next to an end
        points = edge[:2] + shares * along + rng.uniform(0, farthest, shares.shape) * across
        before = np.zeros((8, geometry.LANES))
        before[:2] = points.T
        around = before.copy()
        around[:2, 0] = 0.0  # the first stands within
        geometry.nearest_points(edges, before.ravel(), geometry.LANES)
        geometry.nearest_points(edges, around.ravel(), geometry.LANES)
        np.testing.assert_array_equal(before[:6, 1:], around[:6, 1:])


@given(
    x=coordinates,
    y=coordinates,
    angle=st.floats(0, 6.28),
    which=st.integers(0, len(OUTLINES) - 1),
)
def test_ray_equals_its_reference(x: float, y: float, angle: float, which: int) -> None:
    edges, rounding = OUTLINES[which]
    direction = np.cos(angle), np.sin(angle)
    got = ray(edges, rounding, x, y, *direction, 0.3)
    reference = ray_numpy(edges, rounding, x, y, *direction, 0.3)
    if abs(got - reference) > 1e-7:
        # Only a ray that grazes the surface may be judged differently, or is given up beside it.
        travelled = min(got, reference)
        point = x + travelled * direction[0], y + travelled * direction[1]
        assert abs(surface(edges, rounding, *point)[0]) < 0.3 / 2000


def test_radius_reaches_the_farthest_point() -> None:
    assert Outline(SQUARE).radius == pytest.approx(0.1 * np.sqrt(2))
    assert Outline(DISC, 0.1).radius == pytest.approx(0.1)
