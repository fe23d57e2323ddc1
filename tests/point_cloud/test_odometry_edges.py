import numpy as np
import pytest

from radioslam import rigid
from radioslam.config import load_config
from radioslam.point_cloud.odometry_edges import LEAST_MOVED_M, joined_steps, odometry_covariance
from tests.point_cloud.scenes import random_motion

CONFIG = load_config(environment={}).reference


def test_raw_odometry_errs_with_the_root_of_the_distance():
    covariance = odometry_covariance(np.array([0.0, 4.0]), CONFIG)
    sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    assert sigma[1] == pytest.approx([2 * CONFIG.odometry_rotation_sigma_rad] * 3 + [0.2] * 3)
    assert sigma[0] == pytest.approx(sigma[1] * np.sqrt(LEAST_MOVED_M / 4.0))


def test_steps_joined_err_as_many_drawn_paths_do():
    rng = np.random.default_rng(0)
    T = np.array([random_motion(seed, 1.0) for seed in range(5)])
    factors = 0.01 * rng.standard_normal((5, 6, 6))
    steps = factors @ np.swapaxes(factors, 1, 2)
    z = rigid.inverse(T[:-1]) @ T[1:]
    drawn = np.tile(np.eye(4), (20_000, 1, 1))
    for k in (2, 3, 4):
        noise = np.einsum("ab,nb->na", factors[k], rng.standard_normal((len(drawn), 6)))
        drawn = drawn @ z[k - 1] @ rigid.from_vector(noise)
    errors = rigid.to_vector(rigid.inverse(rigid.inverse(T[1]) @ T[4]) @ drawn)
    expected = joined_steps(T, steps, 1, 4)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(np.cov(errors.T) / scale, expected / scale, atol=0.05)
