import numpy as np

from radioslam import rigid
from radioslam.config import load_config
from radioslam.point_cloud.spatial_graph import SpatialEdges
from radioslam.point_cloud.tying import tie_walks

CONFIG = load_config(environment={}).reference


def crowd(wrong=0, walks=3, count=10):
    """Walks over one ground, each in a frame of its own, and loops between neighbours in number."""
    rng = np.random.default_rng(0)
    walk = np.repeat(np.arange(walks), count)
    planar = np.column_stack([rng.uniform(0, 20, (len(walk), 2)), rng.uniform(-3, 3, len(walk))])
    truth = rigid.from_planar(planar)
    frames = rigid.from_planar(np.column_stack([rng.uniform(-9, 9, (walks, 2)), rng.uniform(-3, 3, walks)]))
    i = np.concatenate([np.flatnonzero(walk == k)[:5] for k in range(walks - 1)])
    j = i + count
    z = rigid.inverse(truth[i]) @ truth[j]
    z[:wrong] = rigid.from_planar(rng.uniform(-5, 5, (wrong, 3)))
    return truth, walk, frames[walk] @ truth, SpatialEdges(i, j, z, np.tile(np.eye(6), (len(i), 1, 1)))


def test_walks_come_into_the_frame_of_one_of_them():
    truth, walk, given, loops = crowd()
    poses, part, holds = tie_walks(walk, given, loops, CONFIG)
    assert holds.all()
    assert len(set(part.tolist())) == 1
    first = poses[0] @ rigid.inverse(truth[0])
    np.testing.assert_allclose(poses, first @ truth, atol=1e-9)


def test_the_loops_that_most_contradict_do_not_hold():
    truth, walk, given, loops = crowd(wrong=2)
    poses, _, holds = tie_walks(walk, given, loops, CONFIG)
    assert holds.tolist() == [False] * 2 + [True] * 8
    np.testing.assert_allclose(poses, poses[0] @ rigid.inverse(truth[0]) @ truth, atol=1e-9)


def test_too_few_loops_tie_nothing():
    _, walk, given, loops = crowd(wrong=3)
    poses, part, holds = tie_walks(walk, given, loops, CONFIG)
    assert not holds[:5].any()
    assert part.tolist() == [0] * 10 + [1] * 20
    np.testing.assert_array_equal(poses[walk == 0], given[walk == 0])


def test_loops_within_a_walk_are_left_alone():
    _, _, given, loops = crowd()
    poses, _, holds = tie_walks(np.zeros(len(given), np.int64), given, loops, CONFIG)
    assert holds.all()
    np.testing.assert_array_equal(poses, given)
