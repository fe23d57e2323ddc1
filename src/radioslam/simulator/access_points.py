"""Who transmits: a building's access points, neighbours around it, and hotspots that come and go.

A *site* is a box on a ceiling or in a pocket; it has one radio per band, and every radio sends several BSSIDs
(virtual networks).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from radioslam.simulator.building import Building
from radioslam.simulator.streams import digest, random_stream

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

CHANNELS_2G_MHZ = (2412.0, 2437.0, 2462.0)
CHANNELS_5G_MHZ = (5180.0, 5220.0, 5260.0, 5300.0, 5500.0, 5580.0)

EVEN_STEPS = np.array([0.7548776662466927, 0.5698402909980532])
"""1/p and 1/p² of the plastic number p: multiples of it, modulo 1, fill the square evenly."""


@dataclass(frozen=True)
class Deployment:
    """How densely a building is equipped.

    Attributes:
        area_per_site_m2: floor area for which the installers hang one access point.
        bssids_per_radio: networks that each radio of the building announces (staff, guests, eduroam, ...).
        storeys: floors with access points, whether or not anybody walks there.
        neighbours: sites of other people around the building, up to ``neighbour_reach_m`` from its walls.
        hotspots: phones and printers with a network of their own that are on at any one time.
        hotspot_life_s: mean time for which such a network exists.
        outage_share: share of building sites that are switched on or off for good some time in the survey.
        mount_height_m: of the building's sites above the floor; phones are at 1.2 m.
        power_dbm: mean EIRP less the losses of body and handset.  power_sd_db: spread over sites.
        hotspot_power_dbm: the same for hotspots, which send from pockets and bags.
        band_gap_db: how much stronger a 5 GHz radio sends (regulation allows it 3-6 dB more).
    """

    area_per_site_m2: float = 70.0
    bssids_per_radio: int = 2
    storeys: int = 1
    neighbours: int = 20
    neighbour_reach_m: float = 60.0
    hotspots: float = 6.0
    hotspot_life_s: float = 1200.0
    outage_share: float = 0.05
    mount_height_m: float = 2.7
    power_dbm: float = 8.0
    power_sd_db: float = 2.0
    hotspot_power_dbm: float = -4.0
    band_gap_db: float = 3.0


@dataclass(frozen=True)
class Transmitters:
    """Sites, their radios and the radios' BSSIDs.

    Attributes:
        site_xy: (s, 2).  site_floor: (s,) storey.  site_height_m: (s,) above that storey's floor.
        on_s, off_s: (s,) when the site begins and ceases to send.
        radio_site: (r,).  radio_mhz: (r,).  radio_power_dbm: (r,) after the losses of body and handset.
        bssid_radio: (b,).  bssids: (b,) names.  ephemeral: (b,) bool, True for hotspots.
    """

    site_xy: Array
    site_floor: Integers
    site_height_m: Array
    on_s: Array
    off_s: Array
    radio_site: Integers
    radio_mhz: Array
    radio_power_dbm: Array
    bssid_radio: Integers
    bssids: tuple[str, ...]
    ephemeral: NDArray[np.bool_]


@dataclass(frozen=True)
class _Sites:
    xy: Array
    floor: Integers
    height_m: Array
    on_s: Array
    off_s: Array
    power_dbm: Array
    bssids_per_radio: int
    two_bands: NDArray[np.bool_]
    ephemeral: bool


def deploy(building: Building, deployment: Deployment, span_s: float, seed: int, label: str) -> Transmitters:
    """Hang up access points for a survey from 0 to ``span_s``; ``label`` keeps the names of worlds apart."""
    groups = [
        _building_sites(building, deployment, span_s, random_stream(seed, label, "sites")),
        _neighbour_sites(building, deployment, random_stream(seed, label, "neighbours")),
        _hotspot_sites(building, deployment, span_s, random_stream(seed, label, "hotspots")),
    ]
    return _assemble(groups, deployment, random_stream(seed, label, "radios"), digest(seed, label))


def _building_sites(building: Building, deployment: Deployment, span_s: float, rng: np.random.Generator) -> _Sites:
    """Sites spread evenly over every storey, but on no lattice (Roberts' R2 sequence from a random start)."""
    per_storey = max(1, round(building.width_m * building.depth_m / deployment.area_per_site_m2))
    turns = np.arange(per_storey)[:, None] * EVEN_STEPS
    xy = np.concatenate([(rng.random(2) + turns) % 1.0 for _ in range(deployment.storeys)])
    count = len(xy)
    power = deployment.power_dbm + deployment.power_sd_db * rng.standard_normal(count)
    return _Sites(
        xy * [building.width_m, building.depth_m],
        np.repeat(np.arange(deployment.storeys), per_storey),
        np.full(count, deployment.mount_height_m),
        *_outages(count, deployment.outage_share, span_s, rng),
        power,
        deployment.bssids_per_radio,
        np.ones(count, dtype=bool),
        ephemeral=False,
    )


def _outages(count: int, share: float, span_s: float, rng: np.random.Generator) -> tuple[Array, Array]:
    on, off = np.full(count, -np.inf), np.full(count, np.inf)
    changed, begins = rng.random(count) < share, rng.random(count) < 0.5
    moment = rng.uniform(0, span_s, count)
    return np.where(changed & begins, moment, on), np.where(changed & ~begins, moment, off)


def _neighbour_sites(building: Building, deployment: Deployment, rng: np.random.Generator) -> _Sites:
    """Sites in a frame around the building, at any of its heights."""
    count, reach = deployment.neighbours, deployment.neighbour_reach_m
    size = np.array([building.width_m, building.depth_m])
    pool = rng.uniform(-reach, size + reach, (count * 20 + 50, 2))
    outside = np.any((pool < -3.0) | (pool > size + 3.0), axis=1)
    return _Sites(
        pool[outside][:count],
        rng.integers(0, deployment.storeys, count),
        np.full(count, 1.5),
        np.full(count, -np.inf),
        np.full(count, np.inf),
        deployment.power_dbm + deployment.power_sd_db * rng.standard_normal(count),
        2,
        rng.random(count) < 0.5,
        ephemeral=False,
    )


def _hotspot_sites(building: Building, deployment: Deployment, span_s: float, rng: np.random.Generator) -> _Sites:
    """A steady coming and going: births are uniform in time, lives exponential."""
    life = deployment.hotspot_life_s
    count = int(rng.poisson(deployment.hotspots * deployment.storeys * (span_s + 3 * life) / life))
    born = rng.uniform(-3 * life, span_s, count)
    return _Sites(
        rng.uniform(0, 1, (count, 2)) * [building.width_m, building.depth_m],
        rng.integers(0, deployment.storeys, count),
        np.full(count, 1.0),
        born,
        born + rng.exponential(life, count),
        deployment.hotspot_power_dbm + deployment.power_sd_db * rng.standard_normal(count),
        1,
        np.zeros(count, dtype=bool),
        ephemeral=True,
    )


def _assemble(groups: list[_Sites], deployment: Deployment, rng: np.random.Generator, world: bytes) -> Transmitters:
    two_bands = np.concatenate([g.two_bands for g in groups])
    networks = np.concatenate([np.full(len(g.xy), g.bssids_per_radio) for g in groups])
    power = np.concatenate([g.power_dbm for g in groups])
    ephemeral = np.concatenate([np.full(len(g.xy), g.ephemeral) for g in groups])
    radio_site = np.repeat(np.arange(len(two_bands)), 1 + two_bands)
    is_5g = np.append(False, radio_site[1:] == radio_site[:-1])[: len(radio_site)]
    mhz = np.where(is_5g, rng.choice(CHANNELS_5G_MHZ, len(is_5g)), rng.choice(CHANNELS_2G_MHZ, len(is_5g)))
    bssid_radio = np.repeat(np.arange(len(radio_site)), networks[radio_site])
    first = np.searchsorted(bssid_radio, bssid_radio)
    numbers = np.arange(len(bssid_radio)) - first
    names = [_mac(world, int(radio_site[r]), int(is_5g[r]), int(n)) for r, n in zip(bssid_radio, numbers, strict=True)]
    return Transmitters(
        np.concatenate([g.xy for g in groups]),
        np.concatenate([g.floor for g in groups]),
        np.concatenate([g.height_m for g in groups]),
        np.concatenate([g.on_s for g in groups]),
        np.concatenate([g.off_s for g in groups]),
        radio_site,
        mhz,
        power[radio_site] + deployment.band_gap_db * is_5g,
        bssid_radio,
        tuple(names),
        ephemeral[radio_site[bssid_radio]],
    )


def _mac(world: bytes, site: int, band: int, network: int) -> str:
    """A locally administered address; networks of one radio differ in the last digits, as real ones do."""
    octets = (0x02, world[0], world[1], site >> 8 & 0xFF, site & 0xFF, band << 4 | network)
    return ":".join(f"{octet:02x}" for octet in octets)
