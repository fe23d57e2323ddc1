import numpy as np
import pytest
from scipy import sparse

from radioslam.config import PlacementConfig
from radioslam.repulsion import ApartBlock, Dissimilar, LeastDistance, find_dissimilar, learn_least_distance
from radioslam.rigid_walks import RigidWalks

from .builders import fingerprints_at, numeric_jacobian
from .test_rigid_walks import as_dense

FLAT = LeastDistance(np.array([0.0, 1.0]), np.array([6.0, 6.0]))
SLOPED = LeastDistance(np.array([0.0, 1.0]), np.array([8.0, 0.0]))


def fading_walk(n=200, step_m=0.5, access_points=60):
    """A straight walk past access points whose strength falls with distance: (fingerprints, strengths)."""
    along = step_m * np.arange(n)
    masts = np.linspace(0, along[-1], access_points)
    strengths = sparse.csr_array(np.exp(-((along[:, None] - masts) ** 2) / 50))
    return fingerprints_at(along, rss_dbm=strengths.toarray()), strengths


def test_the_less_alike_the_farther_apart():
    least = learn_least_distance(*fading_walk(), PlacementConfig(apart_limit_m=100))
    assert np.all(np.diff(least.distance_m) <= 0)
    assert least.at(np.array([0.99])) < 3
    assert least.at(np.array([0.3])) > 6


def test_least_distances_are_cut():
    assert learn_least_distance(*fading_walk(), PlacementConfig(apart_limit_m=4)).distance_m.max() == 4


def test_without_samples_nothing_is_kept_apart():
    fingerprints = fingerprints_at([0.0, 1.0])
    least = learn_least_distance(fingerprints, fingerprints.rss_dbm, PlacementConfig())
    assert least.distance_m.max() == 0


def dissimilar(positions, walk, strengths, **config):
    positions, strengths = np.asarray(positions, dtype=float), sparse.csr_array(np.asarray(strengths, dtype=float))
    return find_dissimilar(np.asarray(walk), positions, strengths, SLOPED, PlacementConfig(**config))


def test_pairs_of_different_walks_that_hear_different_things_too_near_each_other_are_found():
    pairs = dissimilar([[0, 0], [1, 0], [2, 0], [50, 0]], [0, 1, 0, 1], [[1, 0], [0, 1], [0, 1], [1, 1]])
    np.testing.assert_array_equal(np.column_stack([pairs.i, pairs.j]), [[0, 1]])
    np.testing.assert_allclose(pairs.least_m, 8)


def test_a_crowded_place_says_no_more_than_a_lonely_one():
    rng = np.random.default_rng(0)
    few, many = (dissimilar(rng.uniform(0, 3, (n, 2)), np.arange(n), np.eye(n)) for n in (5, 50))
    total_few, total_many = np.sum(few.sigma_m**-2.0), np.sum(many.sigma_m**-2.0)
    assert total_many / total_few == pytest.approx(10, rel=0.05)  # as the scans, where the pairs grow by 122


def test_the_weight_is_that_of_the_configuration_for_two_scans_alone():
    pairs = dissimilar([[0, 0], [1, 0]], [0, 1], np.eye(2), apart_weight=4, apart_sigma_m=5)
    np.testing.assert_allclose(pairs.sigma_m, 2.5)


@pytest.fixture
def rigid():
    walk = np.array([0, 0, 1, 1])
    return RigidWalks.of(walk, np.array([[0, 0], [4, 1], [0, 2], [5, 5]], dtype=float), np.eye(4, 2), 2)


def apart(rigid, least=6.0):
    i, j = np.array([0, 1, 0]), np.array([2, 3, 3])
    return ApartBlock(rigid, Dissimilar(i, j, np.full(3, least), np.array([1.0, 2.0, 3.0])))


def test_jacobians_agree_with_differences(rigid):
    x = np.random.default_rng(3).normal(0, 0.5, rigid.size)
    block = apart(rigid)
    residuals, jacobian = block.linearize(x)
    assert np.all(residuals > 0)
    np.testing.assert_allclose(as_dense(block, jacobian, len(x)), numeric_jacobian(block.residuals, x), atol=1e-6)


def test_pairs_far_enough_apart_push_nothing(rigid):
    x = np.zeros(rigid.size)
    x[4:6] = 100.0
    residuals, jacobian = apart(rigid).linearize(x)
    assert not residuals.any()
    assert not jacobian.any()


def test_scans_at_one_place_push_without_a_direction_but_with_numbers(rigid):
    x = np.zeros(rigid.size)
    x[4:6] = rigid.points[0] - rigid.points[2]
    residuals, jacobian = apart(rigid).linearize(x)
    assert residuals[0] == pytest.approx(6.0)
    assert np.isfinite(jacobian).all()
