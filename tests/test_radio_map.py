from __future__ import annotations

from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from radioslam.errors import ResultError
from radioslam.radio_map import RadioMap
from tests.crowds import office_result


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "radio_map.parquet"
    office_result().radio_map.save(path)
    return path


def test_a_saved_map_is_loaded_as_it_was(saved):
    ours, loaded = office_result().radio_map, RadioMap.load(saved)
    assert loaded.walks == ours.walks
    for name in ("walk", "time_s", "poses", "sigma_m", "map"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(ours, name))
    heard = np.flatnonzero(np.bincount(ours.rss_dbm.indices, minlength=len(ours.transmitters)))
    assert loaded.transmitters == tuple(ours.transmitters[k] for k in heard)
    np.testing.assert_allclose(loaded.rss_dbm.toarray(), ours.rss_dbm[:, heard].toarray(), rtol=1e-6)


def test_other_tools_find_a_row_per_sample_with_its_readings(saved):
    table = pq.read_table(saved)
    ours = office_result().radio_map
    assert table.num_rows == len(ours)
    row = table.slice(5, 1).to_pylist()[0]
    here = slice(*ours.rss_dbm.indptr[5:7])
    assert row["transmitter"] == [ours.transmitters[k] for k in ours.rss_dbm.indices[here]]
    assert row["x_m"] == ours.poses[5, 0]
    assert row["walk"] == ours.walks[ours.walk[5]]


def test_samples_that_heard_nothing_are_kept(tmp_path):
    ours = office_result().radio_map
    silent = replace(ours, rss_dbm=0 * ours.rss_dbm)
    silent.rss_dbm.eliminate_zeros()
    silent.save(tmp_path / "m.parquet")
    loaded = RadioMap.load(tmp_path / "m.parquet")
    assert loaded.rss_dbm.shape == (len(ours), 0)


def test_a_file_cut_short_is_one_clear_error(saved):
    saved.write_bytes(saved.read_bytes()[:1000])
    with pytest.raises(ResultError, match="expected a radio map"):
        RadioMap.load(saved)


def test_a_missing_file_is_one_clear_error(tmp_path):
    with pytest.raises(ResultError, match=r"nowhere\.parquet"):
        RadioMap.load(tmp_path / "nowhere.parquet")


def test_a_map_of_a_newer_version_says_what_to_do(saved):
    table = pq.read_table(saved)
    pq.write_table(table.replace_schema_metadata({"radioslam_radio_map": "99"}), saved)
    with pytest.raises(ResultError, match="version 99; update radioslam"):
        RadioMap.load(saved)


def test_any_other_parquet_is_refused(saved):
    pq.write_table(pa.table({"x": [1]}), saved)
    with pytest.raises(ResultError, match="version none"):
        RadioMap.load(saved)
