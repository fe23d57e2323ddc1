"""Many tracks -> one frame and one numbering (section III-E).

Nodes of the pose graph are the scans of each walk and, where it is known, its start. Each walk gets a first place in
the frame of the map by what is known of its start; headings are those of the device (compass).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam import planar
from radioslam.config import MergingConfig
from radioslam.errors import MappingError
from radioslam.fingerprints import Fingerprints
from radioslam.odometry import Track
from radioslam.pose_graph import Edges, Priors, diagonal_information
from radioslam.similarity import pair_similarity
from radioslam.uncertainty import UncertaintyModel

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

VELOCITY_S = 1.5
ANCHOR_SIGMA = 0.01
"""Metres and radians; holds the first pose of a frame that nothing else ties to the building."""


@dataclass(frozen=True)
class MergedTracks:
    """All walks in one numbering, each placed in a frame that it may share with others.

    Attributes:
        tracks: the walks' tracks.
        walk: (n,) track of each node.  time_s: (n,).  poses: (n, 3) first estimate.
        fingerprint: (n,) the node's fingerprint, or -1 for a start between scans.
        frame: (n_walks,) walks of equal number share a frame from the start.
        links: edges between common starts.  priors: known starts, and an anchor for each frame without one.
    """

    tracks: tuple[Track, ...]
    walk: Integers
    time_s: Array
    poses: Array
    fingerprint: Integers
    frame: Integers
    links: Edges
    priors: Priors

    @property
    def node_of_fingerprint(self) -> Integers:
        """(n_fingerprints,) the node of each fingerprint."""
        return np.flatnonzero(self.fingerprint >= 0)

    def velocities(self) -> Array:
        """(n, 2) m/s of each node in the frame of the map: its odometry's, over ``VELOCITY_S`` to either side."""
        velocity = np.empty((len(self.poses), 2))
        for k, track in enumerate(self.tracks):
            here = self.walk == k
            time_s = self.time_s[here]
            before, now, after = (track.at(time_s + shift) for shift in (-VELOCITY_S, 0.0, VELOCITY_S))
            moved = (after[:, :2] - before[:, :2]) / (2 * VELOCITY_S)
            velocity[here] = planar.rotate(self.poses[here, 2] - now[:, 2], moved)
        return velocity

    def at(self, x: Array) -> MergedTracks:
        """The same tracks with the poses that an optimizer's unknowns begin with."""
        return replace(self, poses=x[: self.poses.size].reshape(-1, 3))

    @property
    def names(self) -> tuple[str, ...]:
        """The walks' names."""
        return tuple(track.walk.name for track in self.tracks)


def merge_tracks(
    tracks: Sequence[Track],
    fingerprints: Fingerprints,
    strengths: sparse.csr_array,
    uncertainty: UncertaintyModel,
    config: MergingConfig,
) -> MergedTracks:
    """Place all tracks by ``config.starts``.

    ``common``: all walks begin at one place, which becomes (0, 0).  ``known``: each walk begins where its first
    reference position says; a walk without one gets a frame of its own.

    Raises:
        MappingError: ``known`` without any reference, or ``unknown``, which this version cannot do.
    """
    if config.starts == "unknown":
        raise MappingError("unknown starts are not available yet; expected --starts common or known")
    if config.starts == "common":
        return _merge_common(tracks, fingerprints, strengths, uncertainty, config)
    return _merge_known(tracks, fingerprints, config)


def _merge_common(
    tracks: Sequence[Track],
    fingerprints: Fingerprints,
    strengths: sparse.csr_array,
    uncertainty: UncertaintyModel,
    config: MergingConfig,
) -> MergedTracks:
    """Link the first node of each walk to that of the first: Δx = Δy = 0, Δθ by the compass.

    The variance of x and y is that of the first scans' similarity; the variance of θ is 1000 in the paper.
    """
    first = np.searchsorted(fingerprints.walk, np.arange(len(tracks)))
    offset = -fingerprints.poses[first, :2]
    poses = fingerprints.poses.copy()
    poses[:, :2] += offset[fingerprints.walk]
    hub, others = np.repeat(first[:1], len(first) - 1), first[1:]
    sigma = uncertainty.sigma(pair_similarity(strengths, hub, others))
    turn = np.column_stack([np.zeros((len(others), 2)), planar.wrap(poses[others, 2] - poses[hub, 2])])
    information = diagonal_information(sigma, sigma, np.full(len(others), config.heading_variance**0.5))
    return MergedTracks(
        tracks=tuple(tracks),
        walk=fingerprints.walk,
        time_s=fingerprints.time_s,
        poses=poses,
        fingerprint=np.arange(len(fingerprints)),
        frame=np.zeros(len(tracks), np.int64),
        links=Edges(hub, others, turn, information),
        priors=_anchors(first[:1], poses),
    )


def _merge_known(tracks: Sequence[Track], fingerprints: Fingerprints, config: MergingConfig) -> MergedTracks:
    """Begin each walk at its first reference position and insert the node that this prior holds."""
    known = np.array([track.walk.reference is not None for track in tracks])
    if not known.any():
        raise MappingError("expected a reference position in at least one walk, found none; use --starts common")
    starts = [_start(track) for track in tracks]
    start_s, start_poses, offset = (np.array(column) for column in zip(*starts, strict=True))
    walk = np.concatenate([fingerprints.walk, np.flatnonzero(known)])
    time_s = np.concatenate([fingerprints.time_s, start_s[known]])
    poses = np.concatenate([fingerprints.poses, start_poses[known]])
    fingerprint = np.concatenate([np.arange(len(fingerprints)), np.full(known.sum(), -1)])
    order = np.lexsort((-fingerprint, time_s, walk))
    walk, time_s, poses, fingerprint = walk[order], time_s[order], poses[order], fingerprint[order]
    poses[:, :2] += offset[walk]
    started = np.flatnonzero(fingerprint < 0)
    loose = np.searchsorted(walk, np.flatnonzero(~known))
    spread = diagonal_information(config.start_sigma_m, config.start_sigma_m, config.heading_sigma_rad)
    held = Priors(started, poses[started], np.repeat(spread, len(started), axis=0))
    return MergedTracks(
        tracks=tuple(tracks),
        walk=walk,
        time_s=time_s,
        poses=poses,
        fingerprint=fingerprint,
        frame=np.where(known, 0, 1 + np.arange(len(tracks))),
        links=Edges.none(),
        priors=Priors.concatenate([held, _anchors(loose, poses)]),
    )


def _start(track: Track) -> tuple[float, Array, Array]:
    """Time, odometry pose (3,), and what brings the track there (2,), of the known start; zeros without one."""
    reference = track.walk.reference
    if reference is None:
        return 0.0, np.zeros(3), np.zeros(2)
    pose = track.at(reference.time_s[:1])[0]
    return float(reference.time_s[0]), pose, reference.positions_xy[0] - pose[:2]


def _anchors(nodes: Integers, poses: Array) -> Priors:
    stiff = diagonal_information(ANCHOR_SIGMA, ANCHOR_SIGMA, ANCHOR_SIGMA)
    return Priors(nodes, poses[nodes], np.repeat(stiff, len(nodes), axis=0))
