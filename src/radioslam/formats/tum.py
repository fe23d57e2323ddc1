"""TUM trajectories, ``t x y z qx qy qz qw`` per line, and the planar poses in them."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from radioslam import rigid
from radioslam.formats.lines import Layout, Lines, parse, split_lines
from radioslam.formats.loading import load
from radioslam.formats.streams import check_unit, make_signal
from radioslam.walk import Signal

Array = NDArray[np.float64]

_COLUMNS = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")
_LAYOUT = Layout(_COLUMNS, _COLUMNS, separator=" ")


def sniff(head: bytes) -> bool:
    """Whether the first line that is no comment holds eight numbers."""
    lines = [line for line in split_lines(head) if line.strip() and not line.startswith(b"#")]
    try:
        return bool(lines) and len([float(word) for word in lines[0].split()]) == len(_COLUMNS)
    except ValueError:
        return False


def read_tum(source: Path | str | bytes, notes: list[str] | None = None) -> Signal:
    """Planar poses (n, 3): x, y in metres and the yaw of the pose's x axis in radians.

    Args:
        source: a file, or its bytes.
        notes: is told of samples that were sorted.

    Raises:
        LogError: a line is not eight finite numbers, a quaternion has not length one, or times go backwards.
    """
    lines, numbers = _parsed(source)
    poses = np.column_stack([numbers[:, 1:3], yaw(numbers[:, 4:])])
    return make_signal(lines, numbers[:, 0], poses, "trajectory", [] if notes is None else notes)


def read_spatial_tum(source: Path | str | bytes) -> tuple[Array, Array]:
    """Times (n,), increasing, and poses (n, 4, 4) in space; raises as ``read_tum`` does."""
    lines, numbers = _parsed(source)
    signal = make_signal(lines, numbers[:, 0], numbers[:, 1:], "trajectory", [])
    fresh = np.append(True, np.diff(signal.time_s) > 0)
    rows = signal.values[fresh]
    return signal.time_s[fresh], rigid.from_quaternions(rows[:, :3], rows[:, 3:])


def _parsed(source: Path | str | bytes) -> tuple[Lines, Array]:
    path = Path("<bytes>") if isinstance(source, bytes) else Path(source)
    data = source if isinstance(source, bytes) else load(path)
    lines = Lines(path)
    for number, line in enumerate(split_lines(data), start=1):
        if line.strip() and not line.startswith(b"#"):
            lines.add(b" ".join(line.split()), number)
    numbers = parse(lines, _LAYOUT).numbers
    check_unit(lines, numbers[:, 4:])
    return lines, numbers


def write_tum(target: Path | str | TextIO, time_s: Array, poses: Array) -> None:
    """Write planar poses (n, 3) at times (n,); the same poses give the same bytes."""
    half = poses[:, 2] / 2
    metres = np.round(np.column_stack([time_s, poses[:, :2]]), 6) + 0.0  # no -0
    rows = np.column_stack([metres, np.round(np.column_stack([np.sin(half), np.cos(half)]), 9) + 0.0])
    text = "".join(f"{t:.6f} {x:.6f} {y:.6f} 0 0 0 {qz:.9f} {qw:.9f}\n" for t, x, y, qz, qw in rows.tolist())
    if isinstance(target, (str, Path)):
        Path(target).write_text(text, encoding="utf-8", newline="\n")
    else:
        target.write(text)


def write_spatial_tum(path: Path, time_s: Array, T: Array) -> None:
    """Write poses (n, 4, 4) in space at times (n,)."""
    metres = np.round(np.column_stack([time_s, T[:, :3, 3]]), 6) + 0.0
    rows = np.column_stack([metres, np.round(rigid.quaternions(T), 9) + 0.0])
    lines = (" ".join([*(f"{v:.6f}" for v in row[:4]), *(f"{v:.9f}" for v in row[4:])]) for row in rows.tolist())
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8", newline="\n")


def yaw(quaternions: Array) -> Array:
    """Heading (n,) of the x axis after rotation by quaternions x, y, z, w (n, 4)."""
    x, y, z, w = (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).T
    heading: Array = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return heading
