"""SHOT: signatures of histograms of orientations (Tombari, Salti, Di Stefano, *Unique signatures of histograms for
local surface description*, ECCV 2010).

Each key point k gets a reference frame of its own from the points p within a radius R: the eigenvectors of

    M = Σ (R - |p - k|) (p - k)(p - k)ᵀ / Σ (R - |p - k|),

x with the largest and z with the smallest eigenvalue, each turned to the side where most of the points lie, y = z × x.
In that frame the ball is cut into 32 volumes (8 azimuths, 2 elevations, 2 shells), and in each stands a histogram of
cos θ = n · z of the points' normals with 11 bins. A point counts in the nearest volumes and bins by linear
interpolation in all four directions. The 352 values have Euclidean length one. What is measured in the point's own
frame does not change when the cloud moves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]

AZIMUTHS, ELEVATIONS, SHELLS, COSINES = 8, 2, 2, 11
LENGTH = AZIMUTHS * ELEVATIONS * SHELLS * COSINES
FEWEST_NEIGHBOURS = 10
"""A descriptor of fewer points would tell of their sampling, not of the surface."""
NEAREST_MEDIAN = 5
"""Where both sides hold equally many points, so many of those nearest to the median distance decide."""


def describe(points: Array, normals: Array, keys: Integers, radius_m: float) -> tuple[Array, Mask]:
    """Descriptors of key points.

    Args:
        points: (n, 3) metres.  normals: (n, 3) unit vectors.
        keys: (k,) indices of the key points.
        radius_m: of the ball that is described.

    Returns:
        (k, 352) descriptors of Euclidean length one, and the mask (k,) of key points with enough neighbours; the
        others' rows are zero.
    """
    key, near, distance = _neighbourhoods(points, keys, radius_m)
    offset = points[near] - points[keys[key]]
    frames = reference_frames(offset, distance, key, len(keys), radius_m)
    local = np.einsum("mij,mj->mi", frames[key], offset)
    cosine = np.einsum("mj,mj->m", normals[near], frames[key, 2])
    histograms = _histograms(local, distance / radius_m, cosine, key, len(keys))
    known = np.bincount(key, minlength=len(keys)) >= FEWEST_NEIGHBOURS
    histograms[~known] = 0.0
    norms = np.linalg.norm(histograms, axis=1, keepdims=True)
    return np.divide(histograms, norms, out=histograms, where=norms > 0), known


def _neighbourhoods(points: Array, keys: Integers, radius_m: float) -> tuple[Integers, Integers, Array]:
    """Pairs of key point number and point index, sorted by key point, with distance; not the point itself."""
    pairs = KDTree(points[keys]).sparse_distance_matrix(KDTree(points), radius_m, output_type="ndarray")
    pairs = pairs[(pairs["v"] > 1e-9)]
    pairs = pairs[np.lexsort((pairs["j"], pairs["i"]))]
    return pairs["i"].astype(np.int64), pairs["j"].astype(np.int64), np.asarray(pairs["v"])


def reference_frames(offset: Array, distance: Array, key: Integers, count: int, radius_m: float) -> Array:
    """Axes x, y, z as the rows of (count, 3, 3), from offsets (m, 3) of the neighbours of key points ``key`` (m,)."""
    weight = radius_m - distance
    total = np.bincount(key, weight, minlength=count)
    M = np.zeros((count, 3, 3))
    for a in range(3):
        for b in range(3):
            M[:, a, b] = np.bincount(key, weight * offset[:, a] * offset[:, b], minlength=count)
    _, vectors = np.linalg.eigh(M / np.maximum(total, 1e-12)[:, None, None])
    x = _towards_most(vectors[:, :, 2], offset, distance, key)
    z = _towards_most(vectors[:, :, 0], offset, distance, key)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _towards_most(axis: Array, offset: Array, distance: Array, key: Integers) -> Array:
    """Axes (k, 3) turned to the side where most neighbours lie."""
    ahead = np.where(np.einsum("mj,mj->m", axis[key], offset) >= 0, 1, -1)
    votes = np.bincount(key, ahead, minlength=len(axis))
    for k in np.flatnonzero(votes == 0):
        mine = np.flatnonzero(key == k)
        if len(mine):
            middle = np.argsort(np.abs(distance[mine] - np.median(distance[mine])), kind="stable")[:NEAREST_MEDIAN]
            votes[k] = ahead[mine[middle]].sum()
    return axis * np.where(votes >= 0, 1.0, -1.0)[:, None]


def _histograms(local: Array, share: Array, cosine: Array, key: Integers, count: int) -> Array:
    """(count, 352): each neighbour is spread over the two nearest bins in each of the four directions."""
    azimuth = np.arctan2(local[:, 1], local[:, 0])
    elevation = np.arcsin(np.clip(local[:, 2] / np.linalg.norm(local, axis=1), -1.0, 1.0))
    places = [
        _two_bins((azimuth / (2 * np.pi) + 0.5) * AZIMUTHS, AZIMUTHS, circular=True),
        _two_bins((elevation / np.pi + 0.5) * ELEVATIONS, ELEVATIONS),
        _two_bins(share * SHELLS, SHELLS),
        _two_bins((np.clip(cosine, -1.0, 1.0) + 1.0) / 2.0 * COSINES, COSINES),
    ]
    total = np.zeros(count * LENGTH)
    for corner in np.ndindex(2, 2, 2, 2):
        bins, weight = key, np.ones(len(key))
        for (low_high, weights), side, size in zip(
            places, corner, (AZIMUTHS, ELEVATIONS, SHELLS, COSINES), strict=True
        ):
            bins = bins * size + low_high[side]
            weight = weight * weights[side]
        total += np.bincount(bins, weight, minlength=len(total))
    return total.reshape(count, LENGTH)


def _two_bins(value: Array, size: int, circular: bool = False) -> tuple[tuple[Integers, Integers], tuple[Array, Array]]:
    """The bins whose middles enclose a value in [0, size], and how much of it each of them gets."""
    low = np.floor(value - 0.5).astype(np.int64)
    high_share = value - 0.5 - low
    if circular:
        return (low % size, (low + 1) % size), (1.0 - high_share, high_share)
    return (low.clip(0, size - 1), (low + 1).clip(0, size - 1)), (1.0 - high_share, high_share)
