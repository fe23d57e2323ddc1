"""Where might walks stand? Linear least squares on their offsets alone, robust by annealed weights.

    min Σ_loops w_l ‖(q_j + o_b) - (q_i + o_a)‖² / σ_l²,     w_l = 1 / (1 + (e_l / c)²)

with points q in the walks' own frames (turned by their compasses), offsets o, and c falling from 6 to 1 standard
deviations, so that at first every loop counts and at last those that the others contradict hardly do.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import spsolve

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

ROUNDS = 30
SCALES = (6.0, 1.0)
RIDGE = 1e-6
"""Holds what no loop ties, 1/m²."""


def first_offsets(
    walk: Integers,
    positions_xy: Array,
    i: Integers,
    j: Integers,
    sigma_m: Array,
    walks: int,
    sure: NDArray[np.bool_] | None = None,
) -> Array:
    """Offsets (w, 2) that bring the points i and j (m,) of each loop together; points (n, 2) of walks (n,).

    Loops that are ``sure`` (m,) keep their weight whatever the others say.
    """
    a, b, measured = walk[i], walk[j], positions_xy[i] - positions_xy[j]
    weight = np.ones(len(i))
    offsets = np.zeros((walks, 2))
    for scale in np.geomspace(*SCALES, ROUNDS):
        offsets = _weighted_offsets(a, b, measured, weight / sigma_m**2, walks)
        error = np.hypot(*(offsets[b] - offsets[a] - measured).T) / sigma_m
        weight = 1.0 / (1.0 + (error / scale) ** 2)
        if sure is not None:
            weight[sure] = 1.0
    return offsets


def _weighted_offsets(a: Integers, b: Integers, measured: Array, weight: Array, walks: int) -> Array:
    rows, columns = np.concatenate([a, b, a, b]), np.concatenate([a, b, b, a])
    values = np.concatenate([weight, weight, -weight, -weight])
    laplacian = sparse.coo_array((values, (rows, columns)), shape=(walks, walks)) + RIDGE * sparse.eye_array(walks)
    pull = [np.bincount(b, weight * m, walks) - np.bincount(a, weight * m, walks) for m in measured.T]
    return np.asarray(spsolve(sparse.csc_array(laplacian), np.column_stack(pull))).reshape(walks, 2)
