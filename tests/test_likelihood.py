from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.integrate import quad
from scipy.stats import norm

from radioslam.config import FieldConfig
from radioslam.field import build_field
from radioslam.likelihood import Candidates, relative_strengths
from tests.radio import hall

SAMPLES, _ = hall(np.random.default_rng(0), 200)
SCANS = sparse.csr_array(SAMPLES.rss_dbm[:5])
FIELD = build_field(SAMPLES.poses[:, :2], SAMPLES.sigma_m, SAMPLES.rss_dbm, FieldConfig())
TRUST = np.array([0.0, 0.5, *np.ones(10)])


def plainly(row, place, offset_db):
    """log p + log N(r - b; μ, v) of what is heard, weighted, and log(1 - p) of the rest; up to ½ log 2π's."""
    at = FIELD.predict(FIELD.cells.centre_xy[place : place + 1])
    scan, weight = SCANS[[row]].toarray()[0], relative_strengths(SCANS[[row]]).toarray()[0]
    mean, p, sigma = at.mean_dbm[0], at.detection[0], np.sqrt(FIELD.residual_variance)
    heard = weight * (np.log(p) + norm.logpdf(scan - offset_db, mean, sigma) + 0.5 * np.log(2 * np.pi))
    return float(np.sum(TRUST * np.where(scan != 0, heard, np.log1p(-p))))


def test_without_offset_it_is_the_sum_over_access_points():
    fits = Candidates.of(FIELD, TRUST, 0.0).log_likelihood(SCANS)
    for row, place in ((0, 3), (4, 50)):
        assert fits[row, place] == pytest.approx(plainly(row, place, 0.0), abs=0.05)


def test_the_offset_is_integrated_out():
    fits = Candidates.of(FIELD, TRUST, 3.0).log_likelihood(SCANS)
    for row, place in ((0, 3), (4, 50)):
        top = plainly(row, place, 0.0)
        integral, _ = quad(lambda b: np.exp(plainly(row, place, b) - top) * norm.pdf(b, 0, 3.0), -20, 20)  # noqa: B023
        assert fits[row, place] == pytest.approx(top + np.log(integral), abs=0.05)


def test_strengths_are_relative_to_the_scan():
    louder = sparse.csr_array((SCANS.data + 7.0, SCANS.indices, SCANS.indptr), shape=SCANS.shape)
    np.testing.assert_allclose(relative_strengths(louder).data, relative_strengths(SCANS).data)
    np.testing.assert_allclose(relative_strengths(SCANS).sum(axis=1), np.diff(SCANS.indptr))
    assert relative_strengths(sparse.csr_array((2, 3))).nnz == 0
