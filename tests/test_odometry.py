import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from radioslam import planar
from radioslam.config import OdometryConfig
from radioslam.errors import LogError
from radioslam.odometry import RATE_HZ, detect_steps, estimate_odometry, estimate_track, phone_heading, step_lengths
from radioslam.walk import Inertial, Signal, Walk

from .builders import scans_at, tracked_walk

GRAVITY = 9.81
STEP_HZ = 1.8
FIXED = OdometryConfig(step_length="constant", typical_step_m=0.7)
EARTH_FIELD_UT = np.array([0.0, 20.0, -44.0])


def clock(duration_s):
    return np.arange(0, duration_s, 1 / RATE_HZ)


def bouncing(time_s, bounce=2.0):
    """Norm of the acceleration of somebody who makes STEP_HZ steps per second."""
    return GRAVITY + bounce * np.sin(2 * np.pi * STEP_HZ * time_s)


def attitude(heading, upright=False):
    """Phone to world: flat with the top edge forward, or upright with its back forward."""
    turn = Rotation.from_rotvec((np.asarray(heading) - np.pi / 2)[:, None] * np.array([0.0, 0.0, 1.0]))
    return turn * Rotation.from_rotvec([np.pi / 2, 0.0, 0.0]) if upright else turn


def phone(
    heading, time_s, bounce=2.0, compass=None, drift_radps=0.0, upright=False, rotation_vector=True, magnet=False
):
    """Inertial streams of a walk with the given true heading (n,); the compass shows the same unless told."""
    true = attitude(heading, upright)
    gravity = true.inv().apply(np.array([0.0, 0.0, 1.0]))
    rate = np.gradient(heading, time_s) + drift_radps
    turning = true.inv().apply(np.array([0.0, 0.0, 1.0])) * rate[:, None]
    shown = attitude(heading if compass is None else compass, upright)
    return Inertial(
        Signal(time_s, gravity * bouncing(time_s, bounce)[:, None]),
        Signal(time_s, turning),
        Signal(time_s, true.inv().apply(EARTH_FIELD_UT)) if magnet else None,
        Signal(time_s, shown.as_quat()) if rotation_vector else None,
    )


def inertial_walk(inertial):
    return Walk("phone", scans_at([1.0]), inertial=inertial)


def heading_of(inertial, time_s, **config):
    return phone_heading(inertial_walk(inertial), inertial, time_s, OdometryConfig(**config))


def off_deg(heading, truth):
    return np.degrees(np.abs(planar.wrap(heading - truth)))


# Steps


@pytest.mark.parametrize("duration_s", [20.0, 60.0])
def test_every_step_is_counted_once(duration_s):
    steps = detect_steps(bouncing(clock(duration_s)), OdometryConfig())
    assert len(steps) == pytest.approx(STEP_HZ * duration_s, abs=1)
    np.testing.assert_allclose(np.diff(steps) / RATE_HZ, 1 / STEP_HZ, atol=2 / RATE_HZ)


def test_a_phone_at_rest_makes_no_steps():
    noise = np.random.default_rng(0).normal(0, 0.2, 3000)
    assert len(detect_steps(GRAVITY + noise, OdometryConfig())) == 0


def test_steps_stop_while_the_walker_stands():
    norm = np.concatenate([bouncing(clock(20.0)), np.full(1000, GRAVITY), bouncing(clock(20.0))])
    steps = detect_steps(norm, OdometryConfig())
    assert len(steps) == pytest.approx(2 * 20 * STEP_HZ, abs=3)
    assert not np.any((steps > 1060) & (steps < 1940))


def test_trembling_faster_than_steps_is_no_walking():
    steps = detect_steps(GRAVITY + 2.0 * np.sin(2 * np.pi * 9.0 * clock(30.0)), OdometryConfig())
    assert len(steps) <= 1  # where the signal is cut off the filter may see one


@pytest.mark.parametrize("samples", [0, 1, 99])
def test_a_signal_of_less_than_two_seconds_has_no_steps(samples):
    assert len(detect_steps(np.full(samples, GRAVITY), OdometryConfig())) == 0


# Step lengths


def test_a_constant_step_has_the_configured_length():
    np.testing.assert_array_equal(step_lengths(np.full(100, GRAVITY), np.array([20, 50]), FIXED), [0.7, 0.7])


@pytest.mark.parametrize("bounce", [1.0, 4.0])
def test_weinbergs_step_is_the_fourth_root_of_the_bounce(bounce):
    norm = bouncing(clock(20.0), bounce)
    config = OdometryConfig(step_length="weinberg", weinberg_constant=0.5)
    lengths = step_lengths(norm, detect_steps(norm, config), config)
    np.testing.assert_allclose(lengths[1:], 0.5 * (2 * bounce) ** 0.25, rtol=0.01)


def test_relative_steps_have_the_typical_length_in_the_middle_and_follow_the_bounce():
    norm = np.concatenate([bouncing(clock(20.0), 1.0), bouncing(clock(20.0), 4.0), bouncing(clock(20.0), 2.0)])
    config = OdometryConfig(step_length="relative", typical_step_m=0.6)
    lengths = step_lengths(norm, detect_steps(norm, config), config)
    assert np.median(lengths) == pytest.approx(0.6)
    assert lengths[50] / lengths[10] == pytest.approx(4**0.25, rel=0.02)


@pytest.mark.parametrize("law", ["relative", "weinberg", "constant"])
def test_no_steps_have_no_lengths(law):
    assert step_lengths(np.full(10, GRAVITY), np.zeros(0, np.int64), OdometryConfig(step_length=law)).shape == (0,)


# Heading


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
    # The gyroscope alone would be 170° off in the end; the average over 30 s trails it where its window is cut.
    assert off_deg(fused, truth)[2000:-2000].max() < 1.0
    assert off_deg(fused, truth).max() < 10.0


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


def test_without_rotation_vector_and_gyroscope_there_is_no_heading():
    inertial = Inertial(phone(np.zeros(500), clock(10.0)).accelerometer)
    with pytest.raises(LogError, match="expected a rotation vector or a gyroscope"):
        estimate_track(inertial_walk(inertial), OdometryConfig())


def test_without_a_gyroscope_the_compass_is_taken_as_it_is():
    time_s = clock(10.0)
    truth = np.full(len(time_s), 1.0)
    inertial = dataclasses.replace(phone(truth, time_s), gyroscope=None)
    assert off_deg(heading_of(inertial, time_s), truth).max() < 0.1


# Dead reckoning


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
