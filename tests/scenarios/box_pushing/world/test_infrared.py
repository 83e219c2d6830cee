"""Infrared sensors: known readings, and the kernel against its NumPy reference."""

from math import exp

import numpy as np
import pytest
from world_oracles import infrared_readings_numpy

from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.scenarios.box_pushing.world.geometry import gaps
from nested_agents.scenarios.box_pushing.world.infrared import InfraredSensors, infrared_readings
from nested_agents.scenarios.box_pushing.world.robots import (
    E_PUCK_SENSORS,
    ROBOTS,
    sensor_directions,
)
from nested_agents.scenarios.box_pushing.world.settings import InfraredSettings
from nested_agents.scenarios.box_pushing.world.world import World
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec

SPEC = InfraredSettings()
RNG = np.random.default_rng(0)


@pytest.mark.parametrize("box", ["square", "circle", "triangle"])
def test_kernel_equals_its_reference(box: str) -> None:
    spec = InfraredSettings()
    rng = np.random.default_rng(7)
    shape = BOXES[box].shape
    radii = np.full(3, 0.037)
    sensors = np.array([E_PUCK_SENSORS] * 3)
    seen = 0
    for _ in range(60):
        robots = rng.uniform([-0.3, -0.3, -3], [0.3, 0.3, 3], (3, 3))
        pose = rng.uniform([-0.1, -0.1, -3], [0.1, 0.1, 3])
        kernel = InfraredSensors(radii, sensors, spec.response)
        apart = gaps(robots, pose, shape, radii)
        got = infrared_readings(robots, pose, apart, shape, kernel)
        outside = apart >= 0
        reference = infrared_readings_numpy(robots, radii, sensors, pose, shape, spec)
        np.testing.assert_allclose(got[outside], reference[outside], atol=1e-6)
        assert ((got >= 0) & (got <= 1)).all()
        seen += int(np.count_nonzero(got))
    assert seen > 100


def test_readings_by_hand() -> None:
    world = World([ROBOTS["e-puck"]] * 2, BOXES["square"])
    # The first looks at the box with ps5 (90 degrees left), 3 cm away; the second is out of range.
    world.place(
        np.array([[0.0, -0.1 - 0.037 - 0.03, 0.0], [0.0, -0.261, 0.0]]), np.array([0.0, 0.0, 0.0])
    )
    readings = world.infrared()
    assert readings.shape == (2, 8)
    assert readings[0, 5] == pytest.approx(exp(-0.03 / SPEC.decay))
    assert readings[0, 2] == 0.0
    assert readings[1].max() == 0.0
    np.testing.assert_allclose(SPEC.reading(world.gaps), readings.max(axis=1), atol=1e-12)


def test_touching_reads_one_and_far_reads_zero() -> None:
    np.testing.assert_array_equal(SPEC.reading(np.array([-0.001, 0.0, 0.06, 1.0])), [1, 1, 0, 0])


def test_noise_is_a_fraction_of_the_reading() -> None:
    spec = InfraredSettings(noise=0.1)
    clean = np.tile([0.0, 0.2, 0.5, 1.0], (20_000, 1))
    noisy = spec.noisy(clean, np.random.default_rng(1))
    np.testing.assert_allclose(noisy[:, :3].std(axis=0), [0, 0.02, 0.05], rtol=0.02)
    np.testing.assert_allclose(noisy[:, :3].mean(axis=0), [0, 0.2, 0.5], atol=0.002)
    assert noisy.max() == 1.0
    state = RNG.bit_generator.state
    assert SPEC.noisy(clean, RNG) is clean
    assert RNG.bit_generator.state == state


def rewards(infrared: dict[str, object], seed: int = 1) -> list[float]:
    """Return the rewards of an episode of robots that hover near the box."""
    settings = BoxPushingSettings.model_validate({"start": "easy", "infrared": infrared})
    scenario = BoxPushing(settings)
    scenario.reset(seed)
    return [scenario.step(np.full(4, 3)).reward for _ in range(5)]  # all wheels at rest


def test_sensors_are_options_of_the_scenario() -> None:
    default = rewards({})
    assert rewards({"reach": 0.06, "decay": 0.015, "noise": 0.0}) == default
    for change in ({"decay": 0.03}, {"reach": 0.001}):
        assert rewards(change) != default
    noisy = rewards({"noise": 0.2})
    assert len(set(noisy)) == 5
    assert rewards({"noise": 0.2}) == noisy
    assert rewards({"noise": 0.2}, seed=2) != noisy


@pytest.mark.parametrize(
    ("table", "complaint"),
    [
        ({"reach": 0}, "infrared.reach = 0"),
        ({"noise": 2}, "infrared.noise = 2"),
    ],
)
def test_bad_options_are_refused(table: dict[str, object], complaint: str) -> None:
    with pytest.raises(SpecError, match=complaint) as error:
        Spec.of({"scenario": {"infrared": table}})
    assert "\n" not in str(error.value)


def test_bad_sensors_are_refused() -> None:
    blind = [ROBOTS["e-puck"], ROBOTS["e-puck"].model_copy(update={"sensors": (0.0,)})]
    with pytest.raises(ValueError, match="same number"):
        sensor_directions(blind)
