import re

import numpy as np
import pytest

from nested_agents.core.interface.spaces import ActionSet, StateSpace, Variable


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"low": 1.0, "high": 1.0}, r"variable 'x': range \[1.0, 1.0\]"),
        ({"low": 0.0, "high": np.inf}, r"variable 'x': range \[0.0, inf\]"),
        ({"low": np.nan, "high": 1.0}, r"variable 'x': range \[nan, 1.0\]"),
        ({"low": 0.0, "high": 1.0, "centers": (0.5, 0.5)}, "centers .* must increase within"),
        ({"low": 0.0, "high": 1.0, "centers": (0.5, 1.5)}, "centers .* must increase within"),
        ({"low": 0.0, "high": 1.0, "centers": (0.0, np.nan)}, "centers .* must increase within"),
        (
            {"low": 0.0, "high": 1.0, "centers": (0.0, 1.0), "labels": ("low",)},
            "1 labels for 2 centers",
        ),
    ],
)
def test_a_variable_refuses(arguments: dict, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint) as caught:
        Variable("x", "m", **arguments)
    assert "\n" not in str(caught.value)


def test_a_state_space_splits_into_own_and_shared() -> None:
    x, y, z = (Variable(name, "m", 0.0, 1.0) for name in "xyz")
    space = StateSpace("demo", (x, y, z), n_own=2)
    assert (space.own, space.shared, space.n_variables) == ((x, y), (z,), 3)


@pytest.mark.parametrize(
    ("names", "n_own", "complaint"),
    [
        ("", 0, "must be distinct"),
        ("xx", 0, r"variable names \['x', 'x'\] must be distinct"),
        ("xy", 3, "n_own = 3, allowed 0 to 2"),
        ("xy", -1, "n_own = -1, allowed 0 to 2"),
    ],
)
def test_a_state_space_refuses(names: str, n_own: int, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        StateSpace("demo", tuple(Variable(name, "m", 0.0, 1.0) for name in names), n_own)


@pytest.mark.parametrize(
    ("states", "complaint"),
    [
        (None, "NoneType, allowed: real numbers"),
        ([[0.0], [0.0, 1.0]], "list"),
        (np.zeros((9, 9)), "shape (9, 9)"),
        (np.array([["a", "b"], ["c", "d"]]), "str32, allowed: real numbers"),
        (np.zeros((2, 2), complex), "complex128, allowed: real numbers"),
        ([[0.0, 1j], [0.0, 0.0]], "complex128, allowed: real numbers"),
        (np.array([[0.0, 1j], [0.0, 0.0]], object), "allowed: real numbers"),
        (np.array([[0.0, 0.0], [0.0, np.nan]]), "gap of second is nan, allowed: finite"),
        (np.array([[0.0, np.inf], [0.0, 0.0]]), "gap of first is inf"),
        (np.array([[1e300, 0.0], [0.0, 0.0]]), "speed of first is 1e+300"),
    ],
)
def test_states_that_cannot_be_learned_from_are_refused(states, complaint: str) -> None:
    space = StateSpace("demo", (Variable("speed", "m/s", -1, 1), Variable("gap", "m", 0, 2)), 1)
    agents = ("first", "second")
    assert space.checked(np.array([[5.0, -9.0], [0.0, 0.0]]), agents)[0, 0] == 5.0
    with pytest.raises(ValueError, match=re.escape(complaint)):
        space.checked(states, agents)


def test_the_papers_four_actions() -> None:
    # increase: 0.5 + 0.2; decrease: 0.5 - 0.2; maintain: 0.5; make zero: 0.
    speeds = ActionSet().apply(np.full(4, 0.5), np.arange(4), np.full(4, 0.2), np.ones(4))
    assert speeds == pytest.approx([0.7, 0.3, 0.5, 0.0])


def test_speeds_stop_at_the_limit_of_each_wheel() -> None:
    limit = np.array([1.0, 0.6])
    joint = np.array([[0, 0], [1, 1], [2, 2]])
    speeds = ActionSet().apply(np.array([0.9, -0.5]), joint, np.full(2, 0.2), limit)
    assert speeds == pytest.approx(np.array([[1.0, -0.3], [0.7, -0.6], [0.9, -0.5]]))


def test_neutral_is_maintain() -> None:
    actions = ActionSet()
    assert (len(actions), actions.names[actions.neutral]) == (4, "maintain")


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"gains": (1.0,)}, "must have equal lengths"),
        ({"neutral": 4}, "neutral = 4 names no action"),
        ({"neutral": -1}, "neutral = -1 names no action"),
    ],
)
def test_an_action_set_refuses(arguments: dict, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        ActionSet(**arguments)
