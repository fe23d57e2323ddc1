from dataclasses import replace

import numpy as np
import pytest

from radioslam import planar
from radioslam.config import load_config
from radioslam.errors import MappingError
from radioslam.evaluation import evaluate
from radioslam.simulator import simulate
from radioslam.slam import map_walks
from radioslam.turns import best_labels
from radioslam.walk import Signal


def turned(walk, angle):
    """The walk as a phone records it whose forward axis points elsewhere than its bearer walks."""
    poses = walk.odometry.values
    bent = np.column_stack([planar.rotate(angle, poses[:, :2] - poses[0, :2]), poses[:, 2] + angle])
    return replace(walk, odometry=Signal(walk.odometry.time_s, bent))


@pytest.mark.parametrize("starts", ["common", "known"])
def test_phones_carried_at_unknown_angles_are_turned_by_the_crowd(starts):
    rng = np.random.default_rng(3)
    walks = [turned(walk, rng.uniform(-np.pi, np.pi)) for walk in simulate("campus", seed=201, walks=8)]
    errors = {}
    for heading in ("device", "unknown"):
        config = load_config(overrides=[f"merging.heading={heading}", f"merging.starts={starts}"], environment={})
        # All walks of the campus begin at one place, so nothing says where north is.
        errors[heading] = evaluate(map_walks(walks, config), alignment="rigid").total.errors["estimate"].mean
    assert errors["device"] > 20.0
    assert errors["unknown"] < 2.0


def test_labels_are_those_of_the_least_cost_on_a_tree():
    rng = np.random.default_rng(0)
    walks, cost = np.array([[0, 1], [1, 2], [1, 3]]), rng.uniform(size=(3, 5, 5))
    total = np.zeros((5, 5, 5, 5))
    total += cost[0][:, :, None, None] + cost[1][None, :, :, None] + cost[2][None, :, None, :]
    best = np.unravel_index(total.argmin(), total.shape)
    np.testing.assert_array_equal(best_labels(walks, cost, 4), best)


def test_walks_without_loops_are_left_as_they_are():
    assert best_labels(np.zeros((0, 2), np.int64), np.zeros((0, 5, 5)), 3).tolist() == [0, 0, 0]


@pytest.mark.parametrize("starts", ["unknown", "mixed"])
def test_without_starts_headings_must_be_known(starts):
    config = load_config(overrides=["merging.heading=unknown", f"merging.starts={starts}"], environment={})
    with pytest.raises(MappingError, match="expected known or common starts where headings are unknown"):
        map_walks(simulate("office", seed=1), config)
