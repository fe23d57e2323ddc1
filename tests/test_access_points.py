"""Access points of simulated buildings, whose true positions are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radioslam.access_points import COLUMNS, access_points, as_rows, log_evidence
from radioslam.config import load_config
from radioslam.map_export import merge
from radioslam.positioning_experiment import surveyed
from radioslam.simulator import SCENARIOS, simulate
from radioslam.simulator.survey import make_world
from radioslam.slam import map_walks
from tests.radio import STATIONS, hall

SAMPLES, _ = hall(np.random.default_rng(0), 300)


def office(seed):
    """The office's surveyed map, and the true position of each BSSID."""
    config = load_config(overrides=["merging.starts=known", "optimizer.standard_deviations=false"], environment={})
    samples = surveyed(map_walks(simulate("office", seed=seed), config))
    world = make_world(SCENARIOS["office"], seed).transmitters
    return samples, dict(zip(world.bssids, world.site_xy[world.radio_site[world.bssid_radio]], strict=True))


def test_access_points_of_offices_are_found_with_deviations_that_hold():
    errors, sigmas = [], []
    for seed in (4, 5, 6):
        samples, truth = office(seed)
        for point in access_points(samples):
            if point.position_xy is not None:
                errors.append(np.hypot(*(point.position_xy - truth[point.transmitter])))
                sigmas.append(point.sigma_m)
    assert len(errors) > 100
    assert np.median(errors) < 3.5
    assert 0.85 <= np.mean(np.array(errors) <= 2.45 * np.array(sigmas)) <= 0.99  # 95 % of a circular Gaussian


def test_every_access_point_of_a_hall_is_found():
    found = {point.transmitter: point for point in access_points(SAMPLES)}
    assert list(found) == list(SAMPLES.transmitters)
    for station, point in zip(STATIONS, found.values(), strict=True):
        assert np.hypot(*(point.position_xy - station)) < 3.0
        column = SAMPLES.rss_dbm[:, [SAMPLES.transmitters.index(point.transmitter)]]
        assert (point.samples, point.strongest_dbm) == (column.nnz, column.data.max())


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        (SAMPLES.poses[:, 0] < 3, "of 5 places that are needed"),
        ((SAMPLES.poses[:, 0] > 25) & (SAMPLES.poses[:, 1] < 12), ""),
    ],
)
def test_without_the_data_there_is_a_reason_and_no_guess(rows, reason):
    few = SAMPLES.select(np.flatnonzero(rows)[:4] if reason else rows)
    points = access_points(few)
    without = [point for point in points if point.position_xy is None]
    assert without
    for point in without:
        assert point.reason
        assert reason in point.reason
        assert np.isnan(point.sigma_m)


def test_what_is_far_outside_the_walks_is_said_to_be_outside():
    """Only the east end was walked: what stands in the far west is heard, and falls off towards the east."""
    xy = SAMPLES.poses[:, :2] + [200.0, 0.0]
    distance = np.hypot(*xy.T)
    rss = SAMPLES.rss_dbm[:, [0]].tolil()
    rss[:, 0] = -20 - 30 * np.log10(distance)
    (point,) = access_points(replace(SAMPLES, rss_dbm=rss.tocsr(), transmitters=("far",)))
    assert point.position_xy is None
    assert point.reason == "outside the walked area" or "only" in point.reason


def test_the_evidence_is_that_of_the_gaussian_it_stands_for():
    """Against the dense covariance, for evidence 1 and one shadowing."""
    from scipy.stats import multivariate_normal

    from radioslam import access_points as module

    rng = np.random.default_rng(0)
    log_distance, rss = -10 * np.log10(rng.uniform(1, 30, (6, 4))), rng.uniform(-80, -40, 6)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "EVIDENCE", 1.0)
        patch.setattr(module, "SHADOWING_DB", (5.0,))
        ours = log_evidence(log_distance, rss)
    dense = []
    for column in log_distance.T:
        basis = np.column_stack([np.ones(6), column])
        covariance = 25 * np.eye(6) + basis @ np.diag([module.POWER_SIGMA_DB**2, module.EXPONENT_SIGMA**2]) @ basis.T
        dense.append(multivariate_normal.logpdf(rss, module.POWER_DBM + module.EXPONENT * column, covariance))
    np.testing.assert_allclose(np.diff(ours), np.diff(dense), rtol=1e-9, atol=1e-9)


def test_floors_have_access_points_of_their_own():
    above = hall(np.random.default_rng(3), 300, prefix="02:00:00:00:01")[0]
    points = access_points(merge([SAMPLES, above], ["0", "1"]))
    assert {point.floor for point in points} == {"0", "1"}
    assert len(points) == 2 * len(STATIONS)


def test_rows_hold_every_column_most_samples_first():
    rows = as_rows(SAMPLES)
    counts = [int(row["samples"]) for row in rows]
    assert counts == sorted(counts, reverse=True)
    assert all(tuple(row) == COLUMNS for row in rows)
