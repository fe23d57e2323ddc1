import contextlib
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radioslam.errors import LogError
from radioslam.point_cloud.pcd import lzf_decompress, read_pcd, write_pcd

POINTS = np.random.default_rng(0).uniform(-2, 2, (60, 3)).astype(np.float32)


def lzf_compress(data: bytes) -> bytes:
    """A plain greedy LZF packer, to have something to unpack."""
    out, literals, at, seen = bytearray(), bytearray(), 0, {}

    def flush():
        for k in range(0, len(literals), 32):
            piece = literals[k : k + 32]
            out.append(len(piece) - 1)
            out.extend(piece)
        literals.clear()

    while at < len(data):
        key, before = data[at : at + 3], seen.get(data[at : at + 3])
        seen[key] = at
        if len(key) < 3 or before is None or at - before > 8192:
            literals.append(data[at])
            at += 1
            continue
        length = 3
        while length < 264 and at + length < len(data) and data[before + length] == data[at + length]:
            length += 1
        flush()
        back = at - before - 1
        if length - 2 < 7:
            out += bytes([(length - 2) << 5 | back >> 8, back & 255])
        else:
            out += bytes([7 << 5 | back >> 8, length - 2 - 7, back & 255])
        at += length
    flush()
    return bytes(out)


def header(data, fields="x y z", sizes="4 4 4", types="F F F", counts="1 1 1", width=60, height=1):
    return (
        f"# .PCD v0.7\nVERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\nCOUNT {counts}\nWIDTH {width}\n"
        f"HEIGHT {height}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {width * height}\nDATA {data}\n"
    ).encode()


def write(path, data, points=POINTS, **shape):
    """With a colour before and padding behind the coordinates, as real files have."""
    rows = np.zeros(len(points), np.dtype([("rgb", "<u4"), ("xyz", "<f4", 3), ("pad", "u1", 5)]))
    rows["rgb"], rows["xyz"] = np.arange(len(points)), points
    head = header(data, "rgb x y z _", "4 4 4 4 1", "U F F F U", "1 1 1 1 5", **shape)
    if data == "ascii":
        lines = [f"{r['rgb']} {' '.join(f'{v:.9g}' for v in r['xyz'])} 0 0 0 0 0" for r in rows]
        body = "\n".join(lines).encode()
    elif data == "binary":
        body = rows.tobytes()
    else:
        columns = [rows["rgb"], *(rows["xyz"][:, k] for k in range(3)), rows["pad"]]
        whole = b"".join(column.tobytes() for column in columns)
        packed = lzf_compress(whole)
        body = struct.pack("<II", len(packed), len(whole)) + packed
    path.write_bytes(head + body)
    return path


@pytest.mark.parametrize("data", ["ascii", "binary", "binary_compressed"])
def test_every_encoding_gives_the_same_points(tmp_path, data):
    np.testing.assert_allclose(read_pcd(write(tmp_path / "a.pcd", data)), POINTS, rtol=1e-6)


@pytest.mark.parametrize("data", ["ascii", "binary", "binary_compressed"])
def test_pixels_without_reading_are_left_out_of_organized_clouds_only(tmp_path, data):
    points = POINTS.copy()
    points[::3] = np.nan
    assert len(read_pcd(write(tmp_path / "a.pcd", data, points, width=10, height=6))) == 40
    assert len(read_pcd(write(tmp_path / "b.pcd", data, points))) == 60


@pytest.mark.parametrize("data", ["ascii", "binary", "binary_compressed"])
@pytest.mark.parametrize("cut", [1, 200])
def test_files_that_are_cut_off_are_errors(tmp_path, data, cut):
    path = write(tmp_path / "a.pcd", data)
    path.write_bytes(path.read_bytes()[: -cut if data != "ascii" else -cut * 5])
    with pytest.raises(LogError, match="expected a PCD file with fields x y z"):
        read_pcd(path)


@pytest.mark.parametrize(
    "content",
    [b"", b"FIELDS x y z\n", header("zip"), header("ascii", fields="a b c") + b"1 2 3\n" * 60, b"\xff\xfe\n\n"],
)
def test_what_is_no_pcd_is_one_clear_error(tmp_path, content):
    path = tmp_path / "a.pcd"
    path.write_bytes(content)
    with pytest.raises(LogError, match="expected a PCD file with fields x y z"):
        read_pcd(path)


@settings(deadline=None)
@given(st.binary(max_size=300), st.integers(1, 40))
def test_what_was_packed_is_unpacked(data, repeats):
    whole = data * repeats
    assert lzf_decompress(lzf_compress(whole), len(whole)) == whole


@settings(deadline=None)
@given(st.binary(max_size=60), st.integers(0, 100))
def test_garbage_is_unpacked_to_the_size_it_states_or_refused(data, size):
    with contextlib.suppress(ValueError):
        assert len(lzf_decompress(data, size)) == size


def test_what_is_written_is_read(tmp_path):
    write_pcd(tmp_path / "a.pcd", POINTS)
    np.testing.assert_array_equal(read_pcd(tmp_path / "a.pcd"), POINTS.astype(np.float32))
