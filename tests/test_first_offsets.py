import numpy as np

from radioslam.first_offsets import first_offsets


def crowd(rng, walks=8, points=10, loops=120, wrong=0.0):
    """Points of walks shifted out of place, loops between points that meet, and the true offsets."""
    walk = np.repeat(np.arange(walks), points)
    offsets = rng.uniform(-50, 50, (walks, 2))
    i, j = rng.integers(0, len(walk), (2, 4 * loops))
    i, j = i[walk[i] != walk[j]][:loops], j[walk[i] != walk[j]][:loops]
    truth = rng.uniform(0, 30, (len(walk), 2))
    moved = truth - offsets[walk]
    gap = rng.normal(0, 1, (len(i), 2))
    gap[rng.random(len(i)) < wrong] += rng.uniform(30, 60, 2)
    pairs = np.concatenate([moved[i], moved[j] + truth[i] - truth[j] + gap])
    numbers = np.arange(len(pairs))
    count = len(i)
    return np.concatenate([walk[i], walk[j]]), pairs, numbers[:count], numbers[count:], offsets


def error(rng, wrong):
    walk, points, i, j, truth = crowd(rng, wrong=wrong)
    found = first_offsets(walk, points, i, j, np.ones(len(i)), len(truth))
    difference = found - truth
    return np.hypot(*(difference - np.median(difference, axis=0)).T).max()


def test_walks_find_their_offsets():
    assert error(np.random.default_rng(1), 0.0) < 1.0


def test_wrong_loops_that_others_contradict_do_not_count():
    assert error(np.random.default_rng(2), 0.2) < 1.5


def test_a_walk_without_loops_stays():
    offsets = first_offsets(
        np.array([0, 1, 2]), np.array([[0.0, 0], [5, 0], [9, 9]]), *np.array([[0], [1]]), np.ones(1), 3
    )
    np.testing.assert_allclose(offsets[1] - offsets[0], [-5, 0], atol=1e-4)
    np.testing.assert_allclose(offsets[2], 0, atol=1e-9)


def test_sure_loops_count_against_many_others():
    walk, points = np.repeat([0, 1], 5), np.zeros((10, 2))
    points[4] = [20, 0]
    i, j = np.arange(5), np.arange(5, 10)
    doubted = first_offsets(walk, points, i, j, np.ones(5), 2)
    believed = first_offsets(walk, points, i, j, np.ones(5), 2, sure=i == 4)
    assert abs(np.diff(doubted, axis=0)[0, 0]) < 1
    assert np.diff(believed, axis=0)[0, 0] > 5
