"""Walks that are found in a map by the votes of their scans."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from radioslam.config import load_config
from radioslam.places import Samples
from radioslam.planar import rotate
from radioslam.seeking import seek
from radioslam.similarity import unit_rows

CONFIG = load_config(environment={})
BEACONS_XY = np.random.default_rng(3).uniform(-10, 50, (60, 2))


def heard(positions_xy):
    """Strengths that fall off with the distance to sixty access points."""
    away = np.hypot(*(positions_xy[:, None] - BEACONS_XY).transpose(2, 0, 1))
    return unit_rows(sparse.csr_array(np.exp(-away / 6) * (away < 20)))


def samples(positions_xy, strengths, sigma_m=1.0):
    n = len(positions_xy)
    poses, zero = np.column_stack([positions_xy, np.zeros(n)]), np.zeros(n)
    return Samples(np.zeros(n, np.int64), np.arange(n), poses, np.zeros((n, 2)), zero + sigma_m, zero, strengths)


@pytest.fixture(scope="module")
def places():
    grid = np.stack(np.meshgrid(np.arange(0, 40, 2.0), np.arange(0, 40, 2.0)), axis=-1).reshape(-1, 2)
    return samples(grid, heard(grid))


def path(count=20):
    along = np.linspace(0, 30, count)
    return np.column_stack([5 + along, np.where(along < 15, 8.0, along - 7)])


@pytest.mark.parametrize("turn_rad", [0.0, 0.21, -0.35])
def test_a_walk_is_found_with_its_turn(places, turn_rad):
    truth = path()
    own = samples(rotate(np.full(len(truth), -turn_rad), truth - [20, 30]), heard(truth))
    found = seek(own, np.arange(20.0), places, CONFIG)
    at = truth[int(found.time_s)]
    assert np.hypot(*(found.position_xy - at)) < 3.0
    assert found.turn_rad == pytest.approx(turn_rad, abs=0.25)  # where the optimizer begins, no more
    assert 1.0 <= found.sigma_m < 4.0


def test_a_walk_of_elsewhere_is_not_found(places):
    silent = unit_rows(sparse.csr_array(np.eye(80)[60:]))
    found = seek(samples(path(), silent), np.arange(20.0), places, CONFIG)
    assert found.position_xy is None
    assert "0 of 20 scans are like any" in found.reason


def test_two_places_that_are_alike_are_told(places):
    far = Samples.concatenate([places, samples(places.poses[:, :2] + [200, 0], places.strengths)])
    found = seek(samples(path(), heard(path())), np.arange(20.0), far, CONFIG)
    assert found.position_xy is None
    assert "two places are alike" in found.reason


def test_scans_that_disagree_are_no_place(places):
    shuffled = np.random.default_rng(0).permutation(20)
    found = seek(samples(path() * 6, heard(path()[shuffled])), np.arange(20.0), places, CONFIG)
    assert found.position_xy is None
    assert "agree" in found.reason or "alike" in found.reason
    assert seek(samples(path()[:2], heard(path()[:2])), np.arange(2.0), places, CONFIG).position_xy is None
