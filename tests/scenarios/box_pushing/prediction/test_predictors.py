"""Predictors: the exact one is exact, the others are what they take the world for."""

import numpy as np
import pytest

from nested_agents.core.agents.loop import world_seed
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.world.settings import (
    WheelFailure,
)
from nested_agents.scenarios.checking.checker import check_scenario

AHEAD = np.zeros(4, dtype=int)
FAILURES = (
    WheelFailure.Seized(wheels=("robot1.left",), step=2),
    WheelFailure.Noisy(wheels=("robot2.left",)),
    WheelFailure.Delayed(wheels=("robot2.right",), periods=3),
)


def scenario(predictor: str, **table: object) -> BoxPushing:
    return BoxPushing(BoxPushingSettings.model_validate({"predictor": predictor, **table}))


@pytest.mark.parametrize("failures", [(), FAILURES], ids=["healthy", "failures"])
@pytest.mark.parametrize("periods", [1, 2])
def test_the_exact_one_foresees_to_the_bit(failures: tuple[object, ...], periods: int) -> None:
    world = scenario("exact", start="easy", prediction_horizon=8 * periods, failures=failures)
    world.reset(world_seed(3, 0), 0)
    touched = False
    for _ in range(6):
        # Full speed and maintain: what is held for two periods is what two steps do.
        joint = AHEAD if world.measure()["wheel_speeds"].max() < 0.13 else AHEAD + 2
        joint_actions = np.stack([AHEAD + 3, joint])
        prediction = world.predict()
        predicted = prediction.states(0, joint_actions)[1]
        foreseen = prediction.poses(joint_actions)
        rewards = world.predict().rewards(joint_actions)
        assert np.isfinite(rewards).all()
        for period in range(periods):
            if period and world.measure()["wheel_speeds"].max() < 0.13:
                break
            transition = world.step(joint if not period else AHEAD + 2)
        else:
            # The world to the bit; angles between its bodies are compiled and differ in the last.
            # Approach is a mean over the periods.
            same = [periods == 1 or v.name != "approach" for v in world.state_space.variables]
            entered = transition.states[0]
            np.testing.assert_allclose(predicted[same], entered[same], rtol=0, atol=1e-14)
            if periods == 1:
                np.testing.assert_array_equal(foreseen.boxes[:, 1], world.world.box_pose)
                np.testing.assert_array_equal(foreseen.robots[:, :, 1], world.world.robot_poses)
        touched |= bool(transition.info["contact"].any())
    assert touched


@pytest.mark.parametrize("failures", [(), FAILURES], ids=["healthy", "failures"])
def test_the_exact_one_goes_on_from_where_an_action_leads(failures: tuple[object, ...]) -> None:
    world = scenario("exact", start="easy", prediction_horizon=8, failures=failures)
    world.reset(world_seed(3, 0), 0)
    for _ in range(4):
        onward = world.predict().after(AHEAD)
        states, then = onward.states(0, AHEAD[None] + 2), onward.poses(AHEAD[None] + 2)
        world.step(AHEAD)
        expected = world.predict()
        np.testing.assert_array_equal(states, expected.states(0, AHEAD[None] + 2))
        np.testing.assert_array_equal(then.robots, expected.poses(AHEAD[None] + 2).robots)


@pytest.mark.parametrize("failures", [(), FAILURES], ids=["healthy", "failures"])
def test_looking_ahead_changes_nothing(failures: tuple[object, ...]) -> None:
    settings = BoxPushingSettings.model_validate(
        {"predictor": "exact", "prediction_horizon": 4, "action_repeat": 4, "failures": failures}
    )
    assert "predictions" in check_scenario(lambda: BoxPushing(settings), steps=4).passed


def errors(predictor: str, *, steps: int = 14) -> tuple[float, float]:
    """Return mean distances [m]: of the predicted box from the real one, and moved by the box."""
    world = scenario(predictor, start="easy")
    off, moved = [], []
    for seed in range(4):
        world.reset(world_seed(seed, 0))
        for step in range(steps):
            joint = AHEAD if step < 2 else AHEAD + 2
            box = world.predict().poses(joint[None]).boxes[:, 0]
            before = world.measure()["box_pose"]
            info = world.step(joint).info
            if (info["contact_time"] > 0).any():
                off.append(np.hypot(*(box - info["box_pose"])[:2]))
                moved.append(np.hypot(*(before - info["box_pose"])[:2]))
    return float(np.mean(off)), float(np.mean(moved))


def test_their_order_is_that_of_what_they_know() -> None:
    found = {kind: errors(kind) for kind in ("exact", "push", "rigid", "static")}
    off = [error for error, _ in found.values()]
    assert off[0] == 0.0
    assert off == sorted(off)
    assert off[1] < 0.5 * off[2]
    # A box taken for immobile is wrong by all that it moves.
    assert off[3] == pytest.approx(found["static"][1], rel=1e-3)
