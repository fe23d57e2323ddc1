"""Arrays in a store, wherever it is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays_of

from radioslam.errors import ResultError
from radioslam.object_store import ObjectStore

pytest.importorskip("fsspec")


@settings(deadline=None, max_examples=30)
@given(
    arrays_of.arrays(np.float64, arrays_of.array_shapes(min_dims=0, max_dims=3, min_side=0)),
    arrays_of.arrays(np.int64, st.integers(0, 5)),
    arrays_of.arrays(np.bool_, st.integers(0, 5)),
)
def test_arrays_come_back_as_they_went(values, numbers, flags):
    store = ObjectStore("memory://tests")
    store.write("one", {"values": values, "numbers": numbers, "flags": flags, "text": np.array(["a = 'b'"])})
    read = store.read("one")
    np.testing.assert_array_equal(read["values"], values)
    assert read["values"].shape == values.shape
    np.testing.assert_array_equal(read["numbers"], numbers)
    np.testing.assert_array_equal(read["flags"], flags)
    assert read["text"][0] == "a = 'b'"


def test_names_can_be_replaced_and_removed_and_nothing_else_stays(tmp_path):
    store = ObjectStore(str(tmp_path / "store"))
    for number in (1, 2):
        store.write("one", {"x": np.array([number])})
    assert store.read("one")["x"].tolist() == [2]
    store.remove("one")
    assert list((tmp_path / "store").iterdir()) == []
    with pytest.raises(ResultError, match="expected the arrays 'one'"):
        store.read("one")


def test_a_file_cut_short_is_refused(tmp_path):
    store = ObjectStore(str(tmp_path))
    store.write("one", {"x": np.arange(1000)})
    path = tmp_path / "one.parquet"
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(ResultError, match="expected the arrays 'one'"):
        store.read("one")


def test_folders_take_the_place_of_older_ones(tmp_path):
    store = ObjectStore(str(tmp_path / "store"))
    for text in ("old", "new"):
        source = tmp_path / text
        (source / "deeper").mkdir(parents=True)
        (source / "deeper" / text).write_text(text)
        store.put_folder(source, "result")
    assert [path.name for path in (tmp_path / "store").rglob("*") if path.is_file()] == ["new"]
    assert (tmp_path / "store" / "result" / "deeper" / "new").read_text() == "new"
