"""Recorded or simulated walks played against a service as phones would.

Each phone sends a batch every ``batch_s`` of its walk and repeats it, with growing pauses, until it is acknowledged, as
an app does that loses its network; so a service that is killed and started again gets all the same.
"""

from __future__ import annotations

import asyncio
import itertools
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import httpx2
import numpy as np
from numpy.typing import NDArray

from radioslam.config import load_config
from radioslam.errors import UnavailableError
from radioslam.odometry import estimate_odometry
from radioslam.server.recordings import SENSORS
from radioslam.walk import RadioScans, Signal, Walk

Array = NDArray[np.float64]
Json = dict[str, Any]
POSE_EVERY_S = 1.0
PATIENCE_S = 120.0
"""A phone that gets no answer for so long gives up."""
TRANSIENT = (408, 425, 429, 500, 502, 503, 504, 507)


@dataclass
class Tally:
    """What the phones saw."""

    delays_s: list[float] = field(default_factory=list)
    statuses: Counter[str] = field(default_factory=Counter)
    acknowledged: set[tuple[str, int]] = field(default_factory=set)
    started_s: float = field(default_factory=time.perf_counter)

    def as_dict(self) -> Json:
        """Counts, rates, and quantiles of the time until a batch was acknowledged or refused."""
        seconds = time.perf_counter() - self.started_s
        delays_ms = 1000 * np.array(self.delays_s or [np.nan])
        quantiles = {f"p{q}_ms": round(float(np.quantile(delays_ms, q / 100)), 1) for q in (50, 95, 99)}
        return {
            "seconds": round(seconds, 1),
            "batches": len(self.acknowledged),
            "requests": len(self.delays_s),
            "requests_per_s": round(len(self.delays_s) / seconds, 1),
            **quantiles,
            "max_ms": round(float(delays_ms.max()), 1),
            "answers": dict(sorted(self.statuses.items())),
        }


@dataclass(frozen=True)
class Replay:
    """How walks are played; see ``radioslam replay --help``."""

    url: str
    site: str = "replay"
    starts: str = "unknown"
    speed: float = 1.0
    phones: int | None = None
    duration_s: float | None = None
    batch_s: float = 5.0
    inertial: bool = False
    key: str | None = None
    on_acknowledged: Callable[[str, int], None] | None = None

    def run(self, walks: Sequence[Walk]) -> Json:
        """Play the walks; the tally as JSON.

        Raises:
            UnavailableError: the service refuses, or does not answer for a long time.
        """
        return asyncio.run(self.play(walks)).as_dict()

    async def play(self, walks: Sequence[Walk]) -> Tally:
        """The same within an event loop."""
        walks = walks if self.inertial else with_poses(walks)
        tally = Tally()
        headers = {"Authorization": f"Bearer {self.key}"} if self.key else {}
        limits = httpx2.Limits(max_connections=None, max_keepalive_connections=None)
        async with httpx2.AsyncClient(base_url=self.url, headers=headers, limits=limits, timeout=30.0) as client:
            phone = _Phone(self, client, tally)
            await phone.make_site()
            coming = self._walks(walks)
            count = self.phones or len(walks)
            async with asyncio.TaskGroup() as group:
                for k in range(count):
                    group.create_task(self._one_phone(phone, coming, k / count))
        return tally

    def _walks(self, walks: Sequence[Walk]) -> Iterator[Walk]:
        """Each walk once; to fill phones or time again and again under new names."""
        least = self.phones or len(walks)
        for turn in itertools.count():
            for k, walk in enumerate(walks):
                if turn and self.duration_s is None and turn * len(walks) + k >= least:
                    return
                yield walk if not turn else replace(walk, name=f"{walk.name}-{turn}")

    async def _one_phone(self, phone: _Phone, coming: Iterator[Walk], phase: float) -> None:
        await asyncio.sleep(phase * self.batch_s / self.speed)
        until_s = None if self.duration_s is None else time.perf_counter() + self.duration_s
        for walk in coming:
            await phone.walk(walk, until_s)
            if until_s is not None and time.perf_counter() >= until_s:
                return


def with_poses(walks: Sequence[Walk]) -> list[Walk]:
    """Walks with a tracker's odometry: their own, or by dead reckoning; one pose per second, no raw sensors."""
    odometry = load_config(environment={}).odometry
    played = []
    for track in estimate_odometry(walks, odometry):
        time_s = np.arange(track.time_s[0], track.time_s[-1], POSE_EVERY_S)
        played.append(replace(track.walk, odometry=Signal(time_s, track.at(time_s)), inertial=None))
    return played


@dataclass(frozen=True)
class _Phone:
    settings: Replay
    client: httpx2.AsyncClient
    tally: Tally

    async def make_site(self) -> None:
        await self._post("/sites", {"id": self.settings.site, "starts": self.settings.starts}, accepted=(403, 409))

    async def walk(self, walk: Walk, until_s: float | None) -> None:
        """Send one walk in its own time; cut short at ``until_s``."""
        place = f"/sites/{self.settings.site}/walks"
        await self._post(place, {"name": walk.name, "device": walk.device, "floor": walk.floor})
        begun_s, sent = time.perf_counter(), 0
        for sequence, (after_s, batch) in enumerate(batches(walk, self.settings.batch_s)):
            await asyncio.sleep(begun_s + after_s / self.settings.speed - time.perf_counter())
            if until_s is not None and time.perf_counter() >= until_s:
                break
            await self._post(f"{place}/{walk.name}/batches", batch, timed=True)
            self._acknowledged(walk.name, sequence)
            sent = sequence + 1
        await self._post(f"{place}/{walk.name}/finish", {"batches": sent})

    def _acknowledged(self, walk: str, sequence: int) -> None:
        self.tally.acknowledged.add((walk, sequence))
        if self.settings.on_acknowledged:
            self.settings.on_acknowledged(walk, sequence)

    async def _post(self, path: str, body: Json, timed: bool = False, accepted: tuple[int, ...] = ()) -> None:
        started_s, pause_s = time.perf_counter(), 0.1
        while True:
            begun_s = time.perf_counter()
            status, text = await self._try(path, body)
            if timed:
                self.tally.delays_s.append(time.perf_counter() - begun_s)
            self.tally.statuses[str(status)] += 1
            if 200 <= status < 300 or status in accepted:
                return
            if status and status not in TRANSIENT:
                raise UnavailableError(f"{path}: expected the service to accept it, found {status}: {text}")
            if time.perf_counter() - started_s > PATIENCE_S:
                raise UnavailableError(f"{self.settings.url}: expected an answer, found {text}; is the service up?")
            await asyncio.sleep(pause_s)
            pause_s = min(2 * pause_s, 2.0)

    async def _try(self, path: str, body: Json) -> tuple[int, str]:
        try:
            response = await self.client.post(path, json=body)
        except httpx2.TransportError as error:
            return 0, str(error) or type(error).__name__
        return response.status_code, response.text[:500]


def batches(walk: Walk, batch_s: float) -> Iterator[tuple[float, Json]]:
    """What a phone sends: seconds after the walk's begin, and the batch of what was recorded by then."""
    start_s = walk.start_s
    for sequence in range(int(walk.duration_s // batch_s) + 1):
        low_s, high_s = start_s + sequence * batch_s, start_s + (sequence + 1) * batch_s
        yield min((sequence + 1) * batch_s, walk.duration_s), _batch(walk, sequence, low_s, high_s)


def _batch(walk: Walk, sequence: int, low_s: float, high_s: float) -> Json:
    body: Json = {"sequence": sequence, "scans": _scans(walk.wifi, low_s, high_s)}
    if walk.odometry is not None:
        here = _within(walk.odometry.time_s, low_s, high_s)
        names = ("time_s", "x_m", "y_m", "heading_rad")
        rows = np.column_stack([walk.odometry.time_s, walk.odometry.values])[here].tolist()
        body["poses"] = [dict(zip(names, row, strict=True)) for row in rows]
    if walk.ble is not None:
        body["beacons"] = _scans(walk.ble, low_s, high_s)
    if walk.inertial is not None:
        body["inertial"] = {
            sensor: _samples(signal, low_s, high_s)
            for sensor in SENSORS
            if (signal := getattr(walk.inertial, sensor)) is not None
        }
    return body | _fixes(walk, low_s, high_s)


def _fixes(walk: Walk, low_s: float, high_s: float) -> Json:
    known = walk.reference
    if known is None:
        return {}
    here = _within(known.time_s, low_s, high_s)
    rows = np.column_stack([known.time_s, known.positions_xy])[here].tolist()
    body: Json = {"fixes": [dict(zip(("time_s", "x_m", "y_m"), row, strict=True)) for row in rows]}
    if known.origin_wgs84:
        body["fix_origin"] = dict(zip(("latitude_deg", "longitude_deg"), known.origin_wgs84, strict=True))
    return body if rows else {}


def _within(time_s: Array, low_s: float, high_s: float) -> slice:
    return slice(*np.searchsorted(time_s, [low_s, high_s]))


def _samples(signal: Signal, low_s: float, high_s: float) -> Json:
    here = _within(signal.time_s, low_s, high_s)
    return {"time_s": signal.time_s[here].tolist(), "values": signal.values[here].tolist()}


def _scans(scans: RadioScans, low_s: float, high_s: float) -> list[Json]:
    found = []
    here = _within(scans.scan_time_s, low_s, high_s)
    for k in range(here.start, here.stop):
        rows = slice(*np.searchsorted(scans.reading_scan, [k, k + 1]))
        found.append({"time_s": float(scans.scan_time_s[k]), "readings": _readings(scans, rows)})
    return found


def _readings(scans: RadioScans, rows: slice) -> list[Json]:
    names = [scans.transmitters[k] for k in scans.reading_transmitter[rows]]
    columns = {
        "rssi_dbm": scans.rss_dbm[rows],
        "frequency_mhz": scans.frequency_mhz[rows],
        "last_seen_s": scans.last_seen_s[rows],
    }
    readings: list[Json] = [{"bssid": name} for name in names]
    for key, column in columns.items():
        for reading, value in zip(readings, column.tolist(), strict=True):
            if not np.isnan(value):
                reading[key] = value
    return readings
