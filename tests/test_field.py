from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from radioslam.config import FieldConfig
from radioslam.errors import MappingError
from radioslam.field import build_field, condense
from tests.radio import hall


def test_the_field_finds_strengths_between_the_samples():
    samples, truth = hall(np.random.default_rng(0), 400)
    field = build_field(samples.poses[:, :2], samples.sigma_m, samples.rss_dbm, FieldConfig())
    asked = np.random.default_rng(1).uniform([5, 5], [35, 25], (50, 2))
    at, expected = field.predict(asked), truth(asked)
    heard = expected > -80
    assert np.abs(at.mean_dbm - expected)[heard].mean() < 3.0
    assert at.detection[heard].mean() > 0.8


def test_uncertainty_grows_away_from_the_samples():
    samples, _ = hall(np.random.default_rng(0), 200)
    field = build_field(samples.poses[:, :2], samples.sigma_m, samples.rss_dbm, FieldConfig())
    near, far = field.predict(np.array([[20.0, 15.0]])), field.predict(np.array([[300.0, 300.0]]))
    assert np.all(far.sigma_db > near.sigma_db)
    assert np.all(far.detection < 0.1)


def test_uncertain_positions_are_trusted_less():
    xy = np.array([[0.0, 0.0], [10.0, 0.0]])
    rss = sparse.csr_array(np.array([[-50.0], [-50.0]]))
    field = build_field(xy, np.array([0.0, 20.0]), rss, FieldConfig(), (12.0, 0.3))
    ends = field.predict(xy).mean_dbm[:, 0]
    assert ends[1] < ends[0] < -50  # pulled towards the floor, the uncertain one more


def test_silence_lowers_the_field():
    """Where nothing is heard the mean lies below the limit, though no reading says so."""
    xy = np.column_stack([np.arange(0, 60, 1.0), np.zeros(60)])
    rss = np.where(xy[:, :1] < 20, -60.0 - xy[:, :1], 0.0)
    field = build_field(xy, np.zeros(60), sparse.csr_array(rss), FieldConfig())
    assert field.predict(np.array([[50.0, 0.0]])).mean_dbm[0, 0] < rss[rss < 0].min()


def test_columns_choose_access_points():
    samples, _ = hall(np.random.default_rng(0), 200)
    field = build_field(samples.poses[:, :2], samples.sigma_m, samples.rss_dbm, FieldConfig())
    places = samples.poses[:5, :2]
    np.testing.assert_allclose(
        field.predict(places, np.array([3, 1])).mean_dbm, field.predict(places).mean_dbm[:, [3, 1]]
    )


def test_cells_are_widened_until_there_are_few_enough():
    xy = np.random.default_rng(0).uniform(0, 100, (500, 2))
    cells = condense(xy, np.ones(500), 1.0, 50)
    assert len(cells.count) <= 50
    assert cells.count.sum() == 500
    np.testing.assert_allclose(cells.count @ cells.centre_xy / 500, xy.mean(axis=0))


def test_nothing_heard_is_one_clear_error():
    with pytest.raises(MappingError, match="found none"):
        build_field(np.zeros((3, 2)), np.zeros(3), sparse.csr_array((3, 2)), FieldConfig())
