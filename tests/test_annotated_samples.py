"""The annotated samples as a map of strengths, beside the field."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse

from radioslam.annotated_samples import AnnotatedSamples
from radioslam.config import FieldConfig
from radioslam.coverage import strength_map
from radioslam.errors import MappingError
from radioslam.field import build_field
from tests.radio import hall

SAMPLES, TRUTH = hall(np.random.default_rng(0), 400)
PLACES = np.random.default_rng(1).uniform([5, 5], [35, 25], (50, 2))


@pytest.mark.parametrize("form", ["samples", "field"])
def test_both_forms_find_strengths_between_the_samples(form):
    at, expected = strength_map(SAMPLES, form).predict(PLACES), TRUTH(PLACES)
    heard = expected > -80
    assert np.abs(at.mean_dbm - expected)[heard].mean() < 3.0
    assert at.detection[heard].mean() > 0.8
    assert at.mean_dbm.shape == at.sigma_db.shape == at.detection.shape == (50, 12)


@pytest.mark.parametrize("form", ["samples", "field"])
def test_both_forms_answer_for_chosen_access_points(form):
    strengths, columns = strength_map(SAMPLES, form), np.array([3, 1])
    for name in ("mean_dbm", "sigma_db", "detection"):
        all_of_them, chosen = (getattr(strengths.predict(PLACES, c), name) for c in (None, columns))
        np.testing.assert_allclose(chosen, all_of_them[:, columns])


def test_the_field_is_finer_than_the_samples():
    """The reason to learn one: its error between the samples is smaller."""
    errors = {}
    for name, form in (
        ("samples", AnnotatedSamples(SAMPLES.poses[:, :2], SAMPLES.rss_dbm)),
        ("field", build_field(SAMPLES.poses[:, :2], SAMPLES.sigma_m, SAMPLES.rss_dbm, FieldConfig())),
    ):
        expected = TRUTH(PLACES)
        errors[name] = np.abs(form.predict(PLACES).mean_dbm - expected)[expected > -80].mean()
    assert errors["field"] < errors["samples"]


def test_on_a_sample_of_many_equal_ones_it_tells_what_they_heard():
    xy = np.repeat([[0.0, 0.0], [50.0, 0.0]], 20, axis=0)
    rss = np.repeat([[-50.0, 0.0], [0.0, -70.0]], 20, axis=0)
    at = AnnotatedSamples(xy, sparse.csr_array(rss)).predict(np.array([[0.0, 0.0], [50.0, 0.0]]))
    np.testing.assert_allclose(np.diag(at.mean_dbm), [-50, -70])
    np.testing.assert_allclose(at.detection, [[0.99, 0.01], [0.01, 0.99]], atol=0.01)


def test_far_from_every_sample_nothing_is_heard_and_little_known():
    strengths = strength_map(SAMPLES, "samples")
    near, far = strengths.predict(PLACES[:1]), strengths.predict(np.array([[300.0, 300.0]]))
    assert np.all(far.detection < 0.05)
    assert np.all(far.sigma_db > near.sigma_db)


@given(st.integers(1, 12), st.integers(0, 99))
def test_any_map_gives_finite_answers(count, seed):
    rng = np.random.default_rng(seed)
    rss = np.where(rng.random((count, 3)) < 0.5, rng.uniform(-100, -30, (count, 3)), 0.0)
    rss[0, 0] = -60.0
    at = AnnotatedSamples(rng.uniform(0, 40, (count, 2)), sparse.csr_array(rss)).predict(rng.uniform(0, 40, (5, 2)))
    assert np.isfinite([at.mean_dbm, at.sigma_db, at.detection]).all()
    assert np.all((at.mean_dbm >= -100) & (at.mean_dbm <= -30))


def test_nothing_heard_is_one_clear_error():
    with pytest.raises(MappingError, match="found none"):
        AnnotatedSamples(np.zeros((3, 2)), sparse.csr_array((3, 2)))
