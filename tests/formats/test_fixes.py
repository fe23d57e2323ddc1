import numpy as np
import pytest

from radioslam.errors import LogError
from radioslam.formats.fixes import geodetic_reference
from radioslam.formats.lines import Lines

LINES = Lines("a.csv", [b""] * 3, [2, 3, 4])
TIME_S, LATITUDE, LONGITUDE = np.array([5.0, 0.0, 10.0]), np.array([48.001, 48.0, 48.0]), np.array([11.5, 11.5, 11.501])


def test_positions_are_metres_from_the_earliest_fix():
    reference = geodetic_reference(LINES, TIME_S, LATITUDE, LONGITUDE, [])
    assert (reference.origin_wgs84, reference.sigma_m) == ((48.0, 11.5), None)
    np.testing.assert_allclose(reference.positions_xy, [[0, 0], [0, 111.2], [74.6, 0]], atol=0.1)


def test_bad_fixes_are_left_out_and_sigma_is_of_the_rest():
    notes = []
    reference = geodetic_reference(LINES, TIME_S, LATITUDE, LONGITUDE, notes, np.array([3.0, -1.0, 51.0]))
    np.testing.assert_array_equal(reference.time_s, [5])
    assert reference.sigma_m == pytest.approx(3 / 1.5096, rel=1e-3)
    assert notes == ["2 fixes with an accuracy beyond 50 m or none left out"]
    assert geodetic_reference(LINES, TIME_S, LATITUDE, LONGITUDE, [], np.full(3, 99.0)) is None


def test_sigma_means_that_68_percent_lie_within_the_accuracy():
    from radioslam.formats.fixes import RADIUS_68_SIGMAS

    away = np.hypot(*np.random.default_rng(0).normal(0, 2.0, (2, 100_000)))
    assert np.mean(away < 2.0 * RADIUS_68_SIGMAS) == pytest.approx(0.68, abs=0.005)


@pytest.mark.parametrize("wrong", [90.5, -91.0, np.nan])
def test_what_is_no_latitude_names_its_line(wrong):
    with pytest.raises(LogError, match=r"a\.csv:3: expected a latitude and longitude"):
        geodetic_reference(LINES, TIME_S, np.array([48.0, wrong, 48.0]), LONGITUDE, [])
