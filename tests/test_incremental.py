"""A map that takes walks in and gives them back, against batch runs of the same walks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radioslam.config import load_config
from radioslam.errors import MappingError, ResultError
from radioslam.formats import read_walks
from radioslam.incremental import GrowingMap
from radioslam.simulator import simulate
from radioslam.slam import map_walks

KNOWN = load_config(overrides=["merging.starts=known"], environment={})


def positions(result, names):
    samples = result.radio_map
    return samples.poses[np.isin(np.array(samples.walks)[samples.walk], names), :2]


def apart_m(result, other, names):
    return float(np.hypot(*(positions(result, names) - positions(other, names)).T).mean())


def mean_error(result, names):
    samples = result.radio_map
    here = np.isin(np.array(samples.walks)[samples.walk], names) & (samples.map == 0)
    return float(np.nanmean(np.hypot(*(samples.poses[here, :2] - result.reference_xy[here]).T)))


@pytest.fixture(scope="module")
def office():
    """Sixteen walks, the map of the first twelve, and of all."""
    walks = simulate("office", seed=1, walks=16)
    return walks, map_walks(walks[:12], KNOWN), map_walks(walks, KNOWN)


@pytest.fixture
def grown(office):
    walks, base, _ = office
    return GrowingMap.of(base, walks[:12])


def test_walks_that_come_one_at_a_time_stand_where_the_batch_puts_them(office, grown):
    walks, _, batch = office
    added = [grown.add(walk) for walk in walks[12:]]
    assert all(one.tied and one.loops >= 6 and np.all(one.sigma_m > 0) for one in added)
    result = grown.result()
    names = [walk.name for walk in walks]
    assert mean_error(result, names) < 1.1 * mean_error(batch, names)
    assert apart_m(result, batch, names) < 0.5
    assert result.summary()["total"]["scans"] == len(batch.radio_map)


def test_a_full_optimization_is_the_batch_run(office, grown):
    walks, _, batch = office
    for walk in walks[12:]:
        grown.add(walk)
    assert grown.worth_rebuilding
    grown.rebuild()
    assert not grown.worth_rebuilding
    result = grown.result()
    np.testing.assert_allclose(result.radio_map.poses, batch.radio_map.poses, atol=1e-6)
    np.testing.assert_allclose(result.radio_map.sigma_m, batch.radio_map.sigma_m, atol=1e-6)
    np.testing.assert_array_equal(result.loops.kept.i, batch.loops.kept.i)
    heard = np.flatnonzero(np.diff(batch.radio_map.rss_dbm.tocsc().indptr))
    np.testing.assert_array_equal(result.radio_map.rss_dbm.toarray(), batch.radio_map.rss_dbm[:, heard].toarray())
    assert result.radio_map.transmitters == tuple(batch.radio_map.transmitters[k] for k in heard)


def test_without_a_walk_the_map_is_what_it_would_have_been(office, grown):
    walks, *_ = office
    gone = walks[3].name
    others = [walk for walk in walks[:12] if walk.name != gone]
    without = map_walks(others, KNOWN)
    names = [walk.name for walk in others]
    grown.remove(gone)
    assert gone not in grown.walks
    assert apart_m(grown.result(), without, names) < 0.5
    assert not np.any(np.char.equal(np.array(grown.result().walks), gone))
    grown.rebuild()
    np.testing.assert_allclose(grown.result().radio_map.poses, without.radio_map.poses, atol=1e-6)


def test_a_walk_that_came_and_went_leaves_little_behind(office, grown):
    walks, base, _ = office
    grown.add(walks[12])
    grown.remove(walks[12].name)
    names = [walk.name for walk in walks[:12]]
    assert apart_m(grown.result(), base, names) < 0.3
    assert grown.walks == base.walks


def test_a_map_begins_with_one_walk_whose_start_nobody_knows(office):
    walks, *_ = office
    grown = GrowingMap.begin(load_config(overrides=["merging.starts=unknown"], environment={}))
    first = grown.add(walks[0])
    assert first.tied
    for walk in walks[1:8]:
        grown.add(walk)
        if grown.worth_rebuilding:
            grown.rebuild()
    result = grown.result()
    assert np.mean(result.map_of_walk == 0) >= 0.9
    assert result.summary()["total"]["error"]["estimate"]["mean"] < 4.0


def test_a_full_optimization_of_unknown_starts_keeps_the_frame(office):
    walks, *_ = office
    grown = GrowingMap.begin(load_config(overrides=["merging.starts=unknown"], environment={}))
    for walk in walks[:10]:
        grown.add(walk)
    grown.rebuild()
    before = grown.result().radio_map.poses[:, :2]
    grown.rebuild()
    assert np.hypot(*(grown.result().radio_map.poses[:, :2] - before).T).mean() < 0.2


def test_walks_with_a_common_start_are_held_there(office):
    walks, *_ = office
    common = load_config(overrides=["merging.starts=common"], environment={})
    batch = map_walks(walks[:9], common)
    grown = GrowingMap.of(map_walks(walks[:8], common), walks[:8])
    assert grown.add(walks[8]).tied
    assert apart_m(grown.result(), batch, [walk.name for walk in walks[:9]]) < 1.0


def test_a_stranger_is_kept_apart_with_the_reason_and_tried_again(office, grown):
    stranger = replace(simulate("office", seed=2, walks=1)[0], name="stranger", reference=None)
    added = grown.add(stranger)
    assert not added.tied
    assert "scans" in added.reason
    result = grown.result()
    k = result.walks.index("stranger")
    assert result.map_of_walk[k] == 1
    assert result.untied_reason[k] == added.reason
    grown.rebuild()
    assert not grown.mapped["stranger"].tied


def test_a_walk_of_unknown_start_is_found_by_its_scans(office, grown):
    walks, *_ = office
    for walk in walks[12:]:
        added = grown.add(replace(walk, reference=None))
        assert added.tied
        truth = walk.reference.at(added.time_s)
        assert np.nanmean(np.hypot(*(added.poses[:, :2] - truth).T)) < 4.0


def test_a_walk_of_the_same_name_takes_the_place_of_the_first(office, grown):
    walks, *_ = office
    grown.add(walks[5])
    assert grown.walks == tuple(walk.name for walk in walks[:12])


def test_what_cannot_be_is_refused_and_leaves_the_map_as_it_was(office, grown):
    walks, *_ = office
    with pytest.raises(MappingError, match="expected a walk of the map, found 'nobody'"):
        grown.remove("nobody")
    with pytest.raises(MappingError, match="expected a walk of floor"):
        grown.add(replace(walks[13], floor="attic"))
    assert grown.walks == tuple(walk.name for walk in walks[:12])
    with pytest.raises(MappingError, match="expected the 12 walks of the result"):
        GrowingMap.of(office[1], walks[:11])
    empty = GrowingMap.begin(KNOWN)
    for question in (empty.result, empty.rebuild):
        with pytest.raises(MappingError, match="expected at least one walk"):
            question()
    with pytest.raises(MappingError):
        empty.add(replace(walks[0], reference=None))
    assert empty.walks == ()


def test_a_map_emptied_begins_anew(office):
    walks, *_ = office
    grown = GrowingMap.begin(KNOWN)
    grown.add(walks[0])
    grown.remove(walks[0].name)
    assert grown.walks == ()
    assert grown.add(walks[1]).tied


def test_a_saved_map_goes_on_as_the_one_in_memory(office, grown, tmp_path):
    walks, *_ = office
    grown.add(walks[12])
    grown.add(replace(simulate("office", seed=2, walks=1)[0], name="stranger", reference=None))
    grown.save(tmp_path / "map")
    again = GrowingMap.load(tmp_path / "map")
    for one in (grown, again):
        one.add(walks[13])
    before, after = grown.result(), again.result()
    np.testing.assert_array_equal(before.radio_map.poses, after.radio_map.poses)
    np.testing.assert_array_equal(before.loops.pairs.i, after.loops.pairs.i)
    np.testing.assert_array_equal(before.reference_xy, after.reference_xy)
    assert before.untied_reason == after.untied_reason
    for one in (grown, again):
        one.rebuild()
    np.testing.assert_array_equal(grown.result().radio_map.poses, again.result().radio_map.poses)


def test_a_folder_that_is_no_map_is_refused(tmp_path, grown):
    with pytest.raises(ResultError, match="expected a growing map"):
        GrowingMap.load(tmp_path)
    grown.save(tmp_path / "map")
    with pytest.raises(ResultError, match="--force"):
        grown.save(tmp_path / "map")
    (tmp_path / "map" / "tracks.parquet").write_bytes(b"PAR1")
    with pytest.raises(ResultError, match="expected a growing map"):
        GrowingMap.load(tmp_path / "map")
    GrowingMap.begin(KNOWN).save(tmp_path / "empty")
    assert GrowingMap.load(tmp_path / "empty").walks == ()


@pytest.mark.real_data
@pytest.mark.parametrize(("floor", "tolerance"), [("indoor-location-20/site1/F4", 1.1), ("ipin2023/floor0", 1.2)])
def test_the_last_quarter_of_a_real_floor_comes_one_walk_at_a_time(data_folder, floor, tolerance):
    walks = sorted(read_walks([data_folder / floor]), key=lambda walk: walk.name)
    new = walks[3::4]
    old = [walk for walk in walks if walk not in new]
    grown = GrowingMap.of(map_walks(old, KNOWN), old)
    assert all(grown.add(walk).tied for walk in new)
    batch, result = map_walks(walks, KNOWN), grown.result()
    assert mean_error(result, result.walks) < tolerance * mean_error(batch, batch.walks)
    grown.rebuild()
    np.testing.assert_allclose(grown.result().radio_map.poses, batch.radio_map.poses, atol=1e-6)
