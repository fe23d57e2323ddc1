"""What one person recorded: radio scans, motion and, if somebody knows them, true positions.

Everything is columnar (one array per quantity), validated once when it is made, and read-only afterwards.
Times are seconds on the log's own clock, RSS is dBm, lengths are metres, angles radians.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from radioslam.errors import LogError

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

RSS_RANGE_DBM = (-127.0, 0.0)
LONGEST_GAP_S = 600.0
"""A motion stream that is silent for longer is two recordings, not one."""


def _column(values: ArrayLike, dtype: type = np.float64) -> Any:
    """A read-only copy."""
    array: NDArray[Any] = np.array(values, dtype=dtype)
    array.setflags(write=False)
    return array


@dataclass(frozen=True)
class Signal:
    """A sampled quantity: ``time_s`` (n,) that does not decrease, ``values`` (n, k), all finite."""

    time_s: Array
    values: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_s", _column(self.time_s))
        object.__setattr__(self, "values", _column(self.values))
        if len(self.time_s) != len(self.values):
            raise ValueError(f"{len(self.time_s)} times but {len(self.values)} values")
        if not (np.isfinite(self.time_s).all() and np.isfinite(self.values).all()):
            raise ValueError("a number is not finite")
        if np.any(np.diff(self.time_s) < 0):
            raise ValueError("times go backwards")

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True)
class Inertial:
    """Raw motion sensors of a phone, in the phone's own axes (Android: x right, y up, z out of the screen).

    Attributes:
        accelerometer: (n, 3) m/s², gravity included.
        gyroscope: (n, 3) rad/s or None.
        magnetometer: (n, 3) µT or None.
        rotation_vector: (n, 4) unit quaternion x, y, z, w from phone to world (east, north, up), or None.
    """

    accelerometer: Signal
    gyroscope: Signal | None = None
    magnetometer: Signal | None = None
    rotation_vector: Signal | None = None


@dataclass(frozen=True)
class RadioScans:
    """Scans of one radio, a row per reading.

    Attributes:
        scan_time_s: (n_scans,) when each scan was read out; increasing.
        reading_scan: (n_readings,) index into ``scan_time_s``, not decreasing.
        reading_transmitter: (n_readings,) index into ``transmitters``.
        rss_dbm: (n_readings,) received strength, in [-127, 0).
        transmitters: identities (BSSID of WiFi; UUID and numbers, or address, of a beacon).
        frequency_mhz: (n_readings,), NaN where unknown.
        last_seen_s: (n_readings,) when the transmitter was really heard, NaN where unknown.
    """

    scan_time_s: Array
    reading_scan: Integers
    reading_transmitter: Integers
    rss_dbm: Array
    transmitters: tuple[str, ...]
    frequency_mhz: Array
    last_seen_s: Array

    @staticmethod
    def from_readings(
        time_s: ArrayLike,
        identity: Sequence[str],
        rss_dbm: ArrayLike,
        frequency_mhz: ArrayLike | None = None,
        last_seen_s: ArrayLike | None = None,
    ) -> RadioScans:
        """Group readings (any order) into scans: readings of one time are one scan.

        A transmitter that stands twice in a scan counts once, with the reading heard last, else the stronger.

        Raises:
            ValueError: a time is not finite or an RSS lies outside [-127, 0).
        """
        time = np.asarray(time_s, dtype=float)
        rss = np.asarray(rss_dbm, dtype=float)
        unknown = np.full(len(time), np.nan)
        frequency = unknown if frequency_mhz is None else np.asarray(frequency_mhz, dtype=float)
        seen = unknown if last_seen_s is None else np.asarray(last_seen_s, dtype=float)
        if not np.isfinite(time).all():
            raise ValueError("a scan time is not finite")
        low, high = RSS_RANGE_DBM
        if not np.all((rss >= low) & (rss < high)):
            worst = rss[~((rss >= low) & (rss < high))][0]
            raise ValueError(f"RSS {worst:g} dBm lies outside [{low:g}, {high:g})")
        names, transmitter = np.unique(np.asarray(identity, dtype=np.str_), return_inverse=True)
        scan_time, scan = np.unique(time, return_inverse=True)
        order = np.lexsort((rss, np.nan_to_num(seen, nan=-np.inf), transmitter, scan))
        key = scan[order] * max(len(names), 1) + transmitter[order]
        keep = order[np.append(key[1:] != key[:-1], True)] if len(key) else order
        return RadioScans(
            scan_time_s=_column(scan_time),
            reading_scan=_column(scan[keep], np.int64),
            reading_transmitter=_column(transmitter[keep], np.int64),
            rss_dbm=_column(rss[keep]),
            transmitters=tuple(names.tolist()),
            frequency_mhz=_column(frequency[keep]),
            last_seen_s=_column(seen[keep]),
        )

    def __len__(self) -> int:
        return len(self.scan_time_s)

    def as_dicts(self) -> list[dict[str, float]]:
        """Transmitter -> RSS in dBm of each scan."""
        scans: list[dict[str, float]] = [{} for _ in range(len(self))]
        for scan, transmitter, rss in zip(self.reading_scan, self.reading_transmitter, self.rss_dbm, strict=True):
            scans[scan][self.transmitters[transmitter]] = float(rss)
        return scans

    @property
    def reading_count(self) -> int:
        """Number of readings over all scans."""
        return len(self.rss_dbm)


@dataclass(frozen=True)
class Reference:
    """True positions: ``time_s`` (n,) increasing, ``positions_xy`` (n, 2) in the building's frame.

    One fix alone is a known start. ``origin_wgs84`` is the latitude and longitude (degrees) of the frame's
    zero where it has one (x east, y north), so that logs of one site can be brought to one frame. ``sigma_m`` is the
    fixes' standard deviation per axis where they were found rather than surveyed, else None.
    """

    time_s: Array
    positions_xy: Array
    origin_wgs84: tuple[float, float] | None = None
    sigma_m: float | None = None

    def __post_init__(self) -> None:
        Signal(self.time_s, self.positions_xy)
        object.__setattr__(self, "time_s", _column(self.time_s))
        object.__setattr__(self, "positions_xy", _column(self.positions_xy))

    def __len__(self) -> int:
        return len(self.time_s)

    def at(self, time_s: Array, max_gap_s: float = np.inf) -> Array:
        """Positions (m, 2), linear between fixes.

        NaN before the first fix, after the last, and between fixes more than ``max_gap_s`` apart.
        """
        x, y = (np.interp(time_s, self.time_s, c, left=np.nan, right=np.nan) for c in self.positions_xy.T)
        positions = np.stack([x, y], axis=-1)
        after = np.searchsorted(self.time_s, time_s).clip(1, max(len(self) - 1, 1))
        if len(self) > 1:
            gap_s = self.time_s[after] - self.time_s[after - 1]
            exact = np.isin(time_s, self.time_s)
            positions[(gap_s > max_gap_s) & ~exact] = np.nan
        return positions

    def with_origin(self, origin_wgs84: tuple[float, float]) -> Reference:
        """The same positions in the frame whose zero lies at another latitude and longitude."""
        if self.origin_wgs84 is None or self.origin_wgs84 == origin_wgs84:
            return self
        from pymap3d import geodetic2enu

        east, north, _ = geodetic2enu(*self.origin_wgs84, 0.0, *origin_wgs84, 0.0)
        return replace(self, positions_xy=self.positions_xy + np.array([east, north]), origin_wgs84=origin_wgs84)


@dataclass(frozen=True)
class Walk:
    """One person's walk.

    Attributes:
        name: the log's file name without its endings; unique within a map.
        wifi: WiFi scans.  ble: scans of Bluetooth beacons, or None.
        odometry: planar poses (x, y, θ) of a tracker as a Signal (n, 3), or None.
        inertial: raw sensors, or None. At least one of ``odometry`` and ``inertial`` is needed for mapping.
        reference: true positions, or None.
        device: the phone's model, "" if unknown.  floor: the floor's label, "" if unknown.
        path: the file that it was read from, or None.
        notes: oddities that the reader mended or left out, for people to read.
    """

    name: str
    wifi: RadioScans
    ble: RadioScans | None = None
    odometry: Signal | None = None
    inertial: Inertial | None = None
    reference: Reference | None = None
    device: str = ""
    floor: str = ""
    path: Path | None = None
    notes: tuple[str, ...] = field(default=())

    @property
    def start_s(self) -> float:
        """The earliest time of motion or scan."""
        return float(min(clock[0] for clock in self._clocks()))

    @property
    def duration_s(self) -> float:
        """Seconds from the first to the last time of motion or scan."""
        return float(max(clock[-1] for clock in self._clocks())) - self.start_s

    @property
    def motion(self) -> Signal | None:
        """The stream that tells how the walker moved: the odometry, else the accelerometer."""
        if self.odometry is not None:
            return self.odometry
        return self.inertial.accelerometer if self.inertial else None

    def _clocks(self) -> Iterable[Array]:
        clocks = [self.wifi.scan_time_s] + ([self.motion.time_s] if self.motion else [])
        return [clock for clock in clocks if len(clock)] or [np.zeros(1)]


def check_walk(walk: Walk) -> Walk:
    """Return the walk if it can be mapped.

    Raises:
        LogError: no scans, no motion, or a motion stream with a gap beyond ``LONGEST_GAP_S``.
    """
    path = walk.path or walk.name
    if not len(walk.wifi):
        raise LogError(path, "WiFi scans", "none", "record with location and WiFi switched on")
    motion = walk.motion
    if motion is None or len(motion) < 2:
        advice = "record inertial sensors with the scans"
        if walk.reference is not None and len(walk.reference) > 1:
            advice += ", or make a survey of the known positions (radioslam survey)"
        raise LogError(path, "motion (odometry or accelerometer)", "none", advice)
    gaps = np.diff(motion.time_s)
    if gaps.max() > LONGEST_GAP_S:
        jump = f"a jump of {gaps.max():.0f} s after t = {motion.time_s[gaps.argmax()]:.3f} s"
        raise LogError(path, f"motion without gaps over {LONGEST_GAP_S:g} s", jump, "split the log there")
    scans_s = walk.wifi.scan_time_s
    if not np.any((scans_s >= motion.time_s[0]) & (scans_s <= motion.time_s[-1])):
        raise LogError(path, "scans during the motion", "two clocks that never meet", "put both on one clock")
    return walk
