from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from radioslam.config import load_config
from radioslam.errors import MappingError
from radioslam.evaluation import Evaluation, evaluate, with_references
from radioslam.formats import read_walks
from radioslam.looks import ALONE, APART, LOOSE
from radioslam.odometry import estimate_odometry
from radioslam.placement import place_walks
from radioslam.results import SlamResult
from radioslam.slam import map_walks
from radioslam.walk import Reference, Walk

from .crowds import short_walks


def config_of(starts="unknown", preset="default", *overrides):
    return load_config(preset, overrides=[f"merging.starts={starts}", *overrides], environment={})


@cache
def mapped(*crowd) -> SlamResult:
    return map_walks(short_walks(*crowd), config_of())


@cache
def judged(*crowd) -> Evaluation:
    return evaluate(mapped(*crowd))


OFFICE = ("office", 1, 40, 80.0, 30)
CAMPUS = ("campus", 1, 16, 100.0, 40)
HARD = ("campus", 4, 8, 60.0, 30, 0.1)
"""Few access points in long corridors, and walks that barely meet."""


@pytest.mark.parametrize(("crowd", "largest"), [(OFFICE, 2.5), (CAMPUS, 5.5)])
def test_short_walks_of_a_building_find_their_places(crowd, largest):
    evaluation = judged(*crowd)
    assert evaluation.tied >= 0.9 * evaluation.walks
    assert evaluation.total.errors["estimate"].mean < largest
    assert 0.93 < evaluation.total.size_ratio["estimate"] < 1.07


def test_the_order_of_walks_does_not_matter():
    walks = short_walks(*OFFICE)
    again = map_walks(walks[::-1], config_of())
    np.testing.assert_array_equal(again.radio_map.poses, mapped(*OFFICE).radio_map.poses)


def test_where_the_walks_think_they_are_does_not_matter():
    walks = [replace(walk, reference=None) for walk in short_walks(*OFFICE)]
    blind = map_walks(walks, config_of())
    np.testing.assert_array_equal(blind.radio_map.poses, mapped(*OFFICE).radio_map.poses)


def errors_by_confidence(result: SlamResult) -> np.ndarray:
    """(w,) mean errors of the walks, the most confident first."""
    rows = {row.name: row.errors["estimate"].mean for row in evaluate(result).rows}
    sigma = dict(zip(result.walks, result.placed_sigma_m, strict=True))
    return np.array([rows[name] for name in sorted(rows, key=lambda name: sigma[name])])


def test_walks_placed_with_high_confidence_err_less_in_a_hard_building():
    errors = errors_by_confidence(mapped(*HARD))
    half = len(errors) // 2
    assert errors[:half].mean() < 0.7 * errors[half:].mean()


def test_confidence_is_of_the_size_of_the_error():
    errors, sigma = errors_by_confidence(mapped(*HARD)), np.sort(mapped(*HARD).placed_sigma_m)
    assert 0.3 < np.sqrt(np.mean(errors**2) / 2) / np.sqrt(np.mean(sigma**2)) < 3


def renamed(walk: Walk, prefix: str) -> Walk:
    names = tuple(prefix + name for name in walk.wifi.transmitters)
    return replace(walk, name=prefix + walk.name, wifi=replace(walk.wifi, transmitters=names))


def test_walks_of_another_building_are_a_map_of_their_own_and_say_why():
    here, there = short_walks(*OFFICE)[:20], [renamed(walk, "there-") for walk in short_walks(*OFFICE)[20:26]]
    result = map_walks([*here, *there], config_of())
    apart = np.array([name.startswith("there-") for name in result.walks])
    assert set(result.map_of_walk[~apart]) == {0}
    assert 0 not in result.map_of_walk[apart]
    assert {result.untied_reason[k] for k in np.flatnonzero(apart)} <= {APART, ALONE}
    assert all(result.untied_reason[k] == "" for k in np.flatnonzero(~apart))
    assert evaluate(result).tied == 20


def test_walks_that_share_nothing_are_maps_of_their_own():
    walks = [renamed(walk, f"{k}-") for k, walk in enumerate(short_walks(*OFFICE)[:5])]
    result = map_walks(walks, config_of())
    assert sorted(result.map_of_walk) == [0, 1, 2, 3, 4]
    assert result.untied_reason == (ALONE,) * 5
    assert len(result.summary()["untied"]) == 4


def test_a_single_walk_is_a_map():
    result = map_walks(short_walks(*OFFICE)[:1], config_of())
    assert result.map_of_walk.tolist() == [0]
    assert result.untied_reason == (ALONE,)


def test_walks_placed_too_loosely_are_left_out_with_their_sigma():
    result = map_walks(short_walks(*HARD), config_of("unknown", "default", "placement.max_sigma_m=5"))
    sigma, reasons = np.array(result.placed_sigma_m), np.array(result.untied_reason)
    assert np.all((sigma > 5) == np.char.startswith(reasons, LOOSE.split(" (")[0]))
    assert np.all((result.map_of_walk == 0) == (sigma <= 5))
    assert evaluate(result).total.errors["estimate"].mean < judged(*HARD).total.errors["estimate"].mean


def test_the_preset_paper_can_place_walks_too():
    assert evaluate(map_walks(short_walks(*OFFICE), config_of(preset="paper"))).tied == len(short_walks(*OFFICE))


# Some positions known


def fixed(walk: Walk, share: float) -> Walk:
    """The walk with one known position so far along it."""
    assert walk.reference is not None
    when = mapped_span(walk)[0] + share * np.ptp(mapped_span(walk))
    return replace(walk, reference=Reference(np.array([when]), walk.reference.at(np.array([when]))))


def mapped_span(walk: Walk) -> np.ndarray:
    assert walk.odometry is not None
    return walk.odometry.time_s[[0, -1]]


def errors_with_fixes(crowd, every: int, share: float) -> Evaluation:
    walks = sorted(short_walks(*crowd), key=lambda walk: walk.name)
    given = [fixed(w, share) if k % every == 0 else replace(w, reference=None) for k, w in enumerate(walks)]
    result = map_walks(given, config_of("mixed"))
    return evaluate(with_references(result, {walk.name: walk.reference for walk in walks if walk.reference}))


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_third_of_known_positions_at_the_start_or_in_the_middle_is_better_than_none(share):
    mixed = errors_with_fixes(HARD, 3, share)
    assert mixed.alignment == "none"
    assert mixed.tied >= 0.9 * mixed.walks
    assert mixed.total.errors["estimate"].mean < judged(*HARD).total.errors["estimate"].mean


def test_known_positions_hold():
    walks = [fixed(walk, 0.5) for walk in short_walks(*OFFICE)[:8]]
    tracks = estimate_odometry(walks, config_of("mixed").odometry)
    placement = place_walks(tracks, config_of("mixed"))
    assert placement.fixed.all()
    known = np.array([walk.reference.positions_xy[0] for walk in walks])
    inside = np.concatenate([track.at(track.walk.reference.time_s) for track in tracks])
    assert np.hypot(*(placement.poses(np.arange(8), inside)[:, :2] - known).T).max() < 3.0


def test_mixed_starts_need_a_known_position():
    walks = [replace(walk, reference=None) for walk in short_walks(*OFFICE)[:4]]
    with pytest.raises(MappingError, match="--starts unknown"):
        map_walks(walks, config_of("mixed"))


# Real floors

REAL_FLOORS = {
    # floor: (largest mean error allowed, least share of walks tied)
    "indoor-location-20/site1/F1": (5.5, 0.85),
    "indoor-location-20/site1/F4": (6.0, 0.9),
    "ipin2023/floor0": (3.3, 1.0),
}


@pytest.mark.real_data
@pytest.mark.parametrize("floor", REAL_FLOORS)
def test_unknown_starts_on_a_real_floor(data_folder: Path, floor: str):
    largest, share = REAL_FLOORS[floor]
    result = map_walks(read_walks([data_folder / floor]), config_of())
    evaluation = evaluate(result)
    assert result.solver.converged
    assert evaluation.alignment == "rigid"
    assert evaluation.total.errors["estimate"].mean < largest
    assert evaluation.tied >= share * evaluation.walks
    assert 0.9 < evaluation.total.size_ratio["estimate"] < 1.05
