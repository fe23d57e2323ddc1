from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from radioslam.calibration import COVERAGE, SHARES, calibrate
from radioslam.config import load_config
from radioslam.positioning import Positioner
from tests.radio import hall

CONFIG = load_config(environment={})
SAMPLES, _ = hall(np.random.default_rng(0), 400)


def test_every_share_of_the_scans_has_its_own_radius():
    found = calibrate(SAMPLES, np.ones(12), CONFIG, (25.0, 0.3))
    assert found.radius_per_sigma.shape == (SHARES,)
    assert np.all(np.diff(found.similarities) > 0)
    assert found.least_similarity < found.usual_similarity < found.similarities[0]
    assert found.coverage == pytest.approx(COVERAGE, abs=0.02)


def test_the_radius_of_a_scan_is_that_of_its_share():
    floor = Positioner.of(SAMPLES).floors[0]
    known = floor.calibration
    closest = np.array([0.0, *known.similarities])
    radius = floor.radius_m(np.ones((SHARES, 2)), closest)
    np.testing.assert_allclose(radius, known.radius_per_sigma * np.hypot(2**0.5, known.sigma_floor_m))


def test_scans_that_are_all_alike_leave_no_share_without_a_radius():
    same = sparse.csr_array(np.tile(SAMPLES.rss_dbm[[0]].toarray(), (len(SAMPLES), 1)))
    found = calibrate(replace(SAMPLES, rss_dbm=same), np.ones(12), CONFIG, (25.0, 0.3))
    assert np.all(np.isfinite(found.radius_per_sigma))
