import re

import numpy as np
import pytest

from radioslam.simulator import SCENARIOS
from radioslam.simulator.access_points import Deployment, deploy

BUILDING = SCENARIOS["office"].make_building()


def test_density_and_networks_are_as_ordered():
    plan = Deployment(area_per_site_m2=50.0, bssids_per_radio=3, storeys=2, neighbours=0, hotspots=0.0)
    sites = deploy(BUILDING, plan, 3600.0, 1, "w")
    assert len(sites.site_xy) == pytest.approx(2 * 800 / 50.0, rel=0.1)
    assert len(sites.bssids) == len(sites.site_xy) * 2 * 3
    assert (sites.site_xy >= 0).all()
    assert (sites.site_xy <= [BUILDING.width_m, BUILDING.depth_m]).all()


def test_names_are_unique_addresses_and_differ_between_worlds():
    one = deploy(BUILDING, Deployment(neighbours=300), 3600.0, 1, "w")
    two = deploy(BUILDING, Deployment(neighbours=300), 3600.0, 2, "w")
    assert len(set(one.bssids)) == len(one.bssids)
    assert not set(one.bssids) & set(two.bssids)
    assert all(re.fullmatch(r"02(:[0-9a-f]{2}){5}", name) for name in one.bssids)


def test_neighbours_stand_outside():
    plan = Deployment(area_per_site_m2=1e6, neighbours=50, hotspots=0.0)
    sites = deploy(BUILDING, plan, 3600.0, 1, "w")
    x, y = sites.site_xy[1:].T
    assert np.all((x < 0) | (x > BUILDING.width_m) | (y < 0) | (y > BUILDING.depth_m))
    assert len(x) == 50


def test_hotspots_come_and_go_at_a_steady_number():
    plan = Deployment(neighbours=0, hotspots=40.0, hotspot_life_s=600.0, outage_share=0.0)
    sites = deploy(BUILDING, plan, 20 * 3600.0, 1, "w")
    moving = np.isfinite(sites.on_s)
    present = [np.sum(moving & (sites.on_s <= t) & (t < sites.off_s)) for t in np.linspace(0, 20 * 3600.0, 100)]
    assert np.mean(present) == pytest.approx(40.0, rel=0.15)
    assert np.std(present) < 15
    assert sites.ephemeral.sum() == moving.sum()


def test_some_building_sites_are_switched():
    sites = deploy(BUILDING, Deployment(area_per_site_m2=2.0, hotspots=0, outage_share=0.2), 3600.0, 1, "w")
    switched = np.isfinite(sites.on_s) | np.isfinite(sites.off_s)
    assert switched.mean() == pytest.approx(0.2, abs=0.05)
