import dataclasses

import numpy as np
import pytest

from radioslam import planar
from radioslam.config import OdometryConfig
from radioslam.errors import LogError
from radioslam.odometry import estimate_odometry, estimate_track
from radioslam.walk import Inertial, Walk

from .builders import scans_at, tracked_walk
from .phones import STEP_HZ, clock, inertial_walk, phone

FIXED = OdometryConfig(step_length="constant", typical_step_m=0.7)


def off_deg(heading, truth):
    return np.degrees(np.abs(planar.wrap(heading - truth)))


# Dead reckoning


def test_without_rotation_vector_and_gyroscope_there_is_no_heading():
    inertial = Inertial(phone(np.zeros(500), clock(10.0)).accelerometer)
    with pytest.raises(LogError, match="expected a rotation vector or a gyroscope"):
        estimate_track(inertial_walk(inertial), OdometryConfig())


@pytest.mark.parametrize("degrees", [0.0, 90.0, -135.0])
def test_a_straight_walk_has_its_length_and_direction(degrees):
    time_s = clock(60.0)
    track = estimate_track(inertial_walk(phone(np.full(len(time_s), np.radians(degrees)), time_s)), FIXED)
    expected = 0.7 * STEP_HZ * 60
    assert track.distance_m[-1] == pytest.approx(expected, abs=0.8)
    end = track.poses[-1]
    assert np.hypot(*end[:2]) == pytest.approx(expected, abs=0.8)
    assert off_deg(np.arctan2(end[1], end[0]), np.radians(degrees)) < 0.5
    np.testing.assert_allclose(off_deg(track.poses[:, 2], np.radians(degrees)), 0.0, atol=0.1)


def test_a_square_walk_comes_back_to_its_start():
    time_s = clock(80.0)
    truth = np.interp(time_s, [19.5, 20.5, 39.5, 40.5, 59.5, 60.5], np.repeat([0, 0.5, 1.0, 1.5], 2)[1:-1] * np.pi)
    track = estimate_track(inertial_walk(phone(truth, time_s)), FIXED)
    side = 0.7 * STEP_HZ * 20
    corners = track.at(np.array([20.0, 40.0, 60.0, 80.0]))[:, :2]
    np.testing.assert_allclose(corners, side * np.array([[1, 0], [1, 1], [0, 1], [0, 0]]), atol=1.2)


def test_somebody_who_stands_stays_where_he_is():
    time_s = clock(30.0)
    track = estimate_track(inertial_walk(phone(np.zeros(len(time_s)), time_s, bounce=0.0)), OdometryConfig())
    np.testing.assert_array_equal(track.poses[:, :2], 0.0)
    assert (track.time_s[0], track.time_s[-1]) == (0.0, pytest.approx(30.0, abs=0.05))


def test_the_track_starts_at_zero_at_the_first_sample_and_holds_its_place_after_the_last_step():
    time_s = 1000.0 + clock(30.0)
    track = estimate_track(inertial_walk(phone(np.zeros(len(time_s)), time_s)), FIXED)
    np.testing.assert_allclose(track.at(np.array([1000.0]))[0], [0, 0, 0], atol=1e-6)
    assert track.time_s[-1] == pytest.approx(1030.0, abs=0.05)
    np.testing.assert_array_equal(track.poses[-1, :2], track.poses[-2, :2])


def test_samples_of_an_uneven_clock_give_the_same_walk():
    rng = np.random.default_rng(0)
    time_s = np.sort(rng.uniform(0, 60, 6000))
    track = estimate_track(inertial_walk(phone(np.zeros(len(time_s)), time_s)), FIXED)
    assert track.distance_m[-1] == pytest.approx(0.7 * STEP_HZ * 60, abs=1.5)


def test_variances_of_dead_reckoning_grow_with_every_step():
    time_s = clock(60.0)
    config = OdometryConfig(
        step_length="constant", typical_step_m=0.7, step_length_sigma=0.1, step_heading_sigma_rad=0.04
    )
    track = estimate_track(inertial_walk(phone(np.zeros(len(time_s)), time_s)), config)
    steps = round(track.distance_m[-1] / 0.7)
    assert track.translation_variance[-1] == pytest.approx(steps * 0.07**2)
    assert track.heading_variance[-1] == pytest.approx(steps * 0.04**2)


# Given odometry

BEND = np.array([[5.0, 5.0, 0.3], [8.0, 9.0, 0.4], [8.0, 19.0, 1.5]])


def test_a_trackers_path_keeps_its_headings_and_begins_at_zero():
    track = estimate_track(tracked_walk(BEND), OdometryConfig())
    np.testing.assert_allclose(track.poses, BEND - [5.0, 5.0, 0.0])
    np.testing.assert_allclose(track.distance_m, [0.0, 5.0, 15.0])


def test_variances_of_a_tracker_grow_with_the_distance():
    config = OdometryConfig(tracker_translation_sigma=0.1, tracker_heading_sigma_rad=0.2)
    track = estimate_track(tracked_walk(BEND), config)
    np.testing.assert_allclose(track.translation_variance, [0, 0.05, 0.15])
    np.testing.assert_allclose(track.heading_variance, [0, 0.2, 0.6])


def test_given_odometry_is_preferred_to_sensors():
    time_s = clock(10.0)
    walk = dataclasses.replace(tracked_walk(BEND), inertial=phone(np.zeros(len(time_s)), time_s))
    np.testing.assert_array_equal(estimate_track(walk, OdometryConfig()).time_s, [0, 1, 2])


def test_poses_and_distances_between_times_are_interpolated():
    track = estimate_track(tracked_walk(BEND), OdometryConfig())
    np.testing.assert_allclose(track.at(np.array([0.5, 9.0])), [[1.5, 2.0, 0.35], [3.0, 14.0, 1.5]])
    np.testing.assert_allclose(track.distance_at(np.array([-1.0, 0.5, 1.5])), [0.0, 2.5, 10.0])


def test_variances_of_motions_one_after_the_other_add_up():
    track = estimate_track(tracked_walk(BEND), OdometryConfig())
    floors = np.array([0.05, 0.005]) ** 2
    whole = np.square(track.motion_sigmas(np.array([0.2, 1.9])))[:, 0] - floors
    parts = np.square(track.motion_sigmas(np.array([0.2, 0.9, 1.0, 1.9]))).T - floors
    np.testing.assert_allclose(parts.sum(axis=0), whole)


def test_no_motion_at_all_is_uncertain_still():
    track = estimate_track(tracked_walk(BEND), OdometryConfig())
    translation, heading = track.motion_sigmas(np.array([0.5, 0.5]))
    assert translation > 0
    assert heading > 0


def test_a_walk_without_odometry_and_sensors_is_an_error_that_names_it():
    with pytest.raises(LogError, match="lost: expected odometry or inertial sensors, found neither"):
        estimate_track(Walk("lost", scans_at([0.0])), OdometryConfig())


def test_each_walk_has_its_track_in_order():
    tracks = estimate_odometry([tracked_walk(BEND, name=name) for name in "ba"], OdometryConfig())
    assert [track.walk.name for track in tracks] == ["b", "a"]
