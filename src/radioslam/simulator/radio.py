"""What a phone hears: the multi-wall model, shadowing, fading and the receiver.

    rss = P - PL0(f) - 10 n log10(d) - c d - L_walls - L_floors + shadowing + fading + device offset

with PL0(f) = 20 log10(f / MHz) - 27.55 dB, the free-space loss over the first metre.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from radioslam.simulator.access_points import Transmitters
from radioslam.simulator.building import Building
from radioslam.simulator.shadowing import ShadowFields, shadow_fields
from radioslam.simulator.streams import random_stream

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

PHONE_HEIGHT_M = 1.2
"""In the hand, above the floor."""
WEAKEST_DBM = -127.0
"""What a phone can report at the least."""


@dataclass(frozen=True)
class Propagation:
    """How radio spreads in a building.

    Attributes:
        exponent: path-loss exponent n without the walls; 2 is free space, corridors guide to below 2.
        clutter_db_per_m: what people and furniture take per metre; 0.2-0.6 dB/m (Devasirvatham, 1990).
        wall_factor: scales every wall's nominal loss (bricks, reinforcement, furniture).
        wall_ceiling_db: what walls cost at most, because signals also come round through doors and windows.
        wall_factor_5ghz: walls cost more at 5 GHz, by about this factor.
        floor_loss_db: per slab; 15-20 dB for concrete (ITU-R P.1238 has 15 dB and more for offices).
        shadowing_db: standard deviation of what the walls do not explain; 3-8 dB indoors.
        shadowing_m: distance over which its correlation falls to 1/e; a few metres indoors.
        shared_shadowing: correlation between the two bands of one access point.
        rician_k: power ratio of the steady path to the scattered ones.
        branches: independent fadings averaged by the receiver's antennas and the channel's width.
        reading_sd_db: spread of single readings of one radio within a scan.
        neighbour_loss_db: the outer shells between neighbours' rooms and this building, beside its own walls.
    """

    exponent: float = 2.0
    clutter_db_per_m: float = 0.0
    wall_factor: float = 1.0
    wall_ceiling_db: float = 35.0
    wall_factor_5ghz: float = 1.3
    floor_loss_db: float = 17.0
    shadowing_db: float = 4.0
    shadowing_m: float = 5.0
    shared_shadowing: float = 0.5
    rician_k: float = 4.0
    branches: int = 2
    reading_sd_db: float = 1.0
    neighbour_loss_db: float = 10.0


@dataclass(frozen=True)
class Receiver:
    """A phone's radio.

    Attributes:
        offset_db: what this model reads more than the reference phone.
        detection_dbm: strength at which half of the beacons are decoded (at the antenna, without the offset).
        detection_width_db: scale of the logistic around it.
        missed_share: beacons that collide or fall outside the dwell on their channel.
        step_db: readings are multiples of this.  strongest_dbm: the amplifier's upper end.
    """

    offset_db: float = 0.0
    detection_dbm: float = -93.0
    detection_width_db: float = 1.0
    missed_share: float = 0.05
    step_db: float = 1.0
    strongest_dbm: float = -20.0


@dataclass(frozen=True)
class Readings:
    """What was heard, a row per reading: ``scan`` and ``bssid`` (k,) are indices, ``rss_dbm`` (k,)."""

    scan: NDArray[np.int64]
    bssid: NDArray[np.int64]
    rss_dbm: Array


@dataclass(frozen=True)
class Radio:
    """The radio world of one building: call ``scan``."""

    building: Building
    transmitters: Transmitters
    propagation: Propagation
    shadows: tuple[ShadowFields, ...]

    def mean_dbm(self, positions_xy: Array, floor: int) -> Array:
        """Strength (n, r) of every radio at positions (n, 2) without shadowing and fading."""
        p, t = self.propagation, self.transmitters
        storeys = np.abs(t.site_floor - floor)
        rise = (t.site_floor - floor) * self.building.storey_height_m + t.site_height_m - PHONE_HEIGHT_M
        offset = positions_xy[:, None] - t.site_xy[None, :]
        distance = np.sqrt(np.sum(offset**2, axis=2) + rise**2)
        sites = 10.0 * p.exponent * np.log10(np.maximum(distance, 1.0)) + p.clutter_db_per_m * distance
        sites += p.floor_loss_db * storeys
        sites += p.neighbour_loss_db * self.is_outside()
        walls = p.wall_factor * self.building.wall_loss_db(positions_xy, t.site_xy)
        first_metre = 20.0 * np.log10(t.radio_mhz) - 27.55
        per_radio = np.where(t.radio_mhz > 4000.0, p.wall_factor_5ghz, 1.0) * walls[:, t.radio_site]
        wall_loss = p.wall_ceiling_db * -np.expm1(-per_radio / p.wall_ceiling_db)
        return np.asarray(t.radio_power_dbm - first_metre - sites[:, t.radio_site] - wall_loss)

    def local_mean_dbm(self, positions_xy: Array, floor: int, floor_dbm: float = -np.inf) -> Array:
        """``mean_dbm`` plus shadowing, where this can come above ``floor_dbm``; -inf elsewhere."""
        mean = self.mean_dbm(positions_xy, floor)
        spread = self.propagation.shadowing_db
        audible = mean > floor_dbm - 4.0 * spread
        shadow = spread * self.shadows[floor].at(positions_xy, audible)
        return np.where(audible, mean + shadow, -np.inf)

    def scan(
        self, positions_xy: Array, time_s: Array, floor: int, phone: Receiver, rng: np.random.Generator
    ) -> Readings:
        """Scan at positions (n, 2) and times (n,)."""
        radios, bssids = self._on_air_between(time_s.min(), time_s.max())
        present = self._only(radios, bssids)
        t, p = present.transmitters, self.propagation
        local = present.local_mean_dbm(positions_xy, floor, phone.detection_dbm - 10.0)
        power = (local + fading_db(local.shape, p.rician_k, p.branches, rng))[:, t.bssid_radio]
        power = power + p.reading_sd_db * rng.standard_normal(power.shape)
        site = t.radio_site[t.bssid_radio]
        on_air = (time_s[:, None] >= t.on_s[site]) & (time_s[:, None] < t.off_s[site])
        scan, number = np.nonzero(on_air & is_detected(power, phone, rng))
        return Readings(scan, np.flatnonzero(bssids)[number], read_out(power[scan, number], phone))

    def _on_air_between(self, first_s: float, last_s: float) -> tuple[Mask, Mask]:
        """Radios (r,) and BSSIDs (b,) that send at some time in between: most hotspots of a day never meet a walk."""
        t = self.transmitters
        radios = ((t.on_s <= last_s) & (t.off_s > first_s))[t.radio_site]
        return radios, radios[t.bssid_radio]

    def _only(self, radios: Mask, bssids: Mask) -> Radio:
        t = self.transmitters
        sites = np.zeros(len(t.site_xy), dtype=bool)
        sites[t.radio_site[radios]] = True
        new_site, new_radio = np.cumsum(sites) - 1, np.cumsum(radios) - 1
        chosen = replace(
            t,
            **{name: getattr(t, name)[sites] for name in ("site_xy", "site_floor", "site_height_m", "on_s", "off_s")},
            **{name: getattr(t, name)[radios] for name in ("radio_mhz", "radio_power_dbm")},
            radio_site=new_site[t.radio_site[radios]],
            bssid_radio=new_radio[t.bssid_radio[bssids]],
            bssids=(),
            ephemeral=t.ephemeral[bssids],
        )
        fields = tuple(field.only(radios) for field in self.shadows)
        return replace(self, transmitters=chosen, shadows=fields)

    def is_outside(self) -> Mask:
        """Which sites (s,) stand outside the building."""
        x, y = self.transmitters.site_xy.T
        width, depth = self.building.width_m, self.building.depth_m
        return np.asarray((x < 0) | (x > width) | (y < 0) | (y > depth))


def make_radio(
    building: Building,
    transmitters: Transmitters,
    propagation: Propagation,
    storeys: int,
    seed: int,
    label: str,
) -> Radio:
    """The radio world, with a shadowing field for every radio on every storey."""
    fields = [
        shadow_fields(
            transmitters.radio_site,
            propagation.shadowing_m,
            propagation.shared_shadowing,
            random_stream(seed, label, "shadowing", storey),
        )
        for storey in range(storeys)
    ]
    return Radio(building, transmitters, propagation, tuple(fields))


def fading_db(shape: tuple[int, ...], rician_k: float, branches: int, rng: np.random.Generator) -> Array:
    """Rician fading in dB around the local mean, the power averaged over independent branches."""
    scattered = rng.standard_normal((2, branches, *shape)) * np.sqrt(0.5 / (rician_k + 1.0))
    steady = np.sqrt(rician_k / (rician_k + 1.0))
    power = np.mean((steady + scattered[0]) ** 2 + scattered[1] ** 2, axis=0)
    return np.asarray(10.0 * np.log10(power))


def is_detected(power_dbm: Array, phone: Receiver, rng: np.random.Generator) -> Mask:
    """Which beacons are decoded: a logistic around the detection limit, less those that are missed anyhow."""
    margin = np.clip((power_dbm - phone.detection_dbm) / phone.detection_width_db, -50.0, 50.0)
    chance = (1.0 - phone.missed_share) / (1.0 + np.exp(-margin))
    return np.asarray(rng.random(power_dbm.shape) < chance)


def read_out(power_dbm: Array, phone: Receiver) -> Array:
    """What the phone reports: offset, rounded to its step, within its range."""
    finite = np.maximum(power_dbm, WEAKEST_DBM)
    rounded = np.round((finite + phone.offset_db) / phone.step_db) * phone.step_db
    return np.asarray(np.clip(rounded, WEAKEST_DBM, phone.strongest_dbm))
