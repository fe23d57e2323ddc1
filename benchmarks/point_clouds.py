"""Registration of real 640 × 480 depth frames beside ICP alone, the named reference, in the same run.

The pairs are those that truly overlap by more than half. *Registered* counts matching, RANSAC, ICP and the verdict from
no guess, with key points and descriptors made once per frame before (their own row). *ICP alone* is small_gicp's GICP
over all points from the true motion, clouds and trees prepared before: what nobody has who does not know the answer.
Seconds are of the processor, for one thread.
"""

from __future__ import annotations

import time
from itertools import combinations

import numpy as np

from benchmarks.reference import frames_folder, overlap
from radioslam import rigid
from radioslam.config import load_config
from radioslam.point_cloud import find_recordings
from radioslam.point_cloud.clouds import read_cloud
from radioslam.point_cloud.registration import make_features, register
from radioslam.point_cloud.surface import refine

MOST_PAIRS = 60


def run() -> None:
    """Print frames and pairs per second, and the ratio."""
    if not frames_folder().is_dir():
        print(f"point clouds: no frames in {frames_folder()}; set RADIOSLAM_DATA to the folder of recordings")
        return
    (recording,) = find_recordings([frames_folder()])
    config, T = load_config().registration, recording.T_odom_body
    clouds = [read_cloud(path) for path in recording.clouds]
    make_features(clouds[0], config)  # warm
    started = time.process_time()
    features = [make_features(points, config) for points in clouds]
    describing_s = (time.process_time() - started) / len(clouds)
    pairs = [(a, b, rigid.inverse(T[a]) @ T[b]) for a, b in combinations(range(len(clouds)), 2)]
    pairs = [pair for pair in pairs if overlap(features[pair[0]], features[pair[1]], pair[2]) > 0.5]
    pairs = [pairs[k] for k in np.linspace(0, len(pairs) - 1, MOST_PAIRS).astype(int)]
    seconds = {"registered": 0.0, "ICP alone": 0.0}
    accepted = 0
    for a, b, truth in pairs:
        refine(features[a].surface, features[b].surface, truth, config.icp_reach_m, 10**9, 1)  # prepares both
        started = time.process_time()
        accepted += register(features[a], features[b], config).accepted
        seconds["registered"] += (time.process_time() - started) / len(pairs)
        started = time.process_time()
        refine(features[a].surface, features[b].surface, truth, config.icp_reach_m, 10**9, config.icp_iterations)
        seconds["ICP alone"] += (time.process_time() - started) / len(pairs)
    print(f"point clouds: {len(pairs)} pairs of {len(clouds)} frames, {accepted} accepted")
    print(f"{'describing a frame':20} {describing_s * 1e3:8.1f} ms {1 / describing_s:8.1f} per s")
    for name, each_s in seconds.items():
        print(f"{name:20} {each_s * 1e3:8.1f} ms {1 / each_s:8.1f} per s")
    print(f"{'ratio to ICP alone':20} {seconds['ICP alone'] / seconds['registered']:8.2f}")
    whole_s = seconds["registered"] + describing_s
    print(f"{'describe + register':20} {whole_s * 1e3:8.1f} ms {1 / whole_s:8.1f} per s, one new frame per pair")


if __name__ == "__main__":
    run()
