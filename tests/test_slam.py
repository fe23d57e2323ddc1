"""The page as a whole: simulated crowds, real floors, and walks that make no map."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from radioslam.config import load_config
from radioslam.errors import MappingError
from radioslam.formats import read_walks
from radioslam.loops import KEPT, LESS_SIMILAR, NEAR_IN_TIME
from radioslam.slam import map_walks
from radioslam.walk import RadioScans, Reference, Walk
from tests.crowds import office_result, office_walks

KNOWN = load_config("default", overrides=["merging.starts=known"], environment={})
COMMON = load_config("default", overrides=["merging.starts=common"], environment={})


def mean_errors(result):
    error = result.summary()["total"]["error"]
    return error["estimate"]["mean"], error["odometry"]["mean"]


@pytest.mark.parametrize("starts", ["common", "known"])
def test_a_simulated_crowd_errs_clearly_less_than_its_odometry(starts):
    estimate, odometry = mean_errors(office_result(starts=starts))
    assert estimate < 0.75 * odometry


def test_shuffled_walks_give_the_same_map():
    walks = list(office_walks())
    random.Random(3).shuffle(walks)
    shuffled, sorted_ = map_walks(walks, COMMON), office_result()
    assert shuffled.walks == sorted_.walks
    np.testing.assert_array_equal(shuffled.radio_map.poses, sorted_.radio_map.poses)
    np.testing.assert_array_equal(shuffled.loops.reason, sorted_.loops.reason)


def test_two_runs_give_identical_numbers():
    again = map_walks(office_walks(), COMMON)
    np.testing.assert_array_equal(again.radio_map.poses, office_result().radio_map.poses)


def test_every_scan_has_a_pose_and_a_positive_finite_sigma():
    result = office_result()
    scans = sum(len(walk.wifi) for walk in office_walks())
    assert result.radio_map.poses.shape == (scans, 3)
    assert np.isfinite(result.radio_map.poses).all()
    assert np.all(result.radio_map.sigma_m > 0)
    assert np.isfinite(result.radio_map.sigma_m).all()


def test_sigma_says_how_far_off_the_estimate_is():
    result = office_result(starts="known")
    error = result.radio_map.poses[:, :2] - result.reference_xy
    per_axis = np.sqrt(np.nanmean(error**2))
    assert 0.3 < per_axis / np.sqrt(np.mean(result.radio_map.sigma_m**2)) < 2.0


def test_the_solver_says_that_it_converged_and_that_the_error_fell():
    solver = office_result().solver
    assert solver.converged
    assert solver.cost_after < solver.cost_before


def test_too_few_iterations_are_not_called_convergence():
    config = load_config(overrides=["merging.starts=common", "optimizer.max_iterations=1"], environment={})
    assert not map_walks(office_walks(), config).solver.converged


def test_the_graph_stands_at_its_optimum():
    result = office_result()
    on_scans = result.graph.poses[:, :2]
    np.testing.assert_array_equal(on_scans, result.radio_map.poses[:, :2])


def test_a_single_walk_is_mapped_with_its_own_loops():
    result = map_walks(office_walks()[:1], COMMON)
    assert result.map_of_walk.tolist() == [0]
    assert result.solver.converged


def test_no_walk_at_all_is_refused():
    with pytest.raises(MappingError, match="at least one walk"):
        map_walks([], COMMON)


def test_two_walks_of_one_name_are_refused():
    walk = office_walks()[0]
    with pytest.raises(MappingError, match=walk.name):
        map_walks([walk, walk], COMMON)


def test_walks_of_two_floors_are_not_laid_over_each_other():
    first, *others = office_walks()
    with pytest.raises(MappingError, match="floors"):
        map_walks([replace(first, floor="F9"), *others], COMMON)


def test_known_starts_need_a_reference():
    walks = [replace(walk, reference=None) for walk in office_walks()]
    with pytest.raises(MappingError, match="--starts common"):
        map_walks(walks, KNOWN)


def test_a_walk_without_known_start_is_a_map_of_its_own():
    lost, *others = office_walks()
    result = map_walks([replace(lost, reference=None), *others], KNOWN)
    assert result.map_of_walk.tolist() == [1, 0, 0, 0, 0, 0]
    assert result.summary()["untied"] == [lost.name]
    kept = result.loops.kept
    assert not np.any((result.radio_map.walk[kept.i] == 0) != (result.radio_map.walk[kept.j] == 0))


def renamed(walk: Walk, prefix: str) -> Walk:
    names = tuple(prefix + name for name in walk.wifi.transmitters)
    return replace(walk, wifi=replace(walk.wifi, transmitters=names))


def test_walks_that_share_no_access_point_are_not_tied_by_loops():
    walks = [renamed(walk, walk.name) for walk in office_walks()]
    result = map_walks(walks, KNOWN)
    kept = result.loops.kept
    assert np.all(result.radio_map.walk[kept.i] == result.radio_map.walk[kept.j])


def test_scans_too_weak_to_learn_from_say_what_to_do():
    config = load_config(overrides=["fingerprints.rss_threshold_dbm=-1"], environment={})
    with pytest.raises(MappingError, match="rss_threshold_dbm"):
        map_walks(office_walks(), config)


def test_the_paper_preset_keeps_all_that_its_window_leaves():
    result = office_result("paper")
    assert len(result.loops.kept) > len(office_result().loops.kept)
    assert set(result.loops.reason.tolist()) <= {KEPT, NEAR_IN_TIME, LESS_SIMILAR}


def test_a_known_start_between_two_scans_is_held():
    walks = [walk_with_first_fix_at(walk, 0.4) for walk in office_walks()]
    result = map_walks(walks, KNOWN)
    assert len(result.graph.poses) == len(result.radio_map) + len(walks)
    assert mean_errors(result)[0] < 3.0


def walk_with_first_fix_at(walk: Walk, share: float) -> Walk:
    assert walk.reference is not None
    times = walk.reference.time_s
    later = times >= times[0] + share * (times[-1] - times[0])
    return replace(walk, reference=Reference(times[later], walk.reference.positions_xy[later]))


def test_scans_without_any_reading_keep_their_row():
    walk = office_walks()[0]
    deaf = RadioScans.from_readings(
        [*walk.wifi.scan_time_s[walk.wifi.reading_scan], walk.wifi.scan_time_s[3] + 0.01],
        [*(walk.wifi.transmitters[k] for k in walk.wifi.reading_transmitter), "weak"],
        [*walk.wifi.rss_dbm, -126.0],
    )
    result = map_walks([replace(walk, wifi=deaf), *office_walks()[1:]], COMMON)
    assert np.sum(result.radio_map.walk == 0) == len(walk.wifi) + 1


REAL_FLOORS = {
    # floor: (largest mean error allowed, largest share of odometry's)
    "indoor-location-20/site1/F1": (2.9, 0.85),
    "indoor-location-20/site1/F4": (2.7, 0.75),
    "ipin2023/floor0": (2.3, 0.6),
}


@pytest.mark.real_data
@pytest.mark.parametrize("floor", REAL_FLOORS)
def test_known_starts_on_a_real_floor(data_folder: Path, floor: str):
    largest, share = REAL_FLOORS[floor]
    result = map_walks(read_walks([data_folder / floor]), KNOWN)
    estimate, odometry = mean_errors(result)
    assert result.solver.converged
    assert estimate < largest
    assert estimate < share * odometry
    assert 0.95 < result.summary()["total"]["size_ratio"] < 1.05
