import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radioslam.config import UncertaintyConfig
from radioslam.errors import MappingError, ResultError
from radioslam.uncertainty import UncertaintyModel, learn_from_samples, learn_uncertainty, pairs_along_walks

from .builders import fingerprints_at

ANY = UncertaintyConfig(min_samples=1, min_sigma_m=1e-3)


def learn(samples, config=ANY):
    similarity, distance = np.array(samples, dtype=float).T
    return learn_from_samples(similarity, distance, config)


# var(s)


def test_the_variance_is_the_mean_square_of_the_samples_around():
    model = learn([(0.50, 3.0), (0.52, 4.0), (0.58, 1.0)])
    assert model.variance(np.array([0.50])) == pytest.approx((9 + 16) / 2)
    assert model.variance(np.array([0.54])) == pytest.approx((9 + 16 + 1) / 3)
    assert model.variance(np.array([0.60])) == pytest.approx(1)
    assert model.sample_count[[50, 54, 60]].tolist() == [2, 3, 1]


@pytest.mark.parametrize("s", [0.45, 0.55])
def test_samples_at_the_ends_of_the_interval_count(s):
    assert learn([(0.50, 2.0), (s, 4.0)]).variance(np.array([0.5])) == pytest.approx((4 + 16) / 2)


@pytest.mark.parametrize("s", [0.44, 0.56])
def test_samples_beyond_the_interval_do_not(s):
    assert learn([(0.50, 2.0), (s, 4.0)]).variance(np.array([0.5])) == pytest.approx(4)


hundredths = st.integers(0, 100).map(lambda k: k / 100)


@settings(deadline=None)
@given(
    st.lists(st.tuples(hundredths, st.floats(0.5, 30)), min_size=1, max_size=40), st.sampled_from([0.02, 0.1, 0.5, 2.0])
)
def test_the_table_equals_the_formula_sample_by_sample(samples, width):
    model = learn(samples, UncertaintyConfig(bin_width=width, min_samples=1, min_sigma_m=1e-3))
    for s, variance, count in zip(model.similarity, model.variance_m2, model.sample_count, strict=True):
        squares = [d * d for other, d in samples if abs(other - s) <= width / 2 + 1e-9]
        assert count == len(squares)
        if squares:
            assert variance == pytest.approx(np.mean(squares), rel=1e-9)


def test_empty_intervals_between_filled_ones_are_interpolated():
    model = learn([(0.2, 10.0), (0.6, 2.0)])
    # The last entry around 0.2 is 0.25, the first around 0.6 is 0.55; halfway stands the mean of 100 and 4.
    assert model.variance(np.array([0.40])) == pytest.approx(52)
    assert model.sample_count[40] == 0


def test_empty_intervals_at_the_ends_repeat_the_nearest_filled_one():
    model = learn([(0.4, 10.0), (0.6, 2.0)])
    np.testing.assert_allclose(model.variance(np.array([0.0, 0.2])), 100)
    np.testing.assert_allclose(model.variance(np.array([0.8, 1.0])), 4)


def test_intervals_with_too_few_samples_count_as_empty():
    model = learn([(0.2, 1.0)] * 5 + [(0.8, 9.0)] * 4, UncertaintyConfig(min_samples=5))
    np.testing.assert_allclose(model.variance_m2, 1.0)
    assert model.sample_count.sum() == 5 * 11


def test_no_variance_falls_below_the_smallest_allowed():
    model = learn([(0.5, 0.0)] * 9, UncertaintyConfig(min_sigma_m=0.5))
    np.testing.assert_allclose(model.variance_m2, 0.25)


@settings(deadline=None)
@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1e4)), min_size=5, max_size=30))
def test_variances_are_never_zero_or_infinite(samples):
    model = learn(samples, UncertaintyConfig(min_samples=1))
    queries = model.variance(np.linspace(-0.5, 1.5, 41))
    assert np.isfinite(queries).all()
    assert np.all(queries >= 0.25)


def test_sigma_is_the_root_of_the_variance():
    model = learn([(0.5, 3.0)])
    assert model.sigma(np.array([0.5])) == pytest.approx(3.0)


def test_too_few_samples_are_an_error_that_says_what_to_do():
    with pytest.raises(MappingError, match=r"expected at least 5 pairs .* found 2; record longer walks or lower"):
        learn([(0.5, 1.0)] * 2, UncertaintyConfig(min_samples=5))


def test_no_samples_at_all_are_the_same_error():
    with pytest.raises(MappingError, match="found 0"):
        learn_from_samples(np.zeros(0), np.zeros(0), ANY)


# Learning from walks


def test_samples_pair_similarity_with_the_distance_of_the_odometry():
    fingerprints = fingerprints_at([0, 5, 10], poses=[[0, 0, 0], [3, 4, 0], [0, 8, 0]], rss_dbm=[[-50], [-50], [-50]])
    model = learn_uncertainty(fingerprints, fingerprints.rss_dbm, ANY)
    assert model.variance(np.array([1.0])) == pytest.approx((25 + 25 + 64) / 3)


def test_scans_that_heard_nothing_are_no_samples():
    fingerprints = fingerprints_at([0, 5, 10], rss_dbm=[[-50], [-50], [0]])
    assert learn_uncertainty(fingerprints, fingerprints.rss_dbm, ANY).sample_count.max() == 1


def test_scans_with_nothing_in_common_are_samples_of_similarity_zero():
    fingerprints = fingerprints_at([0, 5], rss_dbm=[[-50, 0], [0, -50]])
    model = learn_uncertainty(fingerprints, fingerprints.rss_dbm, ANY)
    assert model.sample_count[0] == 1
    assert model.variance(np.array([0.0])) == pytest.approx(25)


half_metres = st.lists(st.lists(st.integers(0, 40).map(lambda k: k / 2), max_size=8), max_size=4)


@given(half_metres, st.sampled_from([0.5, 1.0, 5.0, 30.0]))
def test_pairs_along_walks_equal_the_double_loop(walks, limit):
    distance = [d for walk in walks for d in sorted(walk)]
    walk = [k for k, ds in enumerate(walks) for _ in ds]
    found = pairs_along_walks(fingerprints_at(distance, walk), limit)
    expected = [
        (i, j)
        for i in range(len(walk))
        for j in range(i + 1, len(walk))
        if walk[i] == walk[j] and distance[j] - distance[i] < limit
    ]
    assert list(zip(*(side.tolist() for side in found), strict=True)) == expected


# Files


def test_a_saved_model_is_loaded_as_it_was(tmp_path):
    model = learn([(0.2, 10.0), (0.6, 1 / 3)])
    model.save(tmp_path / "model.json")
    twin = UncertaintyModel.load(tmp_path / "model.json")
    for name in ("similarity", "variance_m2", "sample_count"):
        np.testing.assert_array_equal(getattr(twin, name), getattr(model, name))
    assert twin.sample_count.dtype == np.int64


GOOD = {"similarity": [0.0, 1.0], "variance_m2": [2.0, 1.0], "sample_count": [5, 5]}


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "not JSON",
        "[]",
        "3",
        "{}",
        json.dumps(GOOD | {"variance_m2": ["far", "near"]}),
        json.dumps(GOOD | {"variance_m2": [0.0, 1.0]}),
        json.dumps(GOOD | {"variance_m2": [-1.0, 1.0]}),
        json.dumps(GOOD | {"variance_m2": [float("inf"), 1.0]}),
        json.dumps(GOOD | {"variance_m2": [None, 1.0]}),
        json.dumps({k: v for k, v in GOOD.items() if k != "sample_count"}),
    ],
)
def test_a_file_that_is_no_model_is_an_error_that_names_it(tmp_path, content):
    (tmp_path / "model.json").write_text(content)
    with pytest.raises(ResultError, match=r"model\.json: expected"):
        UncertaintyModel.load(tmp_path / "model.json")


def test_a_missing_or_binary_file_is_the_same_error(tmp_path):
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00\x80")
    for name in ("binary", "missing"):
        with pytest.raises(ResultError, match=f"{name}: expected an uncertainty model"):
            UncertaintyModel.load(tmp_path / name)


@pytest.mark.parametrize(
    "change",
    [
        {"variance_m2": [2.0, 1.0, 1.0]},
        {"similarity": []},
        {"similarity": [1.0, 0.0]},
        {"similarity": [0.0, float("nan")]},
        {"similarity": [], "variance_m2": [], "sample_count": []},
        {"sample_count": [1]},
    ],
)
def test_columns_that_make_no_table_are_an_error(tmp_path, change):
    (tmp_path / "model.json").write_text(json.dumps(GOOD | change))
    with pytest.raises(ResultError, match=r"model\.json: expected"):
        UncertaintyModel.load(tmp_path / "model.json")
