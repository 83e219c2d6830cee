"""Compiled state variables beside their definition."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nested_agents.scenarios.box_pushing.states.relational import STATE_VARIABLES, View
from nested_agents.scenarios.box_pushing.states.relational_lanes import COMPILED, angle_of
from nested_agents.scenarios.box_pushing.states.state_spaces import build_space
from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.scenarios.state_variables import find_variable

VARIABLES = tuple(STATE_VARIABLES.built_in)


@pytest.mark.parametrize("robots", [1, 2, 5])
@pytest.mark.parametrize(
    "names",
    [  # each group of lanes is wanted and not, by variables of built-in spaces: those are compiled
        VARIABLES,
        ("cross_track_error", "bend"),
        ("gap", "face_bearing", "others_away", "contact_push_bearing"),
    ],
)
@pytest.mark.parametrize("box", ["square", "L", "circle"])
def test_compiled_blocks_are_those_of_the_definition(
    box: str, names: tuple[str, ...], robots: int
) -> None:
    rng = np.random.default_rng(robots)
    seen = View(
        rng.normal(size=(100, robots, 3)) * [1, 1, 9], rng.normal(size=(100, 3)) * [1, 1, 9],
        rng.normal(size=(100, robots)), rng.normal(size=3), rng.normal(size=3),
        3.0, BOXES[box].outline, BOXES[box].friction_radius,
    )  # fmt: skip
    space, wanted = build_space("some", *names), list(range(robots))[::-1]
    expected = np.array([space.sense(seen, [r])[0] for r in wanted])
    np.testing.assert_allclose(space.shared_of(seen, wanted), expected, rtol=0, atol=1e-12)


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
def test_angles_are_exact_to_the_last_bits(x: float, y: float) -> None:
    assert angle_of(x, y) == pytest.approx(np.arctan2(y + 0.0, x + 0.0), rel=0, abs=1e-15)


def test_columns_are_those_of_names_that_the_kernel_knows() -> None:
    assert set(COMPILED) == set(STATE_VARIABLES.built_in)
    assert all(find_variable(STATE_VARIABLES, name).variable.name == name for name in COMPILED)
