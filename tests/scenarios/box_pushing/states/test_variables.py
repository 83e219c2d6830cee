"""Compiled state variables beside their NumPy reference, and a user's beside both."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from variables_oracle import batch_of, variables

from nested_agents.scenarios.box_pushing.states.kernel import progress_of
from nested_agents.scenarios.box_pushing.states.situations import (
    SituationBatch,
    angle_of,
    whole_batch,
)
from nested_agents.scenarios.box_pushing.states.state_spaces import state_space_for
from nested_agents.scenarios.box_pushing.states.variables import STATE_VARIABLES
from nested_agents.scenarios.box_pushing.world.boxes import BOXES


def drawn(box: str, robots: int, number: int = 100, scale: float = 1.0) -> SituationBatch:
    rng = np.random.default_rng(robots)
    return batch_of(
        scale * rng.normal(size=(number, robots, 3)) * [1, 1, 9],
        scale * rng.normal(size=(number, 3)) * [1, 1, 9],
        scale * rng.normal(size=(number, robots)),
        rng.normal(size=3),
        rng.normal(size=(number, 3)),
        3.0,
        BOXES[box].shape,
    )


NAMES = tuple(variables(drawn("square", 1, 1), 0))


def test_every_variable_has_a_formula_in_the_reference() -> None:
    assert {*STATE_VARIABLES.built_in} == {*NAMES}, "add it to variables_oracle.py"


@pytest.mark.parametrize("robots", [1, 2, 5])
@pytest.mark.parametrize("names", [NAMES, ("cross_track_error", "bend"), ("gap", "face_bearing")])
@pytest.mark.parametrize("box", ["square", "L", "circle"])
@pytest.mark.parametrize("scale", [1.0, 0.05])
def test_compiled_variables_are_those_of_the_reference(
    box: str, names: tuple[str, ...], robots: int, scale: float
) -> None:
    batch, wanted = drawn(box, robots, scale=scale), list(range(robots))[::-1]
    expected = [[variables(batch, robot)[name] for name in names] for robot in wanted]
    found = state_space_for(tuple(names)).shared(batch, wanted)
    np.testing.assert_allclose(found, np.swapaxes(expected, 1, 2), rtol=0, atol=1e-12)


def test_a_situation_has_the_same_bits_alone_and_among_others() -> None:
    space, batch = state_space_for(tuple(NAMES)), drawn("L", 10, scale=0.1)
    many = space.shared(batch, range(10))
    for s in (0, 7, 99):
        alone = [each[..., s : s + 1].copy() for each in (*batch[:3], batch.origins)]
        one = SituationBatch(*alone[:3], batch.goal, alone[3], *batch[5:])
        assert space.shared(one, range(10)).tobytes() == many[:, s : s + 1].tobytes()


def test_progress_is_that_of_the_variables() -> None:
    batch = drawn("square", 2)
    expected = variables(batch, 0)
    for found, name in zip(
        progress_of(batch), ("box_distance", "approach", "box_turn"), strict=True
    ):
        np.testing.assert_allclose(found, expected[name], rtol=0, atol=1e-12)


def test_a_plain_function_gets_all_situations_at_once_and_cannot_write_to_them() -> None:
    batch = drawn("square", 3)
    whole = whole_batch(batch)
    np.testing.assert_array_equal(whole.robots[1].y, batch.robots[1, 1])
    np.testing.assert_array_equal(whole.robots[2].gap, batch.gaps[2])
    np.testing.assert_allclose(whole.middle[1], batch.robots[:, 1].mean(axis=0), atol=1e-12)
    np.testing.assert_array_equal(whole.largest_gaps[0], batch.gaps.max(axis=0))
    np.testing.assert_array_equal(whole.largest_gaps[1], np.sort(batch.gaps, axis=0)[1])
    away = np.clip(batch.gaps / 0.03, 0.0, 1.0).sum(axis=0)
    np.testing.assert_allclose(whole.n_away, away, atol=1e-12)
    ahead = batch.goal[:2, None] - batch.boxes[:2]
    np.testing.assert_allclose(whole.distance, np.hypot(*ahead), atol=1e-12)
    np.testing.assert_allclose(whole.course, np.arctan2(ahead[1], ahead[0]), atol=1e-12)
    assert not any(
        each.flags.writeable
        for each in (*whole.box, *whole.origin, *whole.contact, whole.distance, *whole.robots[0])
    )


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
def test_angles_are_exact_to_the_last_bits(x: float, y: float) -> None:
    assert angle_of(x, y) == pytest.approx(np.arctan2(y + 0.0, x + 0.0), rel=0, abs=1e-15)
