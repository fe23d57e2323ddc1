from __future__ import annotations

import pytest

from radioslam.errors import ResultError
from radioslam.whole_files import whole_file


def test_a_file_takes_its_place_when_the_block_ends_well(tmp_path):
    path = tmp_path / "map.csv"
    path.write_text("old")
    with whole_file(path) as partial:
        partial.write_text("new")
        assert path.read_text() == "old"
        assert partial.suffix == ".csv"
    assert [file.read_text() for file in tmp_path.iterdir()] == ["new"]


def test_what_fails_half_way_leaves_the_old_file(tmp_path):
    path = tmp_path / "map.csv"
    path.write_text("old")

    def write_half():
        with whole_file(path) as partial:
            partial.write_text("ne")
            raise ValueError("half way")

    with pytest.raises(ValueError, match="half way"):
        write_half()
    assert [file.read_text() for file in tmp_path.iterdir()] == ["old"]


def test_a_disk_that_refuses_is_one_clear_error(tmp_path):
    with pytest.raises(ResultError, match="could not be written"), whole_file(tmp_path / "nowhere" / "map.csv"):
        pass
