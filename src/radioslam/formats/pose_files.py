"""Pose files of ARCore and ARKit loggers -> planar odometry, and which pose file belongs to which scans.

Both frameworks put y up and turn about it as they like; a camera looks along -z of its own axes, a phone's y axis is
its top. The walk's plane is (x, -z), which keeps the frame right-handed with the vertical towards the reader.
Known layouts: a CSV whose header names timestamp, tx, ty, tz, qx, qy, qz, qw in any order (x, y, z without the t too);
``ARCore_sensor_pose.txt`` of ARCore-Data-Logger, ``t qx qy qz qw x y z`` without names; ``ARKit_camera_pose.txt`` of
ARKit-Data-Logger, t and the rows of a 3×4 matrix.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from radioslam.errors import LogError
from radioslam.formats import tum
from radioslam.formats.clocks import STEP_OF_POSES_S, is_time_name, unix_or_boot_s
from radioslam.formats.lines import Layout, Lines, parse, split_lines
from radioslam.formats.loading import load, shown, walk_name
from radioslam.formats.streams import check_unit, make_signal
from radioslam.walk import Signal

Array = NDArray[np.float64]

_POSE = ("tx", "ty", "tz", "qx", "qy", "qz", "qw")
_QUATERNION_FIRST = ("t", "qx", "qy", "qz", "qw", "tx", "ty", "tz")
_MATRIX = ("t", "r11", "r12", "r13", "tx", "r21", "r22", "r23", "ty", "r31", "r32", "r33", "tz")
_NAME = re.compile(r"pose|trajectory|odometry", re.IGNORECASE)
_WORDS = re.compile(
    r"(ar(core|kit))|wi-?fi|scans?|(sensor|camera|device)?[-_. ]?poses?|trajectory|odometry", re.IGNORECASE
)
_BODY_AXES = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])


def sniff(head: bytes) -> bool:
    """Whether the first lines are such a file's; names in TUM's order over rows without commas are TUM's."""
    lines = [line for line in split_lines(head) if line.strip()]
    rows = [line for line in lines if not line.startswith(b"#") and not _is_header(_names(line))]
    if lines and _is_header(_names(lines[0])):
        is_tum = _names(lines[0])[1:] == _POSE and bool(rows) and b"," not in rows[0]
        return not is_tum
    return bool(rows) and _columns_of(rows[0]) is not None


def trajectory_beside(log: Path, notes: list[str]) -> Signal | None:
    """The odometry of the pose file or TUM trajectory that belongs to these scans, if there is one.

    It is that of the same name but for words such as wifi, scans and pose; else the only one in the folder, where the
    scans bear no other name (``wifi.csv`` beside ``ARCore_sensor_pose.txt``).

    Raises:
        LogError: the file is damaged.
    """
    path = poses_of(log)
    if path is None:
        return None
    return tum.read_tum(path, notes) if _is_tum(path) else read_poses(path, notes)


def poses_of(log: Path) -> Path | None:
    """The pose file that belongs to the scans."""
    others = [path for path in sorted(log.parent.iterdir()) if path != log and path.is_file() and is_pose_name(path)]
    same = [path for path in others if _key(path) == _key(log)]
    if not same and not _key(log):
        same = others
    return same[0] if len(same) == 1 else None


def scans_of(poses: Path) -> list[Path]:
    """The files that take these poses for theirs, by their names; whether they hold scans is not judged."""
    others = (path for path in sorted(poses.parent.iterdir()) if _key(path) in (_key(poses), ""))
    return [path for path in others if path.is_file() and not is_pose_name(path) and poses_of(path) == poses]


def is_pose_name(path: Path) -> bool:
    """Whether a file is one of poses by its name."""
    return _is_tum(path) or bool(_NAME.search(walk_name(path)))


def read_poses(path: Path, notes: list[str] | None = None) -> Signal:
    """Planar poses (n, 3): metres and radians in the session's own frame, seen from above.

    The heading is that of the body axis which lies nearest the horizontal over the walk: where the camera looks, the
    top, or the side. It differs from the walking direction by a constant, and from north by what the session chose.

    Raises:
        LogError: a line is damaged, a rotation is none, or times go backwards.
    """
    told: list[str] = [] if notes is None else notes
    lines, columns = _rows(path)
    time_name = next(name for name in columns if is_time_name(name))
    wanted = (time_name, *(name for name in (*_POSE, *_MATRIX[1:]) if name in columns))
    table = parse(lines, Layout(columns, tuple(dict.fromkeys(wanted)), separator=",")).numbers
    value = {name: table[:, k] for k, name in enumerate(dict.fromkeys(wanted))}
    time_s = unix_or_boot_s(lines, value[time_name], time_name, STEP_OF_POSES_S)
    positions = np.column_stack([value["tx"], -value["tz"]])
    heading = _heading(_rotations(lines, value))
    return make_signal(lines, time_s, np.column_stack([positions, heading]), "trajectory", told)


def _rotations(lines: Lines, value: dict[str, Array]) -> Rotation:
    if "qw" in value:
        quaternions = np.column_stack([value[name] for name in ("qx", "qy", "qz", "qw")])
        check_unit(lines, quaternions)
        return Rotation.from_quat(quaternions)
    matrices = np.stack([value[f"r{i}{j}"] for i in (1, 2, 3) for j in (1, 2, 3)], axis=-1).reshape(-1, 3, 3)
    small = np.clip(matrices, -2.0, 2.0)
    off = np.abs(small @ small.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    wrong = (off > 0.1) | (np.linalg.det(small) < 0.5)
    if wrong.any():
        index = int(wrong.argmax())
        raise lines.error(index, "a rotation matrix", f"one off by {off[index]:.2g}", "mend or remove the line")
    return Rotation.from_matrix(small)


def _heading(rotations: Rotation) -> Array:
    axes = [rotations.apply(axis) for axis in _BODY_AXES]
    forward = max(axes, key=lambda axis: float(np.hypot(axis[:, 0], axis[:, 2]).mean()))
    heading: Array = np.arctan2(-forward[:, 2], forward[:, 0])
    return heading


def _rows(path: Path) -> tuple[Lines, tuple[str, ...]]:
    """The lines with commas between their fields, and the names of the columns."""
    columns: tuple[str, ...] | None = None
    lines = Lines(path)
    for number, line in enumerate(split_lines(load(path)), start=1):
        if columns is None and _is_header(_names(line)):
            columns = _names(line)
        elif line.strip() and not line.startswith(b"#"):
            columns = columns or _columns_of(line)
            if columns is None:
                expected = "a header that names timestamp,tx,ty,tz,qx,qy,qz,qw"
                raise LogError(path, expected, shown(line), "name the columns", number)
            lines.add(b",".join(_words(line)), number)
    if columns is None or not len(lines):
        raise LogError(path, "poses", "comments only", "record again")
    return lines, columns


def _words(line: bytes) -> list[bytes]:
    parts = line.split(b",") if b"," in line else line.split()
    return [part.strip() for part in (parts[:-1] if parts and not parts[-1].strip() else parts)]


def _names(line: bytes) -> tuple[str, ...]:
    """Names of columns in a header, lower case, without units in brackets; x, y, z are tx, ty, tz."""
    text = re.sub(r"\s*[\[(]([mun]?s)[\])]", r"_\1", line.decode("utf-8", "replace").lstrip("# ").lower())
    text = re.sub(r"[\[(][^\])]*[\])]", "", text)
    names = [name.strip() for name in re.split(r"[,;]" if "," in text or ";" in text else r"\s+", text.strip())]
    return tuple({"x": "tx", "y": "ty", "z": "tz"}.get(name, name) for name in names)


def _is_header(names: tuple[str, ...]) -> bool:
    """Whether these are a time and a pose, each once."""
    times = [name for name in names if is_time_name(name)]
    return len(times) == 1 and set(_POSE) <= set(names) and len(set(names)) == len(names)


def _columns_of(row: bytes) -> tuple[str, ...] | None:
    """The layout of a row without a header, if it is one of the loggers'; TUM's is not."""
    try:
        values = np.array([float(word) for word in _words(row)])
    except ValueError:
        return None
    if len(values) == len(_MATRIX):
        return _MATRIX
    if len(values) != len(_QUATERNION_FIRST):
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        first, last = np.linalg.norm(values[1:5]), np.linalg.norm(values[4:])
    return _QUATERNION_FIRST if abs(first - 1) < 0.01 <= abs(last - 1) else None


def _is_tum(path: Path) -> bool:
    return path.name.removesuffix(".gz").endswith(".tum")


def _key(path: Path) -> str:
    return re.sub(r"[-_. ]+", "", _WORDS.sub("", walk_name(path))).lower()


def has_own_name(path: Path) -> bool:
    """Whether a file's name tells more than what it holds."""
    return bool(_key(path))
