import gzip
from pathlib import Path

import pytest

from radioslam.errors import LogError
from radioslam.formats.loading import HEAD_BYTES, load, load_head, walk_name

TEXT = b"some text\n" * 10_000


@pytest.fixture
def path(tmp_path):
    return tmp_path / "walk.txt.gz"


def test_gzip_and_plain_text_are_the_same(tmp_path, path):
    path.write_bytes(gzip.compress(TEXT))
    plain = tmp_path / "walk.txt"
    plain.write_bytes(TEXT)
    assert load(path) == load(plain) == TEXT
    assert load_head(path) == load_head(plain) == TEXT[:HEAD_BYTES]


def test_gzip_is_told_by_content_not_by_name(tmp_path):
    unnamed = tmp_path / "walk.txt"
    unnamed.write_bytes(gzip.compress(TEXT))
    assert load(unnamed) == TEXT


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "found an empty file"),
        (gzip.compress(b" \n", mtime=0), "found an empty file"),
        (TEXT, "expected gzip data, found something else"),
        (gzip.compress(TEXT, mtime=0)[:-20], "found a file cut short"),
        (gzip.compress(TEXT, mtime=0)[:30] + b"xxxxxx" + gzip.compress(TEXT, mtime=0)[36:], "found damage"),
        (gzip.compress(b"a\0b", mtime=0), "found binary data; export the log as UTF-8 text"),
    ],
)
def test_what_is_no_text(path, content, message):
    path.write_bytes(content)
    with pytest.raises(LogError) as error:
        load(path)
    assert message in str(error.value)
    assert str(error.value).startswith(f"{path}: expected")


def test_what_is_no_file(tmp_path):
    with pytest.raises(LogError, match="no such file"):
        load(tmp_path / "nowhere.txt")
    with pytest.raises(LogError, match="is a directory"):
        load(tmp_path)
    with pytest.raises(LogError, match="no such file"):
        load_head(tmp_path / "nowhere.txt")


@pytest.mark.parametrize(
    ("name", "walk"),
    [("a.txt.gz", "a"), ("a.b.csv", "a.b"), ("a.scans.csv.gz", "a"), ("a.tum", "a"), ("a", "a"), (".txt", ".txt")],
)
def test_walks_are_named_after_their_log(name, walk):
    assert walk_name(Path("folder") / name) == walk
