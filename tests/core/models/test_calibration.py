"""Calibration: one step by hand, recovery, what is not believed, and what is kept."""

import numpy as np
import pytest

from nested_agents.core.models.calibration import Calibration, CalibrationSettings

SETTINGS = CalibrationSettings(enabled=True)
LEVERS = np.array([0.1, 0.05])
# The two bodies' twists per logarithm of each of two constants.
SLOPES = np.array([[[0.03, 0.0, 0.2], [0.01, 0.0, 0.0]], [[0.0, 0.02, 0.0], [0.0, 0.0, 0.4]]])


def deviations(calibration):
    return np.sqrt(np.diagonal(calibration.state_dict()["covariance"]))


def outcome(constants):
    return np.tensordot(constants, SLOPES, axes=1)


def taught(calibration, truth, steps, seed=0, noise=0.004):
    rng = np.random.default_rng(seed)
    for _ in range(steps):
        error = noise * rng.normal(size=(2, 3)) / [[1, 1, lever] for lever in LEVERS]
        calibration.observe(outcome(truth) + error, outcome(calibration.points))


def test_one_step_of_a_linear_prediction_is_the_kalman_filters():
    calibration = Calibration(CalibrationSettings(enabled=True, drift=0.0), 1, np.array([0.1]))
    predicted = np.zeros((2, 1, 3))
    predicted[:, 0, 0] = 0.02 * calibration.points[:, 0]
    calibration.observe(np.array([[0.01, 0.0, 0.0]]), predicted)
    expected = 0.02**2 * 0.49 + 0.008**2
    assert calibration.constants[0] == pytest.approx(0.49 * 0.02 / expected * 0.01, rel=1e-12)
    variance = 0.49 - (0.49 * 0.02) ** 2 / expected
    assert deviations(calibration)[0] == pytest.approx(variance**0.5, rel=1e-12)


def test_a_turn_counts_by_its_lever():
    one, other = (Calibration(SETTINGS, 1, np.array([0.1])) for _ in range(2))
    for calibration, part, lever in ((one, 0, 1.0), (other, 2, 0.1)):
        predicted, measured = np.zeros((2, 1, 3)), np.zeros((1, 3))
        predicted[:, 0, part] = 0.02 / lever * calibration.points[:, 0]
        measured[0, part] = 0.01 / lever
        calibration.observe(measured, predicted)
    np.testing.assert_allclose(one.constants, other.constants, rtol=1e-12)


def test_constants_are_recovered_within_their_deviations():
    truth = np.log([4.0, 0.5])
    calibration = Calibration(SETTINGS, 2, LEVERS)
    taught(calibration, truth, 60)
    assert (np.abs(calibration.constants - truth) < 3 * deviations(calibration)).all()
    np.testing.assert_allclose(calibration.constants, truth, atol=0.1)


def test_predictions_that_do_not_depend_on_constants_leave_them():
    calibration = Calibration(SETTINGS, 2, LEVERS)
    calibration.observe(np.ones((2, 3)), np.zeros((4, 2, 3)))
    np.testing.assert_array_equal(calibration.constants, 0.0)
    np.testing.assert_allclose(deviations(calibration), SETTINGS.prior, rtol=1e-12)


def test_what_is_not_believed_hardly_counts():
    truth = np.log([1.5, 0.8])
    calibration = Calibration(SETTINGS, 2, LEVERS)
    taught(calibration, truth, 60)
    before = calibration.constants.copy()
    # A body is jammed: forty times the noise. The other one is where it should be.
    jammed = outcome(truth) + np.array([[0.3, 0.3, 3.0], [0.0, 0.0, 0.0]])
    calibration.observe(jammed, outcome(calibration.points))
    np.testing.assert_allclose(calibration.constants, before, atol=0.01)


def test_nothing_becomes_less_certain_than_it_was_at_first():
    calibration = Calibration(CalibrationSettings(enabled=True, drift=0.5), 2, LEVERS)
    predicted = outcome(calibration.points)
    for _ in range(20):
        predicted = np.tensordot(calibration.points * [1.0, 0.0], SLOPES, axes=1)
        calibration.observe(np.zeros((2, 3)), predicted)
    assert (deviations(calibration) <= SETTINGS.prior * (1 + 1e-12)).all()
    assert deviations(calibration)[0] < 0.6


def test_it_continues_from_what_was_saved():
    one, other = Calibration(SETTINGS, 2, LEVERS), Calibration(SETTINGS, 2, LEVERS)
    taught(one, np.log([4.0, 0.5]), 10)
    other.load_state_dict({name: array.copy() for name, array in one.state_dict().items()})
    for calibration in (one, other):
        taught(calibration, np.log([2.0, 2.0]), 5, seed=1)
    np.testing.assert_array_equal(one.constants, other.constants)
    np.testing.assert_array_equal(deviations(one), deviations(other))


def test_another_calibration_goes_on_with_bodies_alike_and_begins_anew_with_others():
    settings, levers = CalibrationSettings(enabled=True), np.array([0.1, 0.05])
    former = Calibration(settings, 1, levers)
    predicted = np.zeros((2, 2, 3))
    predicted[:, 0, 0] = 0.05 * np.exp(former.points[:, 0])
    former.observe(np.full((2, 3), 0.07), predicted)
    assert former.constants[0] != 0.0
    alike, longer, more = (
        Calibration(settings, 1, other) for other in (levers, 2.0 * levers, np.ones(3))
    )
    for calibration in (alike, longer, more):
        calibration.warm_start(former)
    assert alike.constants[0] == former.constants[0]
    assert deviations(alike)[0] == deviations(former)[0]
    assert longer.constants[0] == more.constants[0] == 0.0
