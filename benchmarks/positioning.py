"""The field of 2,000 access points by 5,000 samples, and scans located in it, beside weighted nearest neighbours.

Simulated strengths (35 + 40 log10(distance) dB, 6 dB of noise, some 200 heard per scan) in a hall of 150 by 100 m,
seed 0; one thread, processor time.
"""

from __future__ import annotations

import time

import numpy as np
from scipy import sparse

from radioslam.config import FieldConfig
from radioslam.field import build_field
from radioslam.likelihood import Candidates
from radioslam.neighbours import Neighbours

SAMPLES, ACCESS_POINTS, SCANS = 5000, 2000, 300


def strengths(rng: np.random.Generator, positions_xy: np.ndarray, stations_xy: np.ndarray) -> sparse.csr_array:
    distance = np.hypot(*(positions_xy[:, None] - stations_xy[None]).transpose(2, 0, 1))
    rss = -35.0 - 40 * np.log10(np.maximum(distance, 1)) + rng.normal(0, 6, distance.shape)
    row, column = np.nonzero(rss >= -90)
    return sparse.csr_array((np.minimum(rss[row, column], -20), (row, column)), shape=rss.shape)


def run() -> None:
    """Print seconds to build, positions per second, and the ratio to nearest neighbours in the same run."""
    rng = np.random.default_rng(0)
    hall = np.array([150.0, 100.0])
    stations, places, asked = (rng.random((n, 2)) * hall for n in (ACCESS_POINTS, SAMPLES, SCANS))
    samples, scans = strengths(rng, places, stations), strengths(rng, asked, stations)
    started = time.process_time()
    field = build_field(places, np.full(SAMPLES, 1.0), samples, FieldConfig())
    candidates = Candidates.of(field, np.ones(ACCESS_POINTS), 3.0)
    built = time.process_time() - started
    print(
        f"field of {ACCESS_POINTS} access points by {SAMPLES} samples ({len(field.cells.count)} cells): {built:.1f} s"
    )
    neighbours, unknown = Neighbours.of(places, samples), np.zeros(1)
    started = time.process_time()
    for k in range(SCANS):
        neighbours.locate(neighbours.similarity(scans[k : k + 1], unknown), 5)
    reference = SCANS / (time.process_time() - started)
    started = time.process_time()
    for k in range(SCANS):
        candidates.moments(candidates.tempered(scans[k : k + 1], 1.0))
    ours = SCANS / (time.process_time() - started)
    print(f"one scan at a time: field {ours:.0f}/s, weighted kNN {reference:.0f}/s, ratio {ours / reference:.2f}")


if __name__ == "__main__":
    run()
