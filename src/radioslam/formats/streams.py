"""Parsed columns -> motion signals, radio scans and references; here impossible values are found."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from radioslam.formats.lines import Lines
from radioslam.walk import RSS_RANGE_DBM, RadioScans, Reference, Signal

Array = NDArray[np.float64]

BACKWARD_TOLERANCE_S = 1.0
"""Samples that come later by less are sorted, as sensor queues do that; by more, the clock was set."""
PHONE_SENTINELS_DBM = (0.0, 127.0)
"""What phones report as RSS when they have none."""
ONE_SCAN_S = 0.5
"""Readings that follow the first of a scan by less belong to it."""
_LARGEST_TIME_S = 1e11
_LARGEST_VALUE = 1e6
_LARGEST_POSITION_M = 1e6


def make_signal(lines: Lines, time_s: Array, values: Array, what: str, notes: list[str]) -> Signal:
    """A motion stream in the order of its time.

    Raises:
        LogError: a time or value that cannot be, or times that go backwards by more than a second.
    """
    check_times(lines, time_s)
    worst = np.abs(values).max(axis=1, initial=0.0)
    if np.any(worst > _LARGEST_VALUE):
        index = int(worst.argmax())
        expected = f"{what} values below {_LARGEST_VALUE:g}"
        raise lines.error(index, expected, f"{worst[index]:g}", "mend or remove the line")
    late_s = np.maximum.accumulate(time_s) - time_s
    if not np.any(late_s > 0):
        return Signal(time_s, values)
    if late_s.max() > BACKWARD_TOLERANCE_S:
        index = int(np.argmax(late_s > BACKWARD_TOLERANCE_S))
        found = f"a time {late_s[index]:.3f} s before an earlier line's"
        raise lines.error(index, f"{what} times that do not go backwards", found, "split the log there")
    notes.append(f"{what}: {np.sum(late_s > 0)} samples up to {late_s.max():.3f} s out of order, sorted")
    order = np.argsort(time_s, kind="stable")
    return Signal(time_s[order], values[order])


def unit_quaternions(lines: Lines, vectors: Array) -> Array:
    """(n, 4) unit quaternions x, y, z, w >= 0 from the vector parts (n, 3), as Android gives them.

    Raises:
        LogError: a vector part longer than rounding explains.
    """
    length = np.abs(vectors).max(axis=1, initial=0.0)
    index = int(length.argmax()) if len(length) else 0
    if np.any(length > 1.05):
        found, advice = f"a component {length[index]:g}", "mend or remove the line"
        raise lines.error(index, "a rotation vector within the unit sphere", found, advice)
    w = np.sqrt(np.clip(1.0 - np.sum(vectors**2, axis=1), 0.0, 1.0))
    quaternions = np.column_stack([vectors, w])
    norm: Array = np.linalg.norm(quaternions, axis=1, keepdims=True)
    return quaternions / norm


def check_unit(lines: Lines, quaternions: Array) -> None:
    """Raise LogError unless all quaternions (n, 4) have length one within a tenth."""
    largest = np.abs(quaternions).max(axis=1, initial=0.0)
    length = np.linalg.norm(np.minimum(np.abs(quaternions), 2.0), axis=1)
    wrong = (largest > 1.1) | (np.abs(length - 1.0) > 0.1)
    if wrong.any():
        index = int(wrong.argmax())
        found, advice = f"one of length {length[index]:.3g}", "mend or remove the line"
        raise lines.error(index, "a unit quaternion x, y, z, w", found, advice)


def make_scans(
    lines: Lines,
    time_s: Array,
    identity: list[str],
    rss_dbm: Array,
    frequency_mhz: Array | None = None,
    last_seen_s: Array | None = None,
    sentinels: Collection[float] = (),
    notes: list[str] | None = None,
) -> RadioScans:
    """Radio scans; readings whose RSS is exactly one of ``sentinels`` are left out with a note.

    Raises:
        LogError: an RSS outside [-127, 0) or a time that cannot be.
    """
    check_times(lines, time_s)
    unset = np.isin(rss_dbm, list(sentinels))
    low, high = RSS_RANGE_DBM
    wrong = ~((rss_dbm >= low) & (rss_dbm < high)) & ~unset
    if wrong.any():
        index = int(wrong.argmax())
        expected = f"RSS in [{low:g}, {high:g}) dBm"
        raise lines.error(index, expected, f"{rss_dbm[index]:g}", "mend or remove the line")
    if not unset.any():
        return RadioScans.from_readings(time_s, identity, rss_dbm, frequency_mhz, last_seen_s)
    if notes is not None:
        notes.append(f"{unset.sum()} readings without RSS (0 or 127) left out")
    kept = ~unset
    return RadioScans.from_readings(
        time_s[kept],
        np.asarray(identity, dtype=np.str_)[kept].tolist(),
        rss_dbm[kept],
        None if frequency_mhz is None else frequency_mhz[kept],
        None if last_seen_s is None else last_seen_s[kept],
    )


def group_scan_times(time_s: Array, within_s: float = ONE_SCAN_S) -> Array:
    """For each reading (n,) the time of the first reading of its scan."""
    unique_s, index = np.unique(time_s, return_inverse=True)
    first_s = unique_s.copy()
    for i in range(1, len(unique_s)):
        if unique_s[i] - first_s[i - 1] < within_s:
            first_s[i] = first_s[i - 1]
    grouped: Array = first_s[index]
    return grouped


def make_reference(
    lines: Lines,
    time_s: Array,
    positions_xy: Array,
    notes: list[str],
    origin_wgs84: tuple[float, float] | None = None,
    sigma_m: float | None = None,
) -> Reference | None:
    """True positions in the order of time; of fixes with one time the first counts. None if there are none.

    Raises:
        LogError: a coordinate or time that cannot be.
    """
    if not len(lines):
        return None
    check_times(lines, time_s)
    worst = np.abs(positions_xy).max(axis=1)
    if worst.max() > _LARGEST_POSITION_M:
        index = int(worst.argmax())
        expected = f"a position within {_LARGEST_POSITION_M:g} m"
        raise lines.error(index, expected, f"{worst[index]:g} m", "mend or remove the line")
    if np.any(np.diff(time_s) < 0):
        notes.append("reference positions were not in the order of time, sorted")
    unique_s, first = np.unique(time_s, return_index=True)
    if len(unique_s) < len(time_s):
        notes.append(f"{len(time_s) - len(unique_s)} reference positions with the time of another left out")
    return Reference(unique_s, positions_xy[first], origin_wgs84, sigma_m)


def check_times(lines: Lines, time_s: Array) -> None:
    """Raise LogError if a time is beyond thousands of years."""
    wrong = np.abs(time_s) > _LARGEST_TIME_S
    if wrong.any():
        index = int(wrong.argmax())
        raise lines.error(index, "a time in seconds", f"{time_s[index]:g}", "mend or remove the line")
