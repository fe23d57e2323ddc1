"""New walks of unknown start in an existing map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radioslam.config import load_config
from radioslam.errors import MappingError
from radioslam.extending import extend_map, find_place, walks_of
from radioslam.formats import read_walks
from radioslam.map_export import merge
from radioslam.positioning import Positioner
from radioslam.simulator import simulate
from radioslam.slam import map_walks

CONFIG = load_config(environment={})
KNOWN = load_config(overrides=["merging.starts=known"], environment={})


def mean_error(result, names):
    samples = result.radio_map
    here = np.isin(np.array(samples.walks)[samples.walk], names) & (samples.map == 0)
    return np.nanmean(np.hypot(*(samples.poses[here, :2] - result.reference_xy[here]).T))


def known_references(result):
    return dict(zip(result.walks, result.references, strict=True))


@pytest.fixture(scope="module")
def office():
    """A map of five walks, three new walks, and one that was made in another building."""
    walks = simulate("office", seed=1, walks=8)
    stranger = replace(simulate("office", seed=2, walks=1)[0], name="stranger")
    return map_walks(walks[:5], KNOWN), walks[5:], stranger


@pytest.fixture(scope="module")
def extended(office):
    base, new, stranger = office
    return extend_map(base.radio_map, [*new, stranger], CONFIG, known_references(base))


def test_new_walks_are_mapped_in_the_frame_of_the_map(office, extended):
    base, new, _ = office
    names = [walk.name for walk in new]
    assert np.all(extended.map_of_walk[[extended.walks.index(name) for name in names]] == 0)
    assert mean_error(extended, names) < 1.5 * mean_error(base, base.walks)
    assert mean_error(extended, base.walks) < 1.2 * mean_error(base, base.walks)


def test_a_walk_of_another_building_is_named_with_the_reason(extended):
    k = extended.walks.index("stranger")
    assert extended.map_of_walk[k] > 0
    assert "not of this map" in extended.untied_reason[k]
    assert [bool(reason) for reason in extended.untied_reason].count(True) == 1


def test_found_places_carry_a_deviation_that_fits(office):
    base, new, _ = office
    positioner = Positioner.of(base.radio_map, CONFIG)
    for walk in new:
        place = find_place(positioner, walk, CONFIG, seed=1)
        truth = walk.reference.at(np.array([place.time_s]))[0]
        assert np.hypot(*(place.position_xy - truth)) < 3 * place.sigma_m


def test_a_map_gives_its_walks_back(office):
    samples = office[0].radio_map
    walks = {walk.name: walk for walk in walks_of(samples)}
    assert set(walks) == set(samples.walks)
    for k, name in enumerate(samples.walks):
        here = samples.select(samples.walk == k)
        np.testing.assert_array_equal(walks[name].odometry.values, here.poses)
        np.testing.assert_array_equal(walks[name].wifi.scan_time_s, here.time_s)
        assert walks[name].wifi.reading_count == here.rss_dbm.nnz


def test_a_walk_mapped_again_replaces_itself(office):
    base, *_ = office
    again = replace(simulate("office", seed=1, walks=1)[0])
    assert extend_map(base.radio_map, [again], CONFIG).walks == base.walks


def test_several_floors_are_refused(office):
    base, new, _ = office
    with pytest.raises(MappingError, match="expected a map of one floor, found floors 0, 1"):
        extend_map(merge([base.radio_map, base.radio_map], ["0", "1"]), new, CONFIG)


@pytest.mark.real_data
def test_half_of_the_museums_walks_are_found_in_the_map_of_the_others(data_folder):
    walks = sorted(read_walks([data_folder / "ipin2023" / "floor0"]), key=lambda walk: walk.name)
    base = map_walks(walks[1::2], KNOWN)
    result = extend_map(base.radio_map, walks[::2], CONFIG, known_references(base))
    assert not np.any(result.map_of_walk)
    assert mean_error(result, [walk.name for walk in walks[::2]]) < 2.0
    assert mean_error(result, base.walks) < 1.1 * mean_error(base, base.walks)


@pytest.mark.real_data
def test_walks_of_the_floor_belong_and_those_of_another_do_not(data_folder):
    site = data_folder / "indoor-location-20" / "site1"
    walks, strangers = read_walks([site / "F4"]), read_walks([site / "F1"])[::10]
    base = map_walks([walk for k, walk in enumerate(walks) if k % 4], KNOWN)
    positioner = Positioner.of(base.radio_map, CONFIG)

    def found(these):
        return np.mean([find_place(positioner, walk, CONFIG, seed=1).position_xy is not None for walk in these])

    assert found(walks[::8]) >= 0.9
    assert found(strangers) <= 0.1
