"""Times whose unit nobody wrote down."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from radioslam.formats.lines import Lines
from radioslam.formats.streams import check_times

Array = NDArray[np.float64]

_TIME_NAME = re.compile(r"(time|time_?stamp|t|secs?|seconds)(_?(s|ms|us|ns|nanos|millis|sec|seconds))?")
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_ENDINGS = {"_s": "s", "_sec": "s", "ms": "ms", "millis": "ms", "_us": "us", "ns": "ns", "nanos": "ns"}
STEP_OF_POSES_S = 0.003
"""Poses come at 1 to 300 Hz: the median step lies within a thousand times this, so one unit alone fits."""
STEP_OF_SCANS_S = 0.1
"""WiFi scans come every 0.1 to 100 s."""


def is_time_name(name: str) -> bool:
    """Whether a column of this name, in lower case, holds times."""
    return _TIME_NAME.fullmatch(name) is not None


def unix_or_boot_s(lines: Lines, times: Array, name: str, least_step_s: float) -> Array:
    """Times (n,) in seconds: in the unit that the column's name ends with, else in that which their steps tell.

    The units are a thousandfold apart, and so are the bounds of a plausible median step: exactly one unit fits, or
    the nearest is taken. A clock that never moves is taken for Unix time by its size.

    Raises:
        LogError: a time that cannot be.
    """
    told = next((unit for ending, unit in _ENDINGS.items() if name.endswith(ending)), None)
    scale = SECONDS[told or _unit_of(times, least_step_s)]
    time_s = times * scale
    check_times(lines, time_s)
    return time_s


def _unit_of(times: Array, least_step_s: float) -> str:
    steps = np.diff(np.unique(times))
    if not len(steps):
        largest = np.abs(times).max(initial=0.0)
        return next((unit for unit, of in SECONDS.items() if largest * of < 1e10), "ns")
    step = float(np.median(steps))
    return next((unit for unit, of in SECONDS.items() if step * of < 1e3 * least_step_s), "ns")
