import numpy as np
import pytest

from radioslam import planar
from radioslam.looks import ALONE, APART, Part, average_looks, collect_parts
from radioslam.rigid_walks import Placement

WALKS = 5
FREE = np.zeros(WALKS, bool)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(4)


def placement(rng: np.random.Generator, spread_m: float = 0.0, frame=(0.0, 0.0, 0.0), **changes) -> Placement:
    """Five walks in a row, 10 m apart, seen from a frame of the look's own."""
    truth = np.column_stack([10.0 * np.arange(WALKS), np.zeros((WALKS, 3))])
    place = truth + np.column_stack([rng.normal(0, spread_m, (WALKS, 2)), np.zeros((WALKS, 2))])
    place[:, :2], place[:, 2] = planar.transform(np.array(frame), place[:, :2]), frame[2]
    given = {
        "centre": np.zeros((WALKS, 2)),
        "place": place,
        "part": np.zeros(WALKS, np.int64),
        "sigma_m": np.ones(WALKS),
        "reason": ("",) * WALKS,
        "fixed": FREE,
    }
    return Placement(**(given | changes))


def test_looks_from_frames_of_their_own_are_laid_on_the_first(rng):
    looks = [placement(rng), placement(rng, frame=(30.0, -4.0, 1.0)), placement(rng, frame=(0.0, 9.0, -2.0))]
    averaged = average_looks(looks, 20.0)
    np.testing.assert_allclose(averaged.place, looks[0].place, atol=1e-9)
    np.testing.assert_allclose(averaged.sigma_m, 1.0, atol=1e-9)


def test_the_mean_of_looks_errs_less_than_one_and_their_spread_shows(rng):
    looks = [placement(rng, spread_m=3.0) for _ in range(30)]
    averaged = average_looks(looks, 20.0)
    truth = placement(rng).place[:, :2]

    def error(one: Placement) -> float:
        aligned = planar.transform(planar.align_rigid(one.place[:, :2], truth), one.place[:, :2])
        return float(np.hypot(*(aligned - truth).T).mean())

    assert error(averaged) < 0.5 * np.mean([error(look) for look in looks])
    assert np.all((averaged.sigma_m > 1.5) & (averaged.sigma_m < 4.5))


def test_centres_of_other_points_of_a_walk_say_the_same(rng):
    first = placement(rng)
    moved = np.full((WALKS, 2), 2.0)
    turned = first.place + np.append(planar.rotate(0.0, np.array([2.0, 2.0])), [0.0, 0.0])
    other = placement(rng, centre=moved, place=turned)
    np.testing.assert_allclose(average_looks([first, other], 20.0).place, first.place, atol=1e-9)


def test_a_walk_that_most_looks_leave_alone_is_alone(rng):
    part = np.array([0, 0, 0, 0, 7])
    reason = ("", "", "", "", ALONE)
    looks = [placement(rng), *(placement(rng, part=part, reason=reason) for _ in range(2))]
    averaged = average_looks(looks, 20.0)
    assert averaged.part[:4].tolist() == [0] * 4
    assert averaged.part[4] > 0
    assert averaged.reason[4] == APART


def test_a_walk_that_most_looks_tie_is_tied(rng):
    part = np.array([0, 0, 0, 0, 7])
    looks = [placement(rng, part=part, reason=("", "", "", "", ALONE)), placement(rng), placement(rng)]
    averaged = average_looks(looks, 20.0)
    assert averaged.part.tolist() == [0] * WALKS
    assert averaged.reason == ("",) * WALKS
    np.testing.assert_allclose(averaged.place[4, :2], [40.0, 0.0], atol=1e-9)


def test_a_walk_that_stands_elsewhere_in_every_look_is_tied_too_loosely(rng):
    looks = []
    for shift in (-60.0, 0.0, 60.0):
        look = placement(rng, fixed=np.array([True, False, False, False, False]))
        look.place[4, 1] += shift
        looks.append(look)
    averaged = average_looks(looks, 20.0)
    assert averaged.part[4] > 0
    assert averaged.reason[4].startswith("tied too loosely (σ 35 m)")


def test_known_positions_hold_the_frame(rng):
    """Looks at a building with known positions share its frame: none is turned to fit another."""
    fixed = np.ones(WALKS, bool)
    looks = [placement(rng, fixed=fixed), placement(rng, frame=(2.0, 0.0, 0.0), fixed=fixed)]
    np.testing.assert_allclose(average_looks(looks, 20.0).place[:, 0], looks[0].place[:, 0] + 1.0)


def test_one_look_is_the_placement(rng):
    look = placement(rng, spread_m=1.0)
    assert average_looks([look], 20.0) is look


@pytest.mark.parametrize(("sigma_m", "tied"), [(19.0, True), (21.0, False)])
def test_parts_are_numbered_and_loose_walks_stand_alone(sigma_m, tied):
    main = Part(np.array([0, 1, 2]), np.zeros((3, 2)), np.zeros((3, 4)), np.array([0.0, 1.0, sigma_m]), 0.0)
    other = Part(np.array([3]), np.zeros((1, 2)), np.zeros((1, 4)), np.zeros(1), 0.0)
    collected = collect_parts([main, other], FREE, 20.0)
    assert collected.part[:2].tolist() == [0, 0]
    assert (collected.part[2] == 0) == tied
    assert (collected.reason[2] == "") == tied
    assert collected.part[3] == 1
    assert collected.reason[3] == APART
    assert collected.reason[4] == ALONE
    assert collected.part[4] > 1
