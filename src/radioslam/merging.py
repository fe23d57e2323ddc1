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
from radioslam.rigid_walks import Placement
from radioslam.similarity import pair_similarity
from radioslam.uncertainty import UncertaintyModel

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

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
        placement: how walks of unknown start got their first places, or None.
    """

    tracks: tuple[Track, ...]
    walk: Integers
    time_s: Array
    poses: Array
    fingerprint: Integers
    frame: Integers
    links: Edges
    priors: Priors
    placement: Placement | None = None

    @property
    def node_of_fingerprint(self) -> Integers:
        """(n_fingerprints,) the node of each fingerprint."""
        return np.flatnonzero(self.fingerprint >= 0)

    def velocities(self) -> Array:
        """(n, 2) m/s of each node in the frame of the map: its odometry's, turned as the estimate is."""
        velocity = np.empty((len(self.poses), 2))
        for k, track in enumerate(self.tracks):
            here = self.walk == k
            time_s = self.time_s[here]
            velocity[here] = planar.rotate(self.poses[here, 2] - track.at(time_s)[:, 2], track.velocity(time_s))
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
    placement: Placement | None = None,
) -> MergedTracks:
    """Place all tracks by ``config.starts``.

    ``common``: all walks begin at one place, which becomes (0, 0).  ``known``: each walk begins where its first
    reference position says; a walk without one gets a frame of its own. A position that was found is held by its own
    standard deviation, any other by ``config.start_sigma_m``.

    ``unknown`` and ``mixed``: as the ``placement`` says, which they need; ``mixed`` holds the known positions.

    Raises:
        MappingError: ``known`` or ``mixed`` without any reference.
    """
    if placement is not None:
        return _merge_placed(tracks, fingerprints, placement, config)
    if config.starts == "common":
        return _merge_common(tracks, fingerprints, strengths, uncertainty, config)
    return _merge_known(tracks, fingerprints, config)


def standing_at(merged: MergedTracks, poses: Array) -> MergedTracks:
    """The same tracks with their scans at ``poses`` (n_fingerprints, 3).

    A start between scans stands as its odometry says from the scan after it, or before.
    """
    nodes = np.empty_like(merged.poses)
    nodes[merged.node_of_fingerprint] = poses
    for start in np.flatnonzero(merged.fingerprint < 0).tolist():
        before = start + 1 == len(nodes) or merged.walk[start + 1] != merged.walk[start]
        near = start - 1 if before else start + 1
        motion = planar.between(*merged.tracks[merged.walk[start]].at(merged.time_s[[near, start]]))
        nodes[start] = planar.compose(nodes[near], motion)
    return replace(merged, poses=nodes)


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
    offset = np.array([_start(track)[2] for track in tracks])
    walk, time_s, poses, fingerprint = _with_starts(tracks, fingerprints, known)
    poses[:, :2] += offset[walk]
    started = np.flatnonzero(fingerprint < 0)
    loose = np.searchsorted(walk, np.flatnonzero(~known))
    given = [track.walk.reference.sigma_m for track in tracks if track.walk.reference is not None]
    sigma_m = np.array([config.start_sigma_m if sigma is None else sigma for sigma in given])
    spread = diagonal_information(sigma_m, sigma_m, np.full(len(sigma_m), config.heading_sigma_rad))
    held = Priors(started, poses[started], spread)
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


def _merge_placed(
    tracks: Sequence[Track], fingerprints: Fingerprints, placement: Placement, config: MergingConfig
) -> MergedTracks:
    """Lay each walk where its placement says, held there weakly at its middle, or firmly at its known position."""
    walk, time_s, poses, fingerprint = _with_starts(tracks, fingerprints, placement.fixed)
    poses = placement.poses(walk, poses)
    started = np.flatnonzero(fingerprint < 0)
    references = [tracks[k].walk.reference for k in walk[started].tolist()]
    poses[started, :2] = np.reshape([r.positions_xy[0] for r in references if r is not None], (-1, 2))
    firm = diagonal_information(config.start_sigma_m, config.start_sigma_m, config.placed_heading_sigma_rad)
    weak = diagonal_information(config.placed_sigma_m, config.placed_sigma_m, config.placed_heading_sigma_rad)
    middle = _middles(walk, poses, placement)
    alone = np.bincount(placement.part, minlength=placement.part.max() + 1)[placement.part] == 1
    free, lone = middle[~placement.fixed & ~alone], middle[~placement.fixed & alone]
    held = Priors(started, poses[started], np.repeat(firm, len(started), axis=0))
    leaning = Priors(free, poses[free], np.repeat(weak, len(free), axis=0))
    return MergedTracks(
        tracks=tuple(tracks),
        walk=walk,
        time_s=time_s,
        poses=poses,
        fingerprint=fingerprint,
        frame=placement.part,
        links=Edges.none(),
        priors=Priors.concatenate([held, leaning, _anchors(lone, poses)]),
        placement=placement,
    )


def _middles(walk: Integers, poses: Array, placement: Placement) -> Integers:
    """The node (w,) of each walk nearest to its centre."""
    away = np.hypot(*(poses[:, :2] - placement.place[walk, :2]).T)
    order = np.lexsort((away, walk))
    return order[np.searchsorted(walk[order], np.arange(len(placement.place)))]


def _with_starts(
    tracks: Sequence[Track], fingerprints: Fingerprints, known: NDArray[np.bool_]
) -> tuple[Integers, Array, Array, Integers]:
    """Nodes: walk, time, odometry pose and fingerprint (-1 at starts) of all scans and of the ``known`` (w,) starts."""
    starts = [_start(tracks[k]) for k in np.flatnonzero(known).tolist()]
    walk = np.concatenate([fingerprints.walk, np.flatnonzero(known)])
    time_s = np.concatenate([fingerprints.time_s, [time_s for time_s, _, _ in starts]])
    poses = np.concatenate([fingerprints.poses, np.reshape([pose for _, pose, _ in starts], (-1, 3))])
    fingerprint = np.concatenate([np.arange(len(fingerprints)), np.full(len(starts), -1)])
    order = np.lexsort((-fingerprint, time_s, walk))
    return walk[order], time_s[order], poses[order], fingerprint[order]


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
