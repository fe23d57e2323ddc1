"""Where a walk was in a radio map, start unknown: at once while it lasts, or better once it is recorded.

A recorded walk is followed twice by the particle filter (``tracking``), from its begin on and from its end back: one
finds its way where the other has lost it. Both answers at every scan, Cauchy's loss on each, and the odometry between
scans then make a pose graph whose optimum is the path.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam.config import Config, OptimizerConfig
from radioslam.errors import PositioningError
from radioslam.factors import PlaceBlock, first_guess, graph_blocks
from radioslam.odometry import Track
from radioslam.optimizer import minimize
from radioslam.planar import between, wrap
from radioslam.pose_graph import Edges, PoseGraph, Priors, diagonal_information
from radioslam.positioning import FloorModel, Positioner
from radioslam.tracking import SCAN_CORRELATION, TURN_SIGMA_RAD, TrackedWalk, told_by, track_walk
from radioslam.walk import Walk

Array = NDArray[np.float64]

LEAST_SIGMA_M = 0.5
"""No answer of the filter is better than this, however narrow its particles."""
ANYWHERE_M = 1000.0


def follow(positioner: Positioner, walk: Walk, config: Config, seed: int) -> TrackedWalk:
    """Follow a recorded walk on the floor that its scans together name.

    Raises:
        PositioningError: no scan of the walk belongs to the map.
    """
    return follow_track(*_on_its_floor(positioner, walk, config), config, seed)


def follow_live(positioner: Positioner, walk: Walk, config: Config, seed: int) -> TrackedWalk:
    """The same for a walk that lasts: what is told of a scan has heard no later one."""
    at_once = config.positioning.model_copy(update={"lag_scans": 0})
    floor, track, scans = _on_its_floor(positioner, walk, config)
    return _with_common_error(floor, track_walk(floor, track, scans, at_once, np.random.default_rng(seed)))


def follow_track(
    floor: FloorModel, track: Track, scans_dbm: sparse.csr_array, config: Config, seed: int
) -> TrackedWalk:
    """Follow a recorded walk whose scans are the rows (n, m) of ``scans_dbm``, in the order of its scan times."""
    rng = np.random.default_rng(seed)
    there, back = (track_walk(floor, track, scans_dbm, config.positioning, rng, way) for way in (False, True))
    return _with_common_error(floor, _smoothed(track, there, back, config.optimizer))


def _with_common_error(floor: FloorModel, walked: TrackedWalk) -> TrackedWalk:
    """Scans of one place err together as the map does, and no filter averages that out."""
    return replace(walked, sigma_m=np.hypot(walked.sigma_m, floor.calibration.sigma_floor_m / 2**0.5))


def _on_its_floor(positioner: Positioner, walk: Walk, config: Config) -> tuple[FloorModel, Track, sparse.csr_array]:
    track, scans, unknown = told_by(positioner, walk, config)
    located = [location for location in positioner.locate_rows(scans, unknown) if location.here]
    if not located:
        raise PositioningError(f"{walk.name}: expected scans that belong to the map, found none; is it of this place?")
    labels, votes = np.unique([location.floor for location in located], return_counts=True)
    floor = next(model for model in positioner.floors if model.floor == labels[votes.argmax()])
    return floor, track, scans


def _smoothed(track: Track, there: TrackedWalk, back: TrackedWalk, config: OptimizerConfig) -> TrackedWalk:
    graph = _odometry_graph(track, there)
    nodes = np.arange(len(there.time_s))
    answers = []
    for one in (there, back):  # answers of successive scans repeat each other's errors, as the scans do
        sigma_m = np.sqrt((one.sigma_m**2 + LEAST_SIGMA_M**2) / SCAN_CORRELATION)
        answers.append(PlaceBlock(nodes, one.poses[:, :2], sigma_m, "cauchy", 1.0))
    solution = minimize([*graph_blocks(graph, config), *answers], first_guess(graph), config, variances=True)
    assert solution.inverse_diagonal is not None
    poses, variance = (values[: 3 * len(nodes)].reshape(-1, 3) for values in (solution.x, solution.inverse_diagonal))
    poses = np.column_stack([poses[:, :2], wrap(poses[:, 2])])
    return replace(there, poses=poses, sigma_m=np.sqrt(variance[:, :2].mean(axis=1)))


def _odometry_graph(track: Track, walked: TrackedWalk) -> PoseGraph:
    """A walk by its odometry alone, its compass known as the filter knows it."""
    odometry, n = track.at(walked.time_s), len(walked.time_s)
    translation_m, heading_rad = track.motion_sigmas(walked.time_s)
    i = np.arange(n - 1)
    information = diagonal_information(translation_m, translation_m, heading_rad)
    compass = np.append(walked.poses[0, :2], odometry[0, 2])[None]
    return PoseGraph(
        poses=walked.poses,
        odometry=Edges(i, i + 1, between(odometry[:-1], odometry[1:]), information),
        priors=Priors(np.zeros(1, np.int64), compass, diagonal_information(ANYWHERE_M, ANYWHERE_M, TURN_SIGMA_RAD)),
        walk=np.zeros(n, np.int64),
        log_scale_sigma=np.array([track.log_scale_sigma]),
    )
