"""Which way did each walk turn out? For phones carried at an unknown angle: in a pocket, a bag, a swinging hand.

A phone in a pocket measures turns as well as one in the hand, but its own forward axis points anywhere. The angle to
the way of walking, one per walk, is found from the crowd: turned about its known start, each walk must come to lie
where its scans hear what the others' scans hear. With K angles per walk and the loops' robust cost for each pair of
angles of two walks, that is a discrete labelling, solved by min-sum belief propagation as in Crandall et al. 2011; the
graph then takes the rest of the angle as it takes a compass that errs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.config import Config
from radioslam.fingerprints import Fingerprints
from radioslam.loops import screen_candidates
from radioslam.merging import MergedTracks
from radioslam.pose_graph import Edges, Priors
from radioslam.similarity import Pairs
from radioslam.uncertainty import UncertaintyModel

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

ANGLES = 36
ROUNDS = 60
DAMPING = 0.5
TURN_SIGMA_RAD = 0.3
"""What remains of the angle once it is found."""


def turn_walks(
    merged: MergedTracks, similar: Pairs, fingerprints: Fingerprints, uncertainty: UncertaintyModel, config: Config
) -> MergedTracks:
    """The same tracks, each turned about its start by the angle that the crowd's loops ask for."""
    loops = _loops_anywhere(merged, similar, fingerprints, config)
    angle = np.arange(ANGLES) * 2 * np.pi / ANGLES
    walks, cost = pair_costs(merged, loops, fingerprints, uncertainty.sigma(loops.similarity), angle)
    return _turned(merged, angle[best_labels(walks, cost, len(merged.tracks))])


def pair_costs(
    merged: MergedTracks, loops: Pairs, fingerprints: Fingerprints, sigma_m: Array, angle: Array
) -> tuple[Integers, Array]:
    """Pairs of walks (p, 2) with loops, and their cost (p, K, K) by the angles (K,) of the first and the second.

    A loop costs log(1 + d²/σ²) where the turned walks leave it d metres apart.
    """
    node = merged.node_of_fingerprint
    pivot = merged.poses[_starts(merged), :2]
    arm = merged.poses[node, :2] - pivot[fingerprints.walk]
    place = [
        planar.rotate(angle, arm[ends][:, None, :]) + pivot[fingerprints.walk[ends]][:, None, :]
        for ends in (loops.i, loops.j)
    ]
    key = fingerprints.walk[loops.i] * len(merged.tracks) + fingerprints.walk[loops.j]
    keys, group = np.unique(key, return_inverse=True)
    cost = np.zeros((len(keys), len(angle), len(angle)))
    for k in range(len(keys)):
        here = group == k
        gap = place[0][here][:, :, None, :] - place[1][here][:, None, :, :]
        cost[k] = np.log1p(np.sum(gap**2, axis=-1) / sigma_m[here, None, None] ** 2).sum(axis=0)
    return np.column_stack([keys // len(merged.tracks), keys % len(merged.tracks)]), cost


def best_labels(walks: Integers, cost: Array, count: int) -> Integers:
    """Label (count,) of every walk that min-sum belief propagation finds for pairs (p, 2) with costs (p, K, K)."""
    labels = cost.shape[2]
    to = np.zeros((2, len(walks), labels))  # what the second tells the first of each pair, and the first the second
    belief = np.zeros((count, labels))
    for _ in range(ROUNDS):
        from_second = (cost + (belief[walks[:, 1]] - to[1])[:, None, :]).min(axis=2)
        from_first = (cost + (belief[walks[:, 0]] - to[0])[:, :, None]).min(axis=1)
        told = np.stack([from_second, from_first])
        to = DAMPING * to + (1 - DAMPING) * (told - told.min(axis=2, keepdims=True))
        belief = np.zeros((count, labels))
        np.add.at(belief, walks[:, 0], to[0])
        np.add.at(belief, walks[:, 1], to[1])
    return belief.argmin(axis=1)


def _loops_anywhere(merged: MergedTracks, similar: Pairs, fingerprints: Fingerprints, config: Config) -> Pairs:
    """Loops between different walks of one frame, wherever the estimate has them."""
    walk_i, walk_j = fingerprints.walk[similar.i], fingerprints.walk[similar.j]
    across = similar.select((walk_i != walk_j) & (merged.frame[walk_i] == merged.frame[walk_j]))
    positions = merged.poses[merged.node_of_fingerprint, :2]
    anywhere = config.screening.model_copy(update={"consistency_m": 0.0})
    return screen_candidates(across, fingerprints, positions, anywhere).kept


def _starts(merged: MergedTracks) -> Integers:
    """(n_walks,) the node of each walk that is known: the one a prior holds, else its first."""
    start = np.searchsorted(merged.walk, np.arange(len(merged.tracks)))
    start[merged.walk[merged.priors.node]] = merged.priors.node
    return start


def _turned(merged: MergedTracks, angle: Array) -> MergedTracks:
    """Poses, known headings and links between starts with each walk turned by its angle (n_walks,)."""
    pivot, turn = merged.poses[_starts(merged), :2][merged.walk], angle[merged.walk]
    poses = np.column_stack([planar.rotate(turn, merged.poses[:, :2] - pivot) + pivot, merged.poses[:, 2] + turn])
    return replace(
        merged,
        poses=poses,
        priors=Priors(merged.priors.node, poses[merged.priors.node], _loosened(merged.priors.information)),
        links=_between_turned(merged.links, poses),
    )


def _between_turned(links: Edges, poses: Array) -> Edges:
    between = links.measurement.copy()
    between[:, 2] = planar.wrap(poses[links.j, 2] - poses[links.i, 2])
    return replace(links, measurement=between, information=_loosened(links.information))


def _loosened(information: Array) -> Array:
    """The same with a heading known to no better than ``TURN_SIGMA_RAD``."""
    loose = information.copy()
    loose[:, 2, 2] = np.minimum(loose[:, 2, 2], TURN_SIGMA_RAD**-2)
    return loose
