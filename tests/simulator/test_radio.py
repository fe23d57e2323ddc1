from dataclasses import replace

import numpy as np
import pytest

from radioslam.simulator import SCENARIOS
from radioslam.simulator.access_points import Deployment, Transmitters, deploy
from radioslam.simulator.building import Building, Wall
from radioslam.simulator.radio import Propagation, Receiver, fading_db, is_detected, make_radio, read_out


def one_site(height_m=1.2, floor=0):
    """A box at (0, 0) with a radio at 2.4 GHz and one at 5 GHz, both of 10 dBm."""
    return Transmitters(
        site_xy=np.zeros((1, 2)),
        site_floor=np.array([floor]),
        site_height_m=np.array([height_m]),
        on_s=np.array([0.0]),
        off_s=np.array([100.0]),
        radio_site=np.array([0, 0]),
        radio_mhz=np.array([2437.0, 5500.0]),
        radio_power_dbm=np.array([10.0, 10.0]),
        bssid_radio=np.array([0, 0, 1]),
        bssids=("a", "b", "c"),
        ephemeral=np.zeros(3, dtype=bool),
    )


def radio_with(walls=(), transmitters=None, **propagation):
    building = Building(100.0, 100.0, tuple(walls), (), (), (0.0, 0.0), 3.6)
    return make_radio(building, transmitters or one_site(), Propagation(**propagation), 3, 0, "test")


def test_mean_strength_follows_the_log_distance_law():
    mean = radio_with(exponent=2.5).mean_dbm(np.array([[1.0, 0.0], [10.0, 0.0], [0.0, 100.0]]), 0)
    free_space = 10.0 - (20 * np.log10([2437.0, 5500.0]) - 27.55)
    np.testing.assert_allclose(mean, free_space - 25.0 * np.array([[0], [1], [2]]), atol=1e-9)


def test_walls_weaken_and_their_loss_saturates():
    at = np.array([[10.0, 0.0]])
    wall = Wall((5.0, -1.0), (5.0, 1.0))
    settings = {"wall_factor": 1.0, "wall_ceiling_db": 1e9, "wall_factor_5ghz": 1.5}
    clear = radio_with(**settings).mean_dbm(at, 0)
    np.testing.assert_allclose(clear - radio_with([wall], **settings).mean_dbm(at, 0), [[10.0, 15.0]], atol=1e-3)
    many = [Wall((x, -1.0), (x, 1.0)) for x in np.linspace(1, 9, 50)]
    capped = radio_with(many, wall_ceiling_db=40.0).mean_dbm(at, 0)
    np.testing.assert_allclose(clear - capped, 40.0, atol=1e-3)


def test_floors_weaken():
    at = np.array([[50.0, 0.0]])
    levels = [radio_with(floor_loss_db=17.0).mean_dbm(at, floor)[0, 0] for floor in range(3)]
    assert levels[0] - levels[1] == pytest.approx(17.0, abs=0.3)
    assert levels[1] - levels[2] == pytest.approx(17.0, abs=0.3)


def test_shadowing_has_its_standard_deviation():
    many = deploy(SCENARIOS["campus"].make_building(), Deployment(), 3600.0, 0, "many")
    world = radio_with(transmitters=many, shadowing_db=6.0)
    at = np.random.default_rng(0).uniform(0, 100, (60, 2))
    shadow = world.local_mean_dbm(at, 0) - world.mean_dbm(at, 0)
    assert shadow.std() == pytest.approx(6.0, rel=0.08)


def test_fading_keeps_the_mean_power_and_is_weaker_with_a_steady_path():
    rng = np.random.default_rng(0)
    rayleigh, rician = fading_db((40_000,), 0.0, 1, rng), fading_db((40_000,), 10.0, 2, rng)
    assert np.mean(10 ** (rayleigh / 10)) == pytest.approx(1.0, abs=0.03)
    assert np.mean(10 ** (rician / 10)) == pytest.approx(1.0, abs=0.03)
    assert rayleigh.std() == pytest.approx(5.57, abs=0.15)  # the known spread of a Rayleigh channel in dB
    assert rician.std() < 2.0


def test_detection_limit():
    phone = Receiver(detection_dbm=-90.0, detection_width_db=1.0, missed_share=0.1)
    rng = np.random.default_rng(0)
    share = [is_detected(np.full(20_000, level), phone, rng).mean() for level in (-110.0, -90.0, -70.0)]
    assert share == pytest.approx([0.0, 0.45, 0.9], abs=0.02)


def test_reading_is_quantised_offset_and_kept_in_range():
    power = np.array([-60.4, -60.6, -5.0, -np.inf])
    np.testing.assert_array_equal(read_out(power, Receiver()), [-60, -61, -20, -127])
    np.testing.assert_array_equal(read_out(power[:2], Receiver(offset_db=-3.2)), [-64, -64])
    np.testing.assert_array_equal(read_out(power[:2], Receiver(step_db=2.0)), [-60, -60])


def test_two_phones_at_one_place_differ_by_their_offset():
    world = radio_with()
    at = np.tile([[20.0, 0.0]], (90, 1))
    time_s = np.arange(90.0)
    scans = [
        world.scan(at, time_s, 0, replace(Receiver(), offset_db=offset), np.random.default_rng(1))
        for offset in (0.0, 5.0)
    ]
    reference, other = scans
    np.testing.assert_array_equal(reference.bssid, other.bssid)
    np.testing.assert_array_equal(reference.scan, other.scan)
    np.testing.assert_array_equal(other.rss_dbm - reference.rss_dbm, 5.0)


def test_who_is_not_on_air_is_not_heard():
    world = radio_with()
    time_s = np.array([-50.0, 10.0, 50.0, 99.0, 100.0, 500.0])
    readings = world.scan(np.ones((6, 2)), time_s, 0, Receiver(missed_share=0.0), np.random.default_rng(0))
    assert readings.scan.tolist() == [1, 1, 1, 2, 2, 2, 3, 3, 3]
    assert readings.bssid.tolist() == [0, 1, 2] * 3


def test_networks_of_one_radio_fade_together():
    world = radio_with(reading_sd_db=1.0)
    at = np.tile([[20.0, 0.0]], (90, 1))
    phone = Receiver(missed_share=0.0, detection_dbm=-200.0)
    rss = world.scan(at, np.arange(90.0), 0, phone, np.random.default_rng(0)).rss_dbm.reshape(90, 3)
    assert np.std(rss[:, 0] - rss[:, 1]) < 2.0 < np.std(rss[:, 0] - rss[:, 2])
