import dataclasses
from pathlib import Path

import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.walk import LONGEST_GAP_S, Inertial, RadioScans, Reference, Signal, Walk, check_walk

from .builders import scans_at, scans_of, tracked_walk

STRAIGHT = np.column_stack([np.arange(5.0), np.zeros((5, 2))])


# Signal


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_signal_refuses_numbers_that_are_not_finite(bad):
    with pytest.raises(ValueError, match="not finite"):
        Signal([0.0, 1.0], [[1.0], [bad]])
    with pytest.raises(ValueError, match="not finite"):
        Signal([0.0, bad], [[1.0], [2.0]])


def test_a_signal_refuses_times_that_go_backwards():
    with pytest.raises(ValueError, match="backwards"):
        Signal([0.0, 2.0, 1.0], np.zeros((3, 1)))


def test_a_signal_may_hold_two_samples_of_one_time():
    assert len(Signal([0.0, 1.0, 1.0], np.zeros((3, 1)))) == 3


def test_a_signal_needs_a_time_for_each_value():
    with pytest.raises(ValueError, match="2 times but 3 values"):
        Signal([0.0, 1.0], np.zeros((3, 1)))


def test_a_signal_cannot_be_changed_not_even_through_the_array_it_came_from():
    values = np.zeros((2, 1))
    signal = Signal([0.0, 1.0], values)
    values[0] = 9.0
    assert signal.values[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        signal.values[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        signal.time_s[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        signal.time_s = np.zeros(2)


# RadioScans


@pytest.mark.parametrize("rss", [-127.0, -126.9, -1.0, -1e-9])
def test_strengths_within_the_range_are_taken(rss):
    assert scans_of((0.0, "a", rss)).rss_dbm == [rss]


@pytest.mark.parametrize("rss", [-127.01, 0.0, 1.0, 100.0, np.nan, np.inf, -np.inf])
def test_strengths_outside_of_the_range_are_refused(rss):
    with pytest.raises(ValueError, match=r"lies outside \[-127, 0\)"):
        scans_of((0.0, "a", -50.0), (0.0, "b", rss))


@pytest.mark.parametrize("time_s", [np.nan, np.inf])
def test_scan_times_must_be_finite(time_s):
    with pytest.raises(ValueError, match="scan time"):
        scans_of((time_s, "a", -50.0))


def test_readings_in_any_order_become_scans_in_time():
    scans = scans_of((2.0, "b", -60.0), (1.0, "b", -70.0), (2.0, "a", -50.0))
    assert len(scans) == 2
    assert scans.reading_count == 3
    assert scans.transmitters == ("a", "b")
    np.testing.assert_array_equal(scans.scan_time_s, [1.0, 2.0])
    np.testing.assert_array_equal(scans.reading_scan, [0, 1, 1])
    np.testing.assert_array_equal(scans.reading_transmitter, [1, 0, 1])
    np.testing.assert_array_equal(scans.rss_dbm, [-70, -50, -60])


def test_frequency_and_last_seen_stay_with_their_reading():
    scans = RadioScans.from_readings([2.0, 1.0], ["a", "b"], [-50, -60], [2412, 5180], [1.5, 0.5])
    np.testing.assert_array_equal(scans.frequency_mhz, [5180, 2412])
    np.testing.assert_array_equal(scans.last_seen_s, [0.5, 1.5])


def test_unknown_frequency_and_last_seen_are_not_numbers():
    scans = RadioScans.from_readings([0.0], ["a"], [-50.0])
    assert np.isnan(scans.frequency_mhz).all()
    assert np.isnan(scans.last_seen_s).all()


def test_of_a_transmitter_twice_in_a_scan_the_reading_heard_last_counts():
    scans = scans_of((9.0, "a", -80.0, 8.0), (9.0, "a", -50.0, 2.0), (9.0, "a", -40.0))
    np.testing.assert_array_equal(scans.rss_dbm, [-80.0])


def test_of_a_transmitter_twice_in_a_scan_the_stronger_counts_where_nobody_knows_when():
    scans = scans_of((9.0, "a", -80.0), (9.0, "a", -50.0), (9.0, "a", -60.0))
    np.testing.assert_array_equal(scans.rss_dbm, [-50.0])


def test_no_readings_make_no_scans():
    assert len(RadioScans.from_readings([], [], [])) == 0


def test_scans_cannot_be_changed():
    scans = scans_of((0.0, "a", -50.0))
    for field in dataclasses.fields(scans):
        if field.name != "transmitters":
            with pytest.raises(ValueError, match="read-only"):
                getattr(scans, field.name)[0] = 0


# Reference


def test_a_reference_is_straight_between_its_fixes():
    reference = Reference(np.array([0.0, 10.0]), np.array([[0.0, 0.0], [10.0, 20.0]]))
    np.testing.assert_allclose(reference.at(np.array([0.0, 5.0, 10.0])), [[0, 0], [5, 10], [10, 20]])


def test_a_reference_knows_nothing_outside_of_its_fixes():
    reference = Reference(np.array([0.0, 10.0]), np.array([[0.0, 0.0], [10.0, 20.0]]))
    assert np.isnan(reference.at(np.array([-0.1, 10.1]))).all()


def test_a_single_fix_is_known_at_its_own_time_only():
    reference = Reference(np.array([3.0]), np.array([[1.0, 2.0]]))
    np.testing.assert_allclose(reference.at(np.array([2.0, 3.0, 4.0])), [[np.nan] * 2, [1.0, 2.0], [np.nan] * 2])


@pytest.mark.parametrize(
    ("times_s", "x"), [([1.0, 0.0], [0.0, 1.0]), ([0.0, 1.0], [0.0, np.nan]), ([0.0, np.inf], [0.0, 1.0])]
)
def test_a_reference_is_validated_as_a_signal(times_s, x):
    with pytest.raises(ValueError, match=r"backwards|not finite"):
        Reference(np.array(times_s), np.column_stack([x, x]))


def test_a_new_origin_shifts_positions_by_the_arcs_of_the_ellipsoid():
    # Radii of curvature of WGS 84 at 48° N: meridian 6 370 848.0 m, prime vertical 6 389 937.6 m (hand calculation).
    sine = np.sin(np.radians(48.0))
    a, e2 = 6378137.0, 0.00669437999014
    prime = a / np.sqrt(1 - e2 * sine**2)
    meridian = prime * (1 - e2) / (1 - e2 * sine**2)
    east, north = np.radians(0.001) * prime * np.cos(np.radians(48.0)), np.radians(0.002) * meridian
    reference = Reference(np.array([0.0]), np.array([[1.0, 2.0]]), origin_wgs84=(48.002, 11.001))
    moved = reference.with_origin((48.0, 11.0))
    assert moved.origin_wgs84 == (48.0, 11.0)
    # 222 m away the curvature of the earth and of the parallel bends the arcs by millimetres.
    np.testing.assert_allclose(moved.positions_xy, [[1.0 + east, 2.0 + north]], atol=0.02)


def test_a_reference_without_an_origin_cannot_be_moved():
    reference = Reference(np.array([0.0]), np.array([[1.0, 2.0]]))
    assert reference.with_origin((48.0, 11.0)) is reference


def test_the_same_origin_moves_nothing():
    reference = Reference(np.array([0.0]), np.array([[1.0, 2.0]]), (48.0, 11.0))
    assert reference.with_origin((48.0, 11.0)) is reference


def test_a_reference_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        Reference(np.array([0.0]), np.array([[1.0, 2.0]])).positions_xy[0] = 0.0


# Walk


def test_a_walk_lasts_from_its_first_to_its_last_time_of_motion_or_scan():
    walk = tracked_walk(STRAIGHT, times_s=np.arange(10.0, 15.0), scans=scans_at([8.0, 12.0]))
    assert walk.start_s == 8.0
    assert walk.duration_s == 6.0


def test_a_walk_without_anything_lasts_no_time():
    assert Walk("empty", scans_at([])).duration_s == 0.0


def test_the_motion_is_the_odometry_where_there_is_one_else_the_accelerometer():
    accelerometer = Signal([0.0, 1.0], np.zeros((2, 3)))
    walk = dataclasses.replace(tracked_walk(STRAIGHT), inertial=Inertial(accelerometer))
    assert walk.motion is walk.odometry
    assert dataclasses.replace(walk, odometry=None).motion is accelerometer
    assert dataclasses.replace(walk, odometry=None, inertial=None).motion is None


def test_a_good_walk_passes_the_check():
    walk = tracked_walk(STRAIGHT)
    assert check_walk(walk) is walk


def test_a_walk_without_scans_fails_and_names_its_file():
    walk = dataclasses.replace(tracked_walk(STRAIGHT), wifi=scans_at([]), path=Path("logs/a.txt"))
    with pytest.raises(LogError, match=r"logs/a\.txt: expected WiFi scans, found none"):
        check_walk(walk)


@pytest.mark.parametrize("odometry", [None, Signal([0.0], np.zeros((1, 3)))])
def test_a_walk_without_motion_fails(odometry):
    walk = dataclasses.replace(tracked_walk(STRAIGHT), odometry=odometry)
    with pytest.raises(LogError, match="expected motion"):
        check_walk(walk)


def test_a_gap_in_the_motion_fails_and_says_where():
    times_s = np.array([0.0, 1.0, 2.0, 3.0 + LONGEST_GAP_S, 4.0 + LONGEST_GAP_S])
    with pytest.raises(LogError, match=r"a jump of 601 s after t = 2\.000 s; split the log"):
        check_walk(tracked_walk(STRAIGHT, times_s=times_s))


def test_a_gap_just_within_the_limit_passes():
    check_walk(tracked_walk(STRAIGHT, times_s=np.array([0.0, 1.0, 2.0, 2.0 + LONGEST_GAP_S, 3.0 + LONGEST_GAP_S])))


@pytest.mark.parametrize("scan_time_s", [-0.1, 4.1, 1e9])
def test_clocks_that_never_meet_fail(scan_time_s):
    with pytest.raises(LogError, match="two clocks that never meet"):
        check_walk(tracked_walk(STRAIGHT, scans=scans_at([scan_time_s])))


@pytest.mark.parametrize("scan_time_s", [0.0, 4.0])
def test_a_single_scan_at_either_end_of_the_motion_is_enough(scan_time_s):
    check_walk(tracked_walk(STRAIGHT, scans=scans_at([scan_time_s])))
