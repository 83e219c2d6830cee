"""Self-models: what a Kalman filter makes of healthy, failed and recovered wheels."""

import numpy as np
import pytest

from nested_agents.core.models.self_model import SelfModel, SelfModelSettings

# A differential drive: axle 0.05 m.
NOMINAL = np.array([[0.5, 0.5, 0.0], [0.0, 0.0, 0.0], [-20.0, 20.0, 0.0]])
SETTINGS = SelfModelSettings(enabled=True)


def taught(model: SelfModel, truth: np.ndarray, steps: int, noise: float = 0.0) -> None:
    rng = np.random.default_rng(0)
    for _ in range(steps):
        speeds = rng.choice([-0.13, -0.065, 0.0, 0.065, 0.13], size=2)
        twist = truth @ np.append(speeds, 1.0)
        model.observe(0, speeds, twist + noise * rng.normal(size=3) * [1.0, 1.0, 20.0])


def test_it_starts_from_the_nominal_geometry_and_keeps_it_when_healthy() -> None:
    model = SelfModel(SETTINGS, [NOMINAL])
    np.testing.assert_array_equal(model.effects[0], NOMINAL)
    taught(model, NOMINAL, 50)
    np.testing.assert_allclose(model.effects[0], NOMINAL, atol=1e-9)


@pytest.mark.parametrize("gain", [0.0, 0.3, -1.0])
def test_it_identifies_a_failed_wheel_within_forty_decisions(gain: float) -> None:
    model = SelfModel(SETTINGS, [NOMINAL])
    taught(model, NOMINAL, 100, noise=0.002)
    failed = NOMINAL * [gain, 1.0, 1.0]
    taught(model, failed, 40, noise=0.002)
    np.testing.assert_allclose(model.effects[0][0], failed[0], atol=0.05)
    np.testing.assert_allclose(model.effects[0][2] / 20, failed[2] / 20, atol=0.05)


def test_one_filter_step_by_hand() -> None:
    # Prior variance 0.09 of a wheel's effect, 9e-6 of the constant; noise 1.6e-5; no surprise.
    settings = SelfModelSettings(enabled=True, surprise=1e9)
    model = SelfModel(settings, [NOMINAL])
    model.observe(0, np.array([0.1, 0.0]), np.array([0.03, 0.0, -2.0]))
    expected = 0.09 * 0.01 + 9e-6 + 1.6e-5
    innovation = 0.03 - 0.05
    by_hand = [0.5 + 0.09 * 0.1 / expected * innovation, 0.5, 9e-6 / expected * innovation]
    np.testing.assert_allclose(model.effects[0][0], by_hand, rtol=1e-12)


def test_robots_learn_each_on_their_own() -> None:
    model = SelfModel(SETTINGS, [NOMINAL, NOMINAL])
    taught(model, NOMINAL * [0.0, 1.0, 1.0], 30)
    np.testing.assert_array_equal(model.effects[1], NOMINAL)


def test_it_continues_from_what_was_saved() -> None:
    model, other = SelfModel(SETTINGS, [NOMINAL]), SelfModel(SETTINGS, [NOMINAL])
    taught(model, NOMINAL * [0.3, 1.0, 1.0], 10, noise=0.002)
    other.load_state_dict({name: array.copy() for name, array in model.state_dict().items()})
    for one in (model, other):
        taught(one, NOMINAL, 5)
    np.testing.assert_array_equal(model.effects[0], other.effects[0])
    np.testing.assert_array_equal(model.deviations[0], other.deviations[0])


def test_its_deviations_shrink_to_what_is_known() -> None:
    settings = SelfModelSettings(enabled=True, surprise=1e9)
    model = SelfModel(settings, [NOMINAL])
    unit = max(1.0, abs(NOMINAL[2]).max())
    before = [[0.3, 0.3, 0.003]] * 2 + [[0.3 * unit, 0.3 * unit, 0.003 * unit]]
    np.testing.assert_allclose(model.deviations[0], before, rtol=1e-12)
    model.observe(0, np.array([0.1, 0.0]), NOMINAL @ [0.1, 0.0, 1.0])
    # Of a wheel that has not moved nothing new is known.
    variance = 0.09 - (0.09 * 0.1) ** 2 / (0.09 * 0.01 + 9e-6 + 1.6e-5)
    np.testing.assert_allclose(model.deviations[0][0, :2], [variance**0.5, 0.3], rtol=1e-12)


def test_innovations_larger_than_expected_are_owned_up_to() -> None:
    # Skidding: the twist is off by fifteen times the noise that the filter reckons with.
    covered = {}
    for surprise in (False, True):
        model, rng, inside = SelfModel(SETTINGS, [NOMINAL]), np.random.default_rng(1), []
        for step in range(600):
            speeds = rng.choice([-0.13, -0.065, 0.0, 0.065, 0.13], size=2)
            skid = 0.06 * rng.normal(size=3) * [1.0, 1.0, 20.0]
            model.observe(0, speeds, NOMINAL @ np.append(speeds, 1.0) + skid)
            if step >= 100:
                deviations = model.deviations[0]
                if not surprise:
                    ratios = np.sqrt(np.maximum(1.0, model.state_dict()["ratio0"]))
                    deviations = deviations / ratios[:, None]
                off = np.abs(model.effects[0] - NOMINAL)[:, :2]
                inside.append((off < 2.0 * deviations[:, :2]).mean())
        covered[surprise] = np.mean(inside)
    assert covered[False] < 0.6
    assert covered[True] > 0.9


def test_another_model_goes_on_with_bodies_alike_and_begins_anew_with_others():
    nominal = np.array([[0.5, 0.5, 0.0], [0.0, 0.0, 0.0], [-9.0, 9.0, 0.0]])
    former = SelfModel(SelfModelSettings(enabled=True), [nominal])
    former.observe(0, np.array([0.1, 0.1]), np.zeros(3))
    alike, longer, more = (
        SelfModel(SelfModelSettings(enabled=True), bodies)
        for bodies in ([nominal], [2.0 * nominal], [nominal, nominal])
    )
    for model in (alike, longer, more):
        model.warm_start(former)
    assert (alike.effects[0] == former.effects[0]).all()
    assert (longer.effects[0] == 2.0 * nominal).all()
    assert (more.effects[0] == nominal).all()
