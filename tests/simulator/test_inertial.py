import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from radioslam.simulator import simulate
from radioslam.simulator.gait import Gait, body_motion
from radioslam.simulator.inertial import (
    EARTH_FIELD_UT,
    GRAVITY_MPS2,
    PhoneSensors,
    hand_attitude,
    inertial_streams,
    reported_rotation,
    steel_fields,
)
from radioslam.simulator.walkers import Route, TruePath

SENSORS = PhoneSensors()
STILL = TruePath(
    Route(np.array([[0.0, 0.0], [1.0, 0.0]]), np.zeros(0)), np.array([0.0, 60.0, 61.0]), np.array([0, 0, 1.0])
)


def heading(rotation):
    forward = rotation.apply([0.0, 1.0, 0.0])
    return np.unwrap(np.arctan2(forward[:, 1], forward[:, 0]))


def wandering(length_m=150.0):
    side = length_m / 4
    square = np.array([[0, 0], [side, 0], [side, side], [0, side], [0, 0.0]])
    return TruePath(Route(square, np.zeros(0)), np.array([0.0, length_m]), np.array([0.0, length_m]))


@pytest.fixture(scope="module")
def walk():
    return simulate("office", seed=4, walks=1, inertial=True)[0]


def test_streams_cover_the_walk_at_50_hz(walk):
    for name in ("accelerometer", "gyroscope", "magnetometer", "rotation_vector"):
        stream = getattr(walk.inertial, name)
        np.testing.assert_allclose(np.diff(stream.time_s), 0.02, atol=1e-6)
        assert stream.time_s[0] == walk.reference.time_s[0]
        assert walk.reference.time_s[-1] - stream.time_s[-1] < 1.0


def test_a_resting_phone_feels_gravity_and_the_earth_field():
    rng = np.random.default_rng(0)
    streams = inertial_streams(STILL, 0.0, steel_fields(SENSORS, rng), SENSORS, rng)
    rest = slice(0, 2500)
    norm = np.linalg.norm(streams.accelerometer.values[rest], axis=1)
    assert norm.mean() == pytest.approx(GRAVITY_MPS2, abs=4 * SENSORS.accelerometer_bias_mps2)
    assert norm.std() == pytest.approx(SENSORS.accelerometer_noise_mps2, rel=0.1)
    field = np.linalg.norm(streams.magnetometer.values[rest], axis=1)
    assert field.mean() == pytest.approx(np.linalg.norm(EARTH_FIELD_UT), abs=6.0)
    rates = streams.gyroscope.values[rest]
    np.testing.assert_allclose(rates.mean(axis=0), 0.0, atol=5 * SENSORS.gyroscope_bias_radps)
    np.testing.assert_allclose(rates.std(axis=0), SENSORS.gyroscope_noise_radps, rtol=0.1)


def test_the_rotation_vector_brings_gravity_upright(walk):
    rotation = Rotation.from_quat(walk.inertial.rotation_vector.values.copy())
    up = rotation.apply(walk.inertial.accelerometer.values.copy()).mean(axis=0)
    np.testing.assert_allclose(up, [0.0, 0.0, GRAVITY_MPS2], atol=0.25)
    np.testing.assert_allclose(np.linalg.norm(walk.inertial.rotation_vector.values, axis=1), 1.0)


def test_the_rotation_vector_heading_is_right_within_its_noise():
    motion = body_motion(wandering(), Gait())
    field = np.tile(EARTH_FIELD_UT, (len(motion.time_s), 1))
    errors = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        attitude = hand_attitude(motion, SENSORS, rng)
        reported = Rotation.from_quat(reported_rotation(attitude, field, SENSORS, rng))
        errors.append(np.rad2deg(heading(reported) - heading(attitude)))
    assert np.std([e.mean() for e in errors]) == pytest.approx(SENSORS.heading_bias_deg, rel=0.4)
    assert np.mean([e.std() for e in errors]) == pytest.approx(SENSORS.heading_noise_deg, rel=0.05)


def test_steel_bends_the_heading_but_not_far():
    rng = np.random.default_rng(1)
    motion = body_motion(wandering(), Gait())
    attitude = hand_attitude(motion, SENSORS, rng)
    steel = SENSORS.steel_ut * steel_fields(SENSORS, rng).at(
        motion.positions_xy, np.ones((len(motion.time_s), 2), bool)
    )
    field = EARTH_FIELD_UT + np.pad(steel, ((0, 0), (0, 1)))
    error_deg = np.rad2deg(
        heading(Rotation.from_quat(reported_rotation(attitude, field, SENSORS, rng))) - heading(attitude)
    )
    assert 0.5 < error_deg.std() < 6.0


def test_the_gyroscope_integrates_to_the_turns():
    rng = np.random.default_rng(2)
    motion_path = wandering()
    streams = inertial_streams(motion_path, 0.0, steel_fields(SENSORS, rng), SENSORS, rng)
    rotation = Rotation.from_quat(streams.rotation_vector.values.copy())
    about_vertical = rotation.apply(streams.gyroscope.values.copy())[:, 2]
    turned = np.rad2deg(np.sum(about_vertical) / 50.0)
    assert turned == pytest.approx(270.0, abs=30.0)


def test_raw_streams_are_there_on_demand_only_and_change_nothing_else(walk):
    plain = simulate("office", seed=4, walks=1)[0]
    assert plain.inertial is None
    np.testing.assert_array_equal(plain.odometry.values, walk.odometry.values)
    np.testing.assert_array_equal(plain.wifi.rss_dbm, walk.wifi.rss_dbm)
