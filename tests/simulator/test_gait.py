import numpy as np
import pytest

from radioslam.simulator.gait import RATE_HZ, Gait, body_motion
from radioslam.simulator.walkers import Route, TruePath

GAIT = Gait()


def walk_on(points_xy, speed_mps):
    points = np.asarray(points_xy, dtype=float)
    route = Route(points, np.zeros(0))
    length = route.distance_m[-1]
    return TruePath(route, np.array([0.0, length / speed_mps]), np.array([0.0, length]))


@pytest.mark.parametrize("speed_mps", [0.7, 1.0, 1.4])
def test_step_rate_and_length_hang_together(speed_mps):
    speed = np.array([speed_mps])
    assert GAIT.step_rate_hz(speed) * GAIT.step_length_m(speed) == pytest.approx(speed)
    assert 1.2 < GAIT.step_rate_hz(speed)[0] < 2.0
    assert 0.5 < GAIT.step_length_m(speed)[0] < 0.8


@pytest.mark.parametrize("speed_mps", [0.7, 1.0, 1.4])
def test_stepping_frequency_and_step_length_can_be_recovered(speed_mps):
    motion = body_motion(walk_on([[0, 0], [80, 0]], speed_mps), GAIT)
    inside = slice(int(2 * RATE_HZ), -int(2 * RATE_HZ))
    bounce = motion.acceleration_mps2[inside, 2]
    spectrum = np.abs(np.fft.rfft(bounce * np.hanning(len(bounce))))
    frequency = np.fft.rfftfreq(len(bounce), 1 / RATE_HZ)[spectrum.argmax()]
    rate = GAIT.step_rate_hz(np.array([speed_mps]))[0]
    assert frequency == pytest.approx(rate, abs=2 * RATE_HZ / len(bounce))
    weinberg_m = GAIT.weinberg_k * np.ptp(bounce) ** 0.25
    assert weinberg_m == pytest.approx(speed_mps / rate, rel=0.01)
    assert motion.step_count * weinberg_m == pytest.approx(80.0, rel=0.03)


def test_a_standing_body_does_not_move():
    path = TruePath(walk_on([[0, 0], [10, 0]], 1.0).route, np.array([0, 10, 20, 21.0]), np.array([0, 9, 9, 10.0]))
    motion = body_motion(path, GAIT)
    still = slice(int(12 * RATE_HZ), int(18 * RATE_HZ))
    np.testing.assert_allclose(motion.acceleration_mps2[still], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.ptp(motion.step_phase_rad[still]), 0.0, atol=1e-9)
    np.testing.assert_allclose(np.ptp(motion.heading_rad[still]), 0.0, atol=1e-9)


def test_the_body_faces_where_it_goes():
    motion = body_motion(walk_on([[0, 0], [10, 0], [10, 10], [0, 10]], 1.0), GAIT)
    for second, expected in ((5, 0.0), (15, np.pi / 2), (25, np.pi)):
        assert motion.heading_rad[int(second * RATE_HZ)] == pytest.approx(expected, abs=1e-6)


def test_faster_people_bounce_more():
    speed = np.linspace(0.3, 1.8, 20)
    assert np.all(np.diff(GAIT.bounce_range_mps2(speed)) > 0)
    assert GAIT.bounce_range_mps2(np.array([0.0])) == 0
    assert np.ptp(GAIT.bounce(np.linspace(0, 2 * np.pi, 5000))) == pytest.approx(1.0, abs=1e-4)
