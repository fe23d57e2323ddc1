"""The named surveys: a building, its radio world, and the people who walk there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from radioslam.simulator.access_points import Deployment
from radioslam.simulator.building import Building
from radioslam.simulator.named_buildings import campus_building, office_building, tower_building
from radioslam.simulator.radio import Propagation, Receiver
from radioslam.simulator.tracker import TrackerDrift
from radioslam.simulator.walkers import WalkerHabits


@dataclass(frozen=True)
class Survey:
    """How much is walked and scanned.

    Attributes:
        length_m: length of each walk; walks beyond the last begin again with the first.
        scans: scans per walk, which then takes exactly scans x period; empty where the walk's own duration
            decides.
        scan_period_s: least and greatest time between two scans.
        hours: the time over which walks begin.
        devices: number of phone models that share the walks in turn.
        offset_sd_db, detection_sd_db: spread over phone models of their offsets and detection limits; the first
            model is the reference phone.
    """

    length_m: tuple[float, ...]
    scans: tuple[int, ...] = ()
    scan_period_s: tuple[float, float] = (5.0, 5.0)
    hours: float = 2.0
    devices: int = 1
    offset_sd_db: float = 4.0  # phones side by side differ by 3-5 dB in published comparisons
    detection_sd_db: float = 1.0


@dataclass(frozen=True)
class Scenario:
    """Everything that ``simulate`` needs beside the seed.

    Attributes:
        walks: how many there are by default.  phone: the reference phone.
        bssid_count: BSSIDs in the data of those walks, None for as many as are heard.
    """

    name: str
    make_building: Callable[[], Building]
    survey: Survey
    walks: int
    deployment: Deployment = field(default_factory=Deployment)
    propagation: Propagation = field(default_factory=Propagation)
    habits: WalkerHabits = field(default_factory=WalkerHabits)
    drift: TrackerDrift = field(default_factory=TrackerDrift)
    phone: Receiver = field(default_factory=Receiver)
    bssid_count: int | None = None


OFFICE = Scenario(
    name="office",
    make_building=office_building,
    survey=Survey(length_m=(120.0,), scan_period_s=(3.0, 5.0), hours=1.0, devices=2, offset_sd_db=2.0),
    walks=6,
    deployment=Deployment(area_per_site_m2=67.0, neighbours=10, hotspots=3.0, power_dbm=2.0),
    habits=WalkerHabits(room_share=0.3, pause_share=0.3),
    # A phone's dead reckoning rather than a visual tracker: after 120 m it is off by several metres.
    drift=TrackerDrift(heading_bias_deg_per_m=0.05, heading_walk_deg_per_sqrt_m=2.8, scale_sd=0.03),
)

_CAMPUS_SCANS = (207, 170, 181, 190)
_CAMPUS_LENGTH_M = 1533.0

CAMPUS = Scenario(
    name="campus",
    make_building=campus_building,
    survey=Survey(
        length_m=tuple(_CAMPUS_LENGTH_M * n / sum(_CAMPUS_SCANS) for n in _CAMPUS_SCANS),
        scans=_CAMPUS_SCANS,
        hours=3.0,
    ),
    walks=4,
    # Fitted to the paper's counts of BSSIDs per scan (docs/simulator.md), within what surveys report.
    deployment=Deployment(
        area_per_site_m2=168.0,
        bssids_per_radio=4,
        storeys=3,
        neighbours=150,
        hotspots=100.0,
        hotspot_life_s=300.0,
        mount_height_m=4.9,
        power_dbm=10.8,
        hotspot_power_dbm=3.0,
        band_gap_db=5.0,
    ),
    propagation=Propagation(
        exponent=2.2,
        clutter_db_per_m=0.23,
        wall_factor=1.55,
        wall_ceiling_db=43.0,
        floor_loss_db=20.0,
        shadowing_db=3.0,
        shadowing_m=5.0,
    ),
    phone=Receiver(detection_dbm=-85.0, detection_width_db=2.0),
    habits=WalkerHabits(speed_mps=0.55, pause_s=20.0, pause_share=0.9, detour=0.2, favourites=4, favourite_share=0.85),
    # A visual-inertial tracker without a steady turn, fitted to an error of 4.99 m in the mean at the scans.
    drift=TrackerDrift(heading_bias_deg_per_m=0.0, heading_walk_deg_per_sqrt_m=0.475, scale_sd=0.02),
    bssid_count=2211,
)

TOWER = Scenario(
    name="tower",
    make_building=tower_building,
    survey=Survey(length_m=(200.0,), hours=2.0),
    walks=6,
    deployment=Deployment(
        area_per_site_m2=65.0, bssids_per_radio=3, storeys=3, neighbours=40, hotspots=10.0, power_dbm=4.0
    ),
    # Metal facade and lifts: guided round the ring and scattered, hence a low exponent, little line of sight.
    propagation=Propagation(exponent=1.8, shadowing_db=6.0, shadowing_m=3.0, rician_k=1.0, floor_loss_db=15.0),
    drift=TrackerDrift(heading_bias_deg_per_m=0.10, heading_walk_deg_per_sqrt_m=1.8, scale_sd=0.02),
)

SCENARIOS: dict[str, Scenario] = {s.name: s for s in (OFFICE, CAMPUS, TOWER)}
"""The surveys that ``simulate`` knows by name."""
