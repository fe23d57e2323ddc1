from __future__ import annotations

import numpy as np
import pytest

from radioslam.config import load_config
from radioslam.errors import PositioningError
from radioslam.following import follow, follow_live
from radioslam.positioning import Positioner
from tests.builders import scans_of, tracked_walk
from tests.radio import STATIONS, hall

SAMPLES, TRUTH = hall(np.random.default_rng(0), 400)


def walk_through_the_hall(noise_db=3.0, scans=44):
    """Along the long side and back, told from (0, 0) and turned by 0.1 rad, so that neither start nor frame helps."""
    xy = np.array([[5.0 + k, 8.0] for k in range(30)] + [[34.0, 8.0 + k] for k in range(1, 15)])
    rss = TRUTH(xy) + np.random.default_rng(5).normal(0, noise_db, (len(xy), len(STATIONS)))
    rows = [
        (float(k), SAMPLES.transmitters[a], min(rss[k, a], -20.0))
        for k in range(scans)
        for a in range(len(STATIONS))
        if rss[k, a] > -85
    ]
    turn = np.array([[np.cos(-0.1), -np.sin(-0.1)], [np.sin(-0.1), np.cos(-0.1)]])
    told = (xy - xy[0]) @ turn.T
    return tracked_walk(np.column_stack([told, np.zeros(len(xy))]), scans=scans_of(*rows)), xy


def test_a_walk_is_followed_from_an_unknown_start_better_than_scan_by_scan():
    positioner = Positioner.of(SAMPLES)
    walk, truth = walk_through_the_hall()
    walked = follow(positioner, walk, load_config(environment={}), seed=1)
    track = np.hypot(*(walked.poses[:, :2] - truth).T)
    assert track.mean() < positioner.floors[0].calibration.sigma_floor_m
    assert track[0] < 4.0


def test_one_seed_gives_one_track():
    positioner = Positioner.of(SAMPLES)
    walk, _ = walk_through_the_hall()
    twice = [follow(positioner, walk, load_config(environment={}), seed=2).poses for _ in range(2)]
    np.testing.assert_array_equal(*twice)


def test_a_walk_of_another_building_is_refused():
    walk = tracked_walk(np.zeros((5, 3)))
    with pytest.raises(PositioningError, match="found none; is it of this place"):
        follow(Positioner.of(SAMPLES), walk, load_config(environment={}), seed=1)


def test_a_recorded_walk_is_known_better_than_one_that_lasts():
    positioner, config = Positioner.of(SAMPLES), load_config(environment={})
    errors = []
    for method in (follow, follow_live):
        walk, truth = walk_through_the_hall(noise_db=6.0)
        walked = method(positioner, walk, config, seed=1)
        errors.append(np.hypot(*(walked.poses[:, :2] - truth).T))
        assert np.mean(errors[-1] < 2.45 * walked.sigma_m) > 0.9
    assert errors[0].mean() < errors[1].mean()


def test_what_is_told_of_a_walk_that_lasts_does_not_change_with_what_comes_later():
    positioner, config = Positioner.of(SAMPLES), load_config(environment={})
    whole, begun = (follow_live(positioner, walk_through_the_hall(scans=n)[0], config, seed=3) for n in (44, 20))
    np.testing.assert_allclose(begun.poses, whole.poses[:20])
