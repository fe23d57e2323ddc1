import numpy as np
import pytest

from radioslam.simulator.calibration import bssids_per_scan, campus_table, odometry_errors_m
from radioslam.walk import RadioScans, Reference, Signal, Walk


def test_readings_are_counted_above_each_level():
    scans = RadioScans.from_readings([0.0, 0.0, 5.0], ["a", "b", "a"], [-50.0, -80.0, -60.0])
    np.testing.assert_allclose(bssids_per_scan([Walk("w", scans)], (-90, -80, -60, -50)), [1.5, 1.0, 0.5, 0.0])


def test_odometry_is_compared_from_the_common_start():
    scans = RadioScans.from_readings([0.0, 10.0], ["a", "a"], [-50.0, -60.0])
    reference = Reference(np.array([0.0, 10.0]), np.array([[5.0, 5.0], [5.0, 15.0]]))
    odometry = Signal(np.array([0.0, 10.0]), np.array([[0.0, 0.0, 1.6], [3.0, 6.0, 1.6]]))
    np.testing.assert_allclose(odometry_errors_m(Walk("w", scans, odometry=odometry, reference=reference)), [0, 5])
    with pytest.raises(ValueError, match="w: odometry and reference"):
        odometry_errors_m(Walk("w", scans))


def test_table_has_a_line_per_level():
    table = campus_table([1], "office").splitlines()
    assert table[2].startswith("| -90 dBm | 163.2 |")
    assert len(table) == 2 + 6 + 2
    assert table[-1].startswith("Odometry alone at the scans: ")
