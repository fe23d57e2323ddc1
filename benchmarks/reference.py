"""Reference paths from real depth frames: every pair registered from no guess, and SLAM under simulated drift."""

from __future__ import annotations

import os
from dataclasses import replace
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from radioslam import rigid
from radioslam.config import load_config
from radioslam.point_cloud import Recording, find_recordings, make_reference
from radioslam.point_cloud.clouds import read_cloud
from radioslam.point_cloud.registration import Features, Registration, make_features, register
from radioslam.point_cloud.surface import nearest

Array = NDArray[np.float64]

REPOSITORY = Path(__file__).resolve().parent.parent
OVERLAP_M = 0.05
RIGHT_M, RIGHT_RAD = 0.05, np.deg2rad(3.0)
BINS = (0.0, 0.1, 0.3, 0.5, 0.6, 0.7, 0.8, 1.0)
DRIFT_M, DRIFT_DEG = 0.10, 5.0
SEEDS = range(3)


def frames_folder() -> Path:
    return Path(os.environ.get("RADIOSLAM_DATA", REPOSITORY.parent / "shared" / "data")) / "depth-frames"


def overlap(target: Features, source: Features, T: Array) -> float:
    """The lesser of the two clouds' parts with a point of the other within ``OVERLAP_M`` in truth."""
    there = nearest(target.surface, rigid.transform(T, source.surface.points))[1]
    back = nearest(source.surface, rigid.transform(rigid.inverse(T), target.surface.points))[1]
    return min(float((d <= OVERLAP_M).mean()) for d in (there, back))


def registered_pairs(recording: Recording) -> tuple[list[float], list[Registration], Array]:
    """Overlap of every pair of frames, what registration found, and its error (m, rad) as (n, 2)."""
    config = load_config().registration
    features = [make_features(read_cloud(path), config) for path in recording.clouds]
    pairs = list(combinations(range(len(features)), 2))
    truth = [rigid.inverse(recording.T_odom_body[a]) @ recording.T_odom_body[b] for a, b in pairs]
    overlaps = [overlap(features[a], features[b], T) for (a, b), T in zip(pairs, truth, strict=True)]
    found = [register(features[a], features[b], config) for a, b in pairs]
    errors = [rigid.apart(f.T_target_source, T) for f, T in zip(found, truth, strict=True)]
    return overlaps, found, np.array(errors)


def precision_and_recall(overlaps: list[float], found: list[Registration], errors: Array) -> str:
    """Markdown: a row per bin of overlap."""
    accepted = np.array([one.accepted for one in found])
    right = (errors[:, 0] <= RIGHT_M) & (errors[:, 1] <= RIGHT_RAD)
    far = (errors[:, 0] > 4 * RIGHT_M) | (errors[:, 1] > 4 * RIGHT_RAD)
    lines = [
        "| overlap | pairs | right | accepted | accepted right | accepted, up to 20 cm, 12° off | accepted, farther "
        "| precision | recall |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    rows = [*pairwise(BINS), (0.5, 1.0), (0.0, 1.0)]
    for low, high in rows:
        here = (np.array(overlaps) >= low) & (np.array(overlaps) < high + (high == 1.0))
        good, taken = int((here & accepted & right).sum()), int((here & accepted).sum())
        wrong = int((here & accepted & far).sum())
        shares = [f"{good / taken:.3f}" if taken else "–", f"{good / here.sum():.3f}"]
        cells = [f"{low:.1f}–{high:.1f}", here.sum(), (here & right).sum(), taken, good, taken - good - wrong, wrong]
        lines.append("| " + " | ".join(str(cell) for cell in [*cells, *shares]) + " |")
    return "\n".join(lines)


def drifted(recording: Recording, seed: int, steady: bool) -> Recording:
    """The recording with odometry that drifts by 10 cm and 5° per metre of camera path, in random directions.

    ``steady``: always in the same direction of the body, so that errors add up; else anew from frame to frame, as a
    random walk that has this standard deviation after one metre.
    """
    rng = np.random.default_rng(seed)
    steps = rigid.inverse(recording.T_odom_body[:-1]) @ recording.T_odom_body[1:]
    length = np.linalg.norm(steps[:, :3, 3], axis=1)
    amount = length if steady else np.sqrt(length)
    directions = rng.standard_normal((2, 1 if steady else len(steps), 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    noise = directions * amount[:, None]
    turn = Rotation.from_rotvec(noise[1] * np.deg2rad(DRIFT_DEG)).as_matrix()
    steps = steps @ rigid.motion(turn, noise[0] * DRIFT_M)
    poses = [recording.T_odom_body[0]]
    for step in steps:
        poses.append(poses[-1] @ step)
    return replace(recording, T_odom_body=np.array(poses))


def absolute_error(estimate: Array, truth: Array) -> float:
    """Mean distance (m) of camera positions after the best rigid alignment."""
    T = rigid.fit(estimate[:, :3, 3], truth[:, :3, 3])
    return float(np.linalg.norm(rigid.transform(T, estimate[:, :3, 3]) - truth[:, :3, 3], axis=1).mean())


def anchored_error(estimate: Array, truth: Array) -> float:
    """Mean distance (m) of camera positions with the first pose given."""
    moved = truth[0] @ rigid.inverse(estimate[0]) @ estimate
    return float(np.linalg.norm(moved[:, :3, 3] - truth[:, :3, 3], axis=1).mean())


def slam_under_drift(recording: Recording) -> str:
    """Markdown: a row per kind of drift and seed.

    Errors are given twice against the frames' poses (first pose given; best rigid alignment) and once against what SLAM
    finds from odometry without any drift: how much of the drift itself is left.
    """
    without = make_reference([recording], load_config()).paths[0]
    truth = recording.T_odom_body
    measures = [(anchored_error, truth), (absolute_error, truth), (absolute_error, without)]
    lines = [
        "| drift | seed | first pose given, m | after SLAM | aligned, m | after SLAM | to SLAM without drift, m "
        "| after SLAM | accepted of tried |",
        "|---|---|---|---|---|---|---|---|---|",
        f"| none | – | 0.000 | {anchored_error(without, truth):.3f} | 0.000 | {absolute_error(without, truth):.3f} "
        "| – | – | – |",
    ]
    for steady in (False, True):
        for seed in SEEDS:
            start = drifted(recording, seed, steady)
            result = make_reference([start], load_config())
            pairs = [(f(start.T_odom_body, to), f(result.paths[0], to)) for f, to in measures]
            cells = [f"{before:.3f} | {after:.3f}" for before, after in pairs]
            accepted = sum(attempt.reason == "accepted" for attempt in result.attempts)
            kind = "steady" if steady else "random walk"
            lines.append(f"| {kind} | {seed} | {' | '.join(cells)} | {accepted} of {len(result.attempts)} |")
    return "\n".join(lines)


def run() -> None:
    """Print both tables."""
    if not frames_folder().is_dir():
        print(f"reference: no frames in {frames_folder()}; set RADIOSLAM_DATA to the folder of recordings")
        return
    (recording,) = find_recordings([frames_folder()])
    length = np.linalg.norm(np.diff(recording.T_odom_body[:, :3, 3], axis=0), axis=1).sum()
    print(f"{len(recording.clouds)} frames over {length:.1f} m of camera path")
    print(slam_under_drift(recording), flush=True)
    print(precision_and_recall(*registered_pairs(recording)))


if __name__ == "__main__":
    run()
