from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from radioslam.selected_inverse import inverse_diagonal


@st.composite
def positive_definite(draw):
    """Random sparse symmetric positive definite matrices (n, n)."""
    n, seed, density = draw(st.integers(1, 25)), draw(st.integers(0, 2**32 - 1)), draw(st.floats(0, 0.4))
    rng = np.random.default_rng(seed)
    root = sparse.random_array((n, n), density=density, rng=rng, data_sampler=rng.standard_normal).toarray()
    return root @ root.T + np.diag(rng.uniform(0.5, 2, n))


@settings(deadline=None)
@given(positive_definite())
def test_the_diagonal_of_the_inverse_equals_that_of_the_dense_inverse(matrix):
    cholesky = np.linalg.cholesky(matrix)
    root = np.diag(cholesky)
    lower = sparse.csc_array(np.tril(cholesky / root, -1))
    np.testing.assert_allclose(inverse_diagonal(lower, root**2), np.diag(np.linalg.inv(matrix)), rtol=1e-9)


def test_a_diagonal_matrix_has_no_fronts():
    np.testing.assert_array_equal(inverse_diagonal(sparse.csc_array((3, 3)), np.array([1.0, 2.0, 4.0])), [1, 0.5, 0.25])


def test_separate_blocks_do_not_touch_each_other():
    one = np.array([[4.0, 1.0], [1.0, 3.0]])
    matrix = np.kron(np.eye(2), one)
    cholesky = np.linalg.cholesky(matrix)
    root = np.diag(cholesky)
    found = inverse_diagonal(sparse.csc_array(np.tril(cholesky / root, -1)), root**2)
    np.testing.assert_allclose(found, np.tile(np.diag(np.linalg.inv(one)), 2))
