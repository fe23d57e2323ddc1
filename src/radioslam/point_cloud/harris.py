"""Harris 3D key points: places where the surface turns in more than one direction.

Harris' detector carried from images to surfaces (Sipiran and Bustos, *Harris 3D: a robust extension of the Harris
operator for interest point detection on 3D meshes*, 2011), in the variant on normals known from the Point Cloud
Library: with the mean C = 1/n Σ n nᵀ of the unit normals within a radius,

    response = det C - κ (trace C)²

which is -κ on planes, the same along edges (two directions, det C = 0), and largest, 1/27 - κ, where all three
directions are equally present. Key points are the points whose response nothing nearby surpasses.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

KAPPA = 0.04


def responses(normals: Array, i: Integers, j: Integers) -> Array:
    """Response (n,) of every point, from unit normals (n, 3) and the pairs (i, j) of neighbours, both ways round."""
    n = len(normals)
    count = 1.0 + np.bincount(i, minlength=n)
    C = np.empty((n, 3, 3))
    for a in range(3):
        for b in range(a, 3):
            product = normals[:, a] * normals[:, b]
            C[:, a, b] = C[:, b, a] = (product + np.bincount(i, product[j], minlength=n)) / count
    response: Array = np.linalg.det(C) - KAPPA * np.trace(C, axis1=1, axis2=2) ** 2
    return response


def find_key_points(
    points: Array, normals: Array, radius_m: float, separation_m: float, least: float, most: int
) -> Integers:
    """Indices (k,) of key points, strongest first.

    Args:
        points: (n, 3) metres.  normals: (n, 3) of length one.
        radius_m: of the neighbourhood whose normals are compared.
        separation_m: a key point has the largest response within this distance.
        least: responses that are not more than this above that of a plane are passed over.
        most: how many key points at most.
    """
    pairs = KDTree(points).query_pairs(max(radius_m, separation_m), output_type="ndarray").astype(np.int64)
    i, j = np.concatenate([pairs, pairs[:, ::-1]]).T
    distance = np.linalg.norm(points[i] - points[j], axis=1)
    near = distance <= radius_m
    response = responses(normals, i[near], j[near])
    beside = distance <= separation_m
    # Of two equal responses the one that comes first stands, so that a plateau has one key point and not none.
    lower = (response[i] < response[j]) | ((response[i] == response[j]) & (i > j))
    strong = response > least - KAPPA
    strong[i[beside & lower]] = False
    found = np.flatnonzero(strong)
    return found[np.argsort(-response[found], kind="stable")][:most]
