"""Infrared sensors: known readings, and the kernel against its NumPy twin."""

from dataclasses import replace
from math import exp

import numpy as np
import pytest

from nested_agents.scenarios.boxes import BOXES
from nested_agents.scenarios.infrared import (
    INFRARED,
    InfraredSpec,
    expected_reading,
    infrared_readings,
    infrared_readings_numpy,
    sensor_directions,
    strongest_reading,
)
from nested_agents.scenarios.robots import E_PUCK_SENSORS, ROBOTS
from nested_agents.scenarios.world import World

SPEC = INFRARED["e-puck"]


@pytest.mark.parametrize("box", ["square", "circle", "triangle"])
def test_kernel_equals_its_twin(box: str) -> None:
    rng = np.random.default_rng(7)
    outline = BOXES[box].outline
    radii = np.full(3, 0.037)
    sensors = np.array([E_PUCK_SENSORS] * 3)
    seen = 0
    for _ in range(60):
        robots = rng.uniform([-0.2, -0.2, -3], [0.2, 0.2, 3], (3, 3))
        pose = rng.uniform([-0.1, -0.1, -3], [0.1, 0.1, 3])
        got = infrared_readings(
            robots, radii, sensors, pose, outline.edges, outline.rounding, SPEC.reach, SPEC.decay
        )
        twin = infrared_readings_numpy(robots, radii, sensors, pose, outline, SPEC)
        np.testing.assert_allclose(got, twin, atol=1e-6)
        assert ((got >= 0) & (got <= 1)).all()
        seen += int(np.count_nonzero(got))
    assert seen > 100


def test_readings_by_hand() -> None:
    world = World([ROBOTS["e-puck"]] * 2, BOXES["square"])
    # The first looks at the box with ps5 (90 degrees left), 3 cm away; the second is 2 cm to the
    # right of it, where ps2 looks.
    world.place(
        np.array([[0.0, -0.1 - 0.037 - 0.03, 0.0], [0.0, -0.261, 0.0]]), np.array([0.0, 0.0, 0.0])
    )
    readings = world.infrared()
    assert readings.shape == (2, 8)
    assert readings[0, 5] == pytest.approx(exp(-0.03 / SPEC.decay))
    assert readings[0, 2] == pytest.approx(exp(-0.02 / SPEC.decay))
    assert readings[1, 5] == pytest.approx(exp(-0.02 / SPEC.decay))
    assert world.infrared_of_box()[0, 2] == 0.0
    strongest = strongest_reading(world)
    assert strongest[0] == pytest.approx(exp(-0.03 / SPEC.decay))
    assert strongest[1] == 0.0
    np.testing.assert_allclose(expected_reading(world.gaps), strongest, atol=1e-12)


def test_touching_reads_one_and_far_reads_zero() -> None:
    np.testing.assert_array_equal(SPEC.reading(np.array([-0.001, 0.0, 0.06, 1.0])), [1, 1, 0, 0])


def test_bad_sensors_are_refused() -> None:
    with pytest.raises(ValueError, match="reach = 0"):
        InfraredSpec("blind", 0.0, 0.01)
    blind = [ROBOTS["e-puck"], replace(ROBOTS["e-puck"], sensors=(0.0,))]
    with pytest.raises(ValueError, match="same number"):
        sensor_directions(blind)
