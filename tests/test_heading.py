import dataclasses

import numpy as np
import pytest

from radioslam import planar
from radioslam.config import OdometryConfig
from radioslam.heading import phone_heading, slow_average
from radioslam.steps import RATE_HZ

from .phones import clock, inertial_walk, phone


def heading_of(inertial, time_s, **config):
    return phone_heading(inertial_walk(inertial), inertial, time_s, OdometryConfig(**config))


def off_deg(heading, truth):
    return np.degrees(np.abs(planar.wrap(heading - truth)))


@pytest.mark.parametrize("upright", [False, True])
@pytest.mark.parametrize("degrees", [0.0, 90.0, -135.0, 180.0])
def test_forward_is_the_top_edge_of_a_flat_phone_and_the_back_of_an_upright_one(degrees, upright):
    time_s = clock(20.0)
    truth = np.full(len(time_s), np.radians(degrees))
    assert off_deg(heading_of(phone(truth, time_s, upright=upright), time_s), truth).max() < 0.1


def test_the_heading_runs_on_where_the_circle_ends():
    time_s = clock(60.0)
    truth = np.linspace(0.0, 6 * np.pi, len(time_s))
    heading = heading_of(phone(truth, time_s), time_s)
    assert np.abs(np.diff(heading)).max() < 0.1
    assert heading[-1] - heading[0] == pytest.approx(6 * np.pi, abs=0.2)


def test_fusion_corrects_a_gyroscope_that_drifts():
    time_s = clock(300.0)
    truth = np.interp(time_s, [150.0, 152.0], [0.5, 2.0])
    fused = heading_of(phone(truth, time_s, drift_radps=0.01), time_s)
    # The gyroscope alone would be 170° off in the end; the average over 60 s trails it where its window is cut.
    assert off_deg(fused, truth)[3500:-3500].max() < 1.0
    assert off_deg(fused, truth).max() < 18.0


def test_fusion_ignores_a_short_bend_of_the_compass():
    time_s = clock(200.0)
    truth = np.full(len(time_s), 0.7)
    compass = truth + np.radians(60.0) * ((time_s > 100) & (time_s < 104))
    inertial = phone(truth, time_s, compass=compass)
    assert off_deg(heading_of(inertial, time_s), truth).max() < 5.0
    assert off_deg(heading_of(inertial, time_s, heading="rotation_vector"), truth).max() == pytest.approx(60.0)


def test_fusion_follows_a_lasting_change_of_the_compass():
    time_s = clock(200.0)
    truth = np.full(len(time_s), 0.7)
    inertial = phone(truth, time_s, compass=truth + 0.5, drift_radps=0.0)
    assert off_deg(heading_of(inertial, time_s), truth + 0.5).max() < 0.1


def test_a_turn_is_seen_at_once():
    time_s = clock(100.0)
    truth = np.interp(time_s, [50.0, 51.0], [0.0, np.pi / 2])
    assert off_deg(heading_of(phone(truth, time_s), time_s), truth).max() < 1.0


@pytest.mark.parametrize("degrees", [0.0, 90.0, -120.0])
def test_without_a_rotation_vector_the_heading_comes_from_gyroscope_and_magnetometer(degrees):
    time_s = clock(40.0)
    truth = np.interp(time_s, [20.0, 21.0], np.radians([degrees, degrees + 90.0]))
    inertial = phone(truth, time_s, bounce=1.0, rotation_vector=False, magnet=True)
    # The filter needs its first seconds to find down and north.
    assert off_deg(heading_of(inertial, time_s), truth)[500:].max() < 5.0


def test_without_magnetometer_too_the_gyroscope_still_tells_the_turns():
    time_s = clock(40.0)
    truth = np.interp(time_s, [20.0, 21.0], [0.0, np.pi / 2])
    heading = heading_of(phone(truth, time_s, bounce=1.0, rotation_vector=False), time_s)
    assert np.degrees(heading[-100] - heading[600]) == pytest.approx(90.0, abs=5.0)


def test_without_a_gyroscope_the_compass_is_taken_as_it_is():
    time_s = clock(10.0)
    truth = np.full(len(time_s), 1.0)
    inertial = dataclasses.replace(phone(truth, time_s), gyroscope=None)
    assert off_deg(heading_of(inertial, time_s), truth).max() < 0.1


def test_the_slow_average_leaves_aside_what_is_far_from_the_rest():
    difference = np.full(round(120 * RATE_HZ), 0.5)
    difference[: round(25 * RATE_HZ)] = np.random.default_rng(0).uniform(-10, 10, round(25 * RATE_HZ))
    average = slow_average(difference, 60.0)
    assert np.abs(average[round(40 * RATE_HZ) :] - 0.5).max() < np.radians(3.0)


@pytest.mark.parametrize("samples", [1, 10, 26, 500])
def test_the_slow_average_of_a_constant_is_that_constant(samples):
    np.testing.assert_allclose(slow_average(np.full(samples, -7.0), 60.0), -7.0)
