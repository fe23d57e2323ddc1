"""A map condensed to places."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from radioslam.config import GrowingConfig
from radioslam.places import Samples, condense, similar_to
from radioslam.similarity import similar_pairs, unit_rows


def samples_at(positions, walk, sigma_m, strengths=None):
    n = len(walk)
    rows = sparse.csr_array(np.ones((n, 1)) if strengths is None else strengths)
    poses = np.column_stack([positions, np.zeros(n)])
    walk = np.asarray(walk, dtype=np.int64)
    return Samples(
        walk, np.arange(n), poses, np.zeros((n, 2)), np.asarray(sigma_m, float), np.zeros(n), unit_rows(rows)
    )


@settings(deadline=None)
@given(st.integers(0, 60), st.integers(1, 4), st.integers(0, 5))
def test_a_cell_keeps_its_best_known_scans_one_of_each_walk(count, per_cell, seed):
    rng = np.random.default_rng(seed)
    samples = samples_at(rng.uniform(-4, 4, (count, 2)), rng.integers(0, 6, count), rng.permutation(count) + 1)
    kept = condense(samples, GrowingConfig(cell_m=2.0, per_cell=per_cell))
    cells = np.floor(samples.poses[:, :2] / 2.0)
    expected = set()
    for cell in np.unique(cells, axis=0):
        best = {}
        for k in sorted(np.flatnonzero((cells == cell).all(axis=1)), key=lambda k: samples.sigma_m[k]):
            best.setdefault(samples.walk[k], k)
        expected |= set(sorted(best.values(), key=lambda k: samples.sigma_m[k])[:per_cell])
    assert set(kept.scan.tolist()) == {int(k) for k in expected}


def test_condensing_again_changes_nothing_and_later_scans_that_are_less_sure_do_not_enter():
    rng = np.random.default_rng(0)
    config = GrowingConfig(cell_m=2.0, per_cell=3)
    first = condense(samples_at(rng.uniform(0, 6, (300, 2)), rng.integers(0, 40, 300), rng.uniform(1, 2, 300)), config)
    np.testing.assert_array_equal(condense(first, config).scan, first.scan)
    late = samples_at(rng.uniform(0, 6, (50, 2)), np.full(50, 99), np.full(50, 3.0))
    assert 99 not in condense(Samples.concatenate([first, late]), config).walk


def test_places_and_scans_are_as_similar_as_in_the_join():
    rng = np.random.default_rng(1)
    strengths = rng.uniform(0, 1, (30, 12)) * (rng.random((30, 12)) < 0.5)
    every = unit_rows(sparse.csr_array(strengths))
    places = samples_at(np.zeros((20, 2)), np.zeros(20), np.ones(20), strengths[:20])
    found = similar_to(places, every[20:], 0.3)
    pairs = similar_pairs(sparse.csr_array(strengths), 0.3)
    across = pairs.select((pairs.i < 20) & (pairs.j >= 20))
    assert {*zip(found.i.tolist(), (found.j + 20).tolist(), strict=True)} == {
        *zip(across.i.tolist(), across.j.tolist(), strict=True)
    }
    np.testing.assert_allclose(np.sort(found.similarity), np.sort(across.similarity))


def test_scans_may_know_access_points_that_the_places_do_not():
    places = samples_at(np.zeros((2, 2)), [0, 1], [1, 1], np.eye(2))
    assert similar_to(places, sparse.csr_array(np.eye(5)[[1, 4]]), 0.5).i.tolist() == [1]
