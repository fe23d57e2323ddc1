import numpy as np
import pytest

from radioslam.simulator.shadowing import shadow_fields


def measured_correlation(fields, lag_m, rng):
    points = rng.uniform(0, 200, (300, 2))
    angle = rng.uniform(0, 2 * np.pi, 300)
    moved = points + lag_m * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    every = np.ones((300, len(fields.phase)), dtype=bool)
    a, b = fields.at(points, every), fields.at(moved, every)
    return np.mean(a * b) / np.sqrt(np.mean(a**2) * np.mean(b**2))


def test_correlation_falls_exponentially_with_distance():
    rng = np.random.default_rng(0)
    fields = shadow_fields(np.arange(400), 5.0, 0.0, rng)
    for lag_m in (1.0, 2.5, 5.0, 10.0, 20.0):
        assert measured_correlation(fields, lag_m, rng) == pytest.approx(np.exp(-lag_m / 5.0), abs=0.03)


def test_fields_have_unit_variance_and_no_mean():
    rng = np.random.default_rng(1)
    values = shadow_fields(np.arange(500), 5.0, 0.0, rng).at(rng.uniform(0, 500, (50, 2)), np.ones((50, 500), bool))
    assert values.mean() == pytest.approx(0.0, abs=0.03)
    assert values.std() == pytest.approx(1.0, abs=0.03)


def test_radios_of_one_site_share_their_shadow():
    rng = np.random.default_rng(2)
    group = np.repeat(np.arange(300), 2)
    values = shadow_fields(group, 5.0, 0.5, rng).at(rng.uniform(0, 100, (40, 2)), np.ones((40, 600), bool))
    first, second = values[:, ::2], values[:, 1::2]
    assert np.mean(first * second) == pytest.approx(0.5, abs=0.05)
    assert np.mean(first[:, 1:] * second[:, :-1]) == pytest.approx(0.0, abs=0.05)


def test_values_are_computed_only_where_asked_for():
    rng = np.random.default_rng(3)
    fields = shadow_fields(np.arange(3), 5.0, 0.0, rng)
    mask = np.array([[True, False, True], [False, False, True]])
    values = fields.at(np.zeros((2, 2)), mask)
    assert (values[~mask] == 0).all()
    assert (values[mask] != 0).all()
