"""Boxes: mass properties against closed forms and Box2D, friction, scaling, refusals."""

import warnings
from collections.abc import Iterator
from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely.affinity import rotate, translate
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from nested_agents.scenarios.box_pushing.world.boxes import (
    BOXES,
    BoxSpec,
    box_for,
    growth,
)
from nested_agents.scenarios.box_pushing.world.polygons import (
    UNIT,
    Vertices,
    moments,
    polygon_edges,
)
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS
from nested_agents.scenarios.box_pushing.world.settings import BoxSettings, label
from nested_agents.scenarios.box_pushing.world.world import World

L_SHAPE = ((0, 0), (0.2, 0), (0.2, 0.1), (0.1, 0.1), (0.1, 0.2), (0, 0.2))
FRAME = ((0, 0), (0.2, 0), (0.2, 0.2), (0, 0.2))
WINDOW = ((0.05, 0.05), (0.15, 0.05), (0.15, 0.15), (0.05, 0.15))

AREA = 0.04


def star(rng: np.random.Generator, corners: int) -> list[tuple[float, float]]:
    """Return a random simple polygon around the origin."""
    angles = (np.arange(corners) + rng.uniform(0.05, 0.95, corners)) * 2 * pi / corners
    radii = rng.uniform(0.03, 0.15, corners)
    return list(zip(radii * np.cos(angles), radii * np.sin(angles), strict=True))


def regular(corners: int) -> list[tuple[float, float]]:
    """Return a regular polygon."""
    angles = 2 * pi * np.arange(corners) / corners
    return list(zip(0.1 * np.cos(angles), 0.1 * np.sin(angles), strict=True))


def test_inertia_of_known_shapes() -> None:
    square, circle, bar = BOXES["square"], BOXES["circle"], BOXES["bar"]
    assert square.inertia == pytest.approx(square.mass * 0.2**2 / 6, rel=1e-12)
    assert bar.inertia == pytest.approx(bar.mass * (0.08**2 + 0.5**2) / 12, rel=1e-12)
    assert circle.inertia == pytest.approx(circle.mass * circle.radius**2 / 2, rel=1e-12)


def test_friction_radius_of_known_shapes() -> None:
    # Mean distance from the center: (sqrt 2 + asinh 1) / 6 of a square's side, 2/3 of a radius.
    assert BOXES["square"].friction_radius == pytest.approx(0.2 * (sqrt(2) + np.arcsinh(1)) / 6)
    assert BOXES["circle"].friction_radius == pytest.approx(BOXES["circle"].radius * 2 / 3)


@pytest.mark.parametrize("name", BOXES)
def test_every_box(name: str) -> None:
    box = BOXES[name]
    assert box.area == pytest.approx(AREA, rel=1e-12)
    if box.polygon is not None:
        np.testing.assert_allclose(box.polygon.centroid.coords[0], 0, atol=1e-15)
    lever = np.linalg.norm(box.friction_points, axis=1)
    np.testing.assert_allclose(lever, box.friction_radius, rtol=1e-12)
    np.testing.assert_allclose(box.friction_points.mean(axis=0), 0, atol=1e-15)
    # The back is straight, or round, and lies towards -x.
    xs = box.shape.edges[:, 0]
    assert box.radius == 0.0 or box.radius == pytest.approx(np.sqrt(AREA / np.pi))
    assert sum(xs < xs.min() + 1e-9) == (1 if name == "circle" else 2)


@pytest.mark.parametrize("name", BOXES)
def test_box2d_has_the_same_mass(name: str) -> None:
    box = BOXES[name]
    world = World([ROBOTS["e-puck"]], box)  # owns the body
    body = world._box
    assert body.mass == pytest.approx(box.mass, rel=1e-6)
    assert body.inertia == pytest.approx(box.inertia * UNIT**2, rel=1e-6)
    of_fixtures = sum(fixture.massData.mass for fixture in body.fixtures)  # at density 1
    assert of_fixtures == pytest.approx(box.area * UNIT**2, rel=1e-5)


@pytest.mark.slow
@settings(max_examples=150)
@given(
    seed=st.integers(0, 2**32 - 1),
    corners=st.integers(3, 12),
    window=st.booleans(),
    angle=st.floats(0, 2 * pi),
)
def test_pieces_make_up_the_polygon(seed: int, corners: int, window: bool, angle: float) -> None:
    rng = np.random.default_rng(seed)
    vertices = star(rng, corners)
    assume(Polygon(vertices).area >= 1e-4)
    hole = [(0.004, -0.004), (0.004, 0.004), (-0.004, 0.004), (-0.004, -0.004)]
    fits = window and Polygon(vertices).buffer(-1e-4).contains(Polygon(hole))
    geometry = rotate(Polygon(vertices, [hole] if fits else []), angle, use_radians=True)
    moved = orient(translate(geometry, *rng.uniform(-1, 1, 2)))
    outline, *holes = [tuple(ring.coords[:-1]) for ring in (moved.exterior, *moved.interiors)]
    box = BoxSpec("random", outline, tuple(holes))
    assert box.area == pytest.approx(geometry.area, rel=1e-9)
    # Without rounding errors of places far from the origin.
    parts = [moments(polygon_edges(Polygon(piece))) for piece in box.fixtures]
    area = sum(part[0] for part in parts)
    assert area == pytest.approx(geometry.area, rel=1e-9)
    np.testing.assert_allclose(box.polygon.centroid.coords[0], 0, atol=1e-9 * box.reach)
    inertia = sum(float(np.trace(part[1])) for part in parts) * box.mass / area
    assert inertia == pytest.approx(box.inertia, rel=1e-9)
    assert inertia == pytest.approx(_inertia(geometry) * box.mass / area, rel=1e-9)
    for piece in box.fixtures:
        assert 3 <= len(piece) <= 8
        assert Polygon(piece).exterior.is_ccw
        assert Polygon(piece).convex_hull.area == pytest.approx(Polygon(piece).area, rel=1e-9)
    union = shapely.union_all([Polygon(piece) for piece in box.fixtures])
    assert union.area == pytest.approx(geometry.area, rel=1e-9)


def _inertia(polygon: Polygon) -> float:
    """Return the second polar moment of area about the center by triangles, another way [m4]."""
    center = np.array(polygon.centroid.coords[0])
    total = 0.0
    for triangle in shapely.constrained_delaunay_triangles(polygon).geoms:
        corners = np.asarray(triangle.exterior.coords)[:3] - center
        # A triangle's second moment is that of three thirds of its area at the edge middles.
        middles = (corners + np.roll(corners, 1, axis=0)) / 2
        total += triangle.area / 3 * float((middles**2).sum())
    return total


def test_a_described_box_and_its_label() -> None:
    table = BoxSettings(vertices=FRAME, holes=(WINDOW,), mass=0.3)
    box = box_for(table, 2)
    assert (box.area, box.mass) == (pytest.approx(0.03), 0.3)
    assert box_for(label(table), 2) == box
    assert box_for(table, 6) == box
    assert box_for(table.model_copy(update={"grows": True}), 6) == box.scaled(3.0)
    wide = table.model_copy(update={"grows": "width"})
    assert box_for(label(wide), 6) == replace(box, grows="width").scaled(3.0)
    assert [growth(b, 6) for b in (table, wide, "square")] == [1.0, 3.0, 3.0]
    assert growth("square", 1) == 1.0
    assert label("L") == "L"


def test_concave_boxes_and_holes() -> None:
    assert len(BoxSpec("L", L_SHAPE).fixtures) == 2
    frame = BoxSpec("frame", FRAME, holes=(WINDOW,))
    assert frame.area == pytest.approx(0.03)
    assert frame.inertia == pytest.approx(frame.mass / 0.03 * (0.2**4 - 0.1**4) / 6)
    assert len(frame.fixtures) == 4


def test_clockwise_is_turned_around_with_a_word() -> None:
    with pytest.warns(UserWarning, match="clockwise"):
        turned = BoxSpec("L", L_SHAPE[::-1])
    assert turned.area == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"vertices": ((0, 0), (1, 1), (1, 0), (0, 1))}, "not a simple polygon"),
        ({"vertices": ((0, 0), (1, 0), (2, 0))}, "simple|degenerate"),
        ({"vertices": ((0, 0), (1, 0), (0.5, 1e-7))}, "degenerate"),
        ({"vertices": FRAME, "radius": 0.1}, "either"),
        ({"vertices": (*FRAME, FRAME[0])}, "two vertices at the same place"),
        ({"vertices": (FRAME[0], *FRAME)}, "two vertices at the same place"),
        (
            {"vertices": ((0, 0), (1e300, 0), (0, 1e300))},
            r"vertex \(1e\+300, 0\), coordinates must be at most 100 m",
        ),
        ({"vertices": ((-1e308, 0), (1e308, 0), (0, 1))}, "coordinates must be at most 100 m"),
        ({"vertices": FRAME, "holes": [((0, 0), (1e-9, 0), (0, 1e-9))]}, "at the same place"),
        ({"vertices": regular(1001)}, "1001 vertices, allowed: 1000 or fewer"),
        ({}, "either"),
    ],
)
def test_bad_boxes_are_refused(arguments: dict[str, object], word: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ValueError, match=word) as error:
            BoxSpec("bad", **arguments)  # type: ignore[arg-type]
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "vertices",
    [
        ((0, 0), (1e-5, 0), (1e-5, 1e-5)),
        ((0, 0), (2e-5, 0), (2e-5, 2e-5), (0, 2e-5)),
    ],
)
def test_a_piece_too_small_for_the_physics_is_refused_before_it(vertices: Vertices) -> None:
    box = BoxSpec("tiny", vertices)
    with pytest.raises(
        ValueError, match=r"convex piece of it has .* m2, must be at least 1.1921e-09 m2"
    ):
        _ = box.fixtures


@pytest.mark.parametrize("far", [10.0, 1e3, 1e5, 1e6, 2e7])
@pytest.mark.parametrize("rings", [(FRAME,), (L_SHAPE,), (FRAME, WINDOW)])
@pytest.mark.parametrize("growth", [1.0, 32.0])
def test_a_box_is_the_same_anywhere(rings: tuple[Vertices, ...], growth: float, far: float) -> None:
    def moved(x0: float, y0: float) -> BoxSpec:
        outline, *holes = [tuple((x + x0, y + y0) for x, y in ring) for ring in rings]
        return BoxSpec("moved", outline, tuple(holes), mass=0.3).scaled(growth)

    near = moved(0.0, 0.0)
    resolution = 1e-9 + 100 * float(np.spacing(far))  # of given coordinates, over an edge
    for box in (moved(far, far / 3), moved(-far, 0.0)):
        assert box.inertia == pytest.approx(near.inertia, rel=resolution)
        assert box.area == pytest.approx(near.area, rel=resolution)
        assert box.friction_radius == pytest.approx(near.friction_radius, rel=resolution)
        np.testing.assert_allclose(box.shape.edges, near.shape.edges, atol=resolution * near.reach)
        assert len(box.fixtures) == len(near.fixtures)


def test_coordinates_that_are_too_coarse_are_refused() -> None:
    with pytest.raises(ValueError, match=r"coordinates of 1e\+10 m are 1\.9e-06 m apart"):
        BoxSpec("far", ((1e10, 0), (1e10 + 0.2, 0), (1e10 + 0.2, 0.2)))


def slivers(count: int) -> Iterator[Vertices]:
    """Outlines that are nearly degenerate: thin bars, spikes, slits, close vertices."""
    rng = np.random.default_rng(0)
    for k in range(count):
        e = float(10 ** rng.uniform(-8, -2))
        yield (
            ((0, 0), (0.2, 0), (0.2, e), (0, e)),
            ((0, 0), (0.2, 0), (0.2, 0.2), (0.1 + e, 0.2), (0.1, 0.3), (0.1 - e, 0.2), (0, 0.2)),
            ((0, 0), (0.2, 0), (0.2, 0.2), (0.1 + e, 0.2), (0.1, e), (0.1 - e, 0.2), (0, 0.2)),
            ((0, 0), (0.1, -e), (0.2, 0), (0.2, 0.2), (0.2 + e, 0.2), (0.1, 0.2 + e), (0, 0.2)),
            ((0, 0), (0.2, 0), (0.2, 0.2), (0.2 - e, 0.2 + e / 2), (0, 0.2)),
        )[k % 5]


@pytest.mark.parametrize("far", [0.0, 1e5, 3e6])
def test_a_nearly_degenerate_box_is_simulated_or_refused_in_one_line(far: float) -> None:
    simulated = 0
    for outline in slivers(150):
        box, problem = sliver(tuple((x + far, y - far) for x, y in outline))
        assert "\n" not in problem
        if box is not None:
            World([ROBOTS["e-puck"]], box)  # Box2D asserts that it can take the pieces
            simulated += 1
    assert simulated > 50


def sliver(outline: Vertices) -> tuple[BoxSpec | None, str]:
    """Return a box, or none and why it is refused."""
    try:
        box = BoxSpec("sliver", outline)
        _ = box.fixtures
    except ValueError as error:
        return None, str(error)
    return box, ""


@pytest.mark.parametrize("depth", [0.0, 0.4])
def test_many_vertices_are_cut_into_convex_pieces(depth: float) -> None:
    radii = [10 * (1 - depth * (i % 2)) for i in range(1000)]
    ring = [(r * x, r * y) for r, (x, y) in zip(radii, regular(1000), strict=True)]
    box = BoxSpec("gear", tuple(ring))
    pieces = [Polygon(piece) for piece in box.fixtures]
    assert max(len(piece) for piece in box.fixtures) <= 8
    assert sum(piece.area for piece in pieces) == pytest.approx(box.area)


def test_an_outline_of_many_vertices_on_little_space_is_refused_before_box2d_does() -> None:
    with pytest.raises(ValueError, match="fewer vertices"):
        _ = BoxSpec("disc", tuple(regular(1000))).fixtures
    World([ROBOTS["e-puck"]], BoxSpec("disc", tuple(regular(200))))


def test_a_box_may_grow_along_its_width_only() -> None:
    square, wide = BOXES["square"], replace(BOXES["square"], grows="width").scaled(4.0)
    assert wide.width == pytest.approx((-0.4, 0.4))
    assert wide.area == pytest.approx(4 * square.area)
    assert wide.mass == 4 * square.mass
    assert np.ptp(wide.shape.edges[:, 0]) == pytest.approx(0.2)


def test_size_grows_with_the_number_of_robots() -> None:
    assert box_for("square", 1) is box_for("square", 2) is BOXES["square"]
    four = box_for("square", 4)
    assert four.area == pytest.approx(4 * AREA)
    # The same friction per robot as for two.
    assert four.friction_force / 4 == pytest.approx(BOXES["square"].friction_force / 2)
    assert box_for("circle", 3).radius == pytest.approx(1.5 * BOXES["circle"].radius)
    with pytest.raises(ValueError, match=r"box = .egg.: known: L, T, U, bar, circle"):
        box_for("egg", 2)


def test_a_center_of_mass_moves_the_frame_but_not_mass_or_friction() -> None:
    plain = BoxSpec("plain", FRAME)
    loaded = BoxSpec("loaded", FRAME, center_of_mass=(0.05, 0.1))
    corners = {(-0.05, -0.1), (0.15, -0.1), (0.15, 0.1), (-0.05, 0.1)}
    assert {tuple(row) for row in loaded.rings[0].round(12).tolist()} == corners
    assert (loaded.inertia, loaded.friction_radius) == (plain.inertia, plain.friction_radius)
    np.testing.assert_array_equal(loaded.friction_points, plain.friction_points)
    assert loaded.reach == pytest.approx(np.hypot(0.15, 0.1))
    assert loaded.scaled(2.0).center_of_mass == pytest.approx((0.1, 0.2))
    assert loaded.scaled(2.0).reach == pytest.approx(2.0 * loaded.reach)
    same = BoxSpec("same", FRAME, center_of_mass=(0.1, 0.1))
    np.testing.assert_allclose(same.shape.edges, plain.shape.edges, atol=1e-15)


def test_a_box_turns_about_its_own_center_of_mass() -> None:
    # A push through the center of mass does not turn the box; a push beside it does.
    angles = []
    for center in ((0.1, 0.1), (0.1, 0.05)):
        world = World([ROBOTS["e-puck"]], BoxSpec("box", FRAME, center_of_mass=center))
        world.place(np.array([[-0.138, 0.1 - center[1], 0.0]]), np.zeros(3))
        world.advance(np.array([0.13, 0.13]), periods=15)
        angles.append(float(world.box_pose[2]))
    assert abs(angles[0]) < 1e-3 < 0.01 < -angles[1]


def test_a_center_of_mass_outside_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"center_of_mass = \(0.3, 0.1\), must be within"
    ) as caught:
        BoxSpec("loaded", FRAME, center_of_mass=(0.3, 0.1))
    assert "\n" not in str(caught.value)
    hollow = BoxSpec("L", L_SHAPE, center_of_mass=(0.12, 0.12))  # between the arms of the L
    assert hollow.reach > 0.15


def test_the_drawn_outline_of_a_disc_is_a_closed_circle() -> None:
    (ring,) = BOXES["circle"].rings
    np.testing.assert_allclose(np.hypot(*ring.T), BOXES["circle"].radius)
    np.testing.assert_allclose(ring[0], ring[-1], atol=1e-15)
