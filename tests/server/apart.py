"""How far apart two maps of the same walks are."""

from __future__ import annotations

import numpy as np

from radioslam import planar
from radioslam.results import SlamResult


def apart_m(one: SlamResult, other: SlamResult, aligned: bool) -> float:
    """Mean distance between the positions at all scans that both tie; ``aligned`` lays one onto the other rigidly."""
    assert one.walks == other.walks
    np.testing.assert_array_equal(one.radio_map.time_s, other.radio_map.time_s)
    tied = (one.radio_map.map == 0) & (other.radio_map.map == 0)
    a, b = one.radio_map.poses[tied, :2], other.radio_map.poses[tied, :2]
    if aligned:
        pose = planar.align_rigid(a, b)
        a = planar.rotate(pose[2], a) + pose[:2]
    return float(np.hypot(*(a - b).T).mean())
