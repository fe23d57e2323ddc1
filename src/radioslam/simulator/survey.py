"""From a scenario to walks: people walk, trackers drift, phones scan."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from radioslam.errors import ConfigError
from radioslam.simulator.access_points import Transmitters, deploy
from radioslam.simulator.building import Building
from radioslam.simulator.inertial import PhoneSensors, inertial_streams, steel_fields
from radioslam.simulator.radio import Radio, Readings, Receiver, make_radio
from radioslam.simulator.scenarios import SCENARIOS, Scenario
from radioslam.simulator.streams import random_stream
from radioslam.simulator.tracker import drifted_poses
from radioslam.simulator.walkable import walkable_graph
from radioslam.simulator.walkers import TruePath, favourite_places, plan_route, walk_route
from radioslam.walk import Inertial, RadioScans, Reference, Signal, Walk

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Recording:
    """A simulated walk before it becomes a ``Walk``: the truth, and who was heard when.

    Attributes:
        name: of the walk.  start_s: on the survey's clock.  path: true position over the time since then.
        floor: storey, counted from 0.  device: number of the phone's model.
        scan_s: (n,) since the start.  readings: of these scans.
    """

    name: str
    start_s: float
    path: TruePath
    floor: int
    device: int
    scan_s: Array
    readings: Readings


def simulate(
    scenario: str,
    *,
    seed: int,
    walks: int | None = None,
    devices: int | None = None,
    floors: int | None = None,
    hours: float | None = None,
    inertial: bool = False,
) -> list[Walk]:
    """Simulate a named survey.

    Args:
        scenario: a key of ``SCENARIOS``.
        seed: makes the whole world; the same seed gives the same walks, and more walks leave the first ones'
            paths and drift as they are.
        walks: how many.
        devices: phone models that share them in turn.  floors: storeys that share them in turn.
        hours: time over which the walks begin.
        inertial: add raw inertial streams at 50 Hz.

    Returns:
        Walks with WiFi scans, 1 Hz odometry that begins at (0, 0) with the true heading, and the 1 Hz
        reference in the building's frame.

    Raises:
        ConfigError: an unknown scenario, or a number that makes no sense.
    """
    plan = _settle(scenario, seed, walks, devices, floors, hours)
    world = make_world(plan, seed)
    recordings = [record(plan, world, seed, number, floors or 1) for number in range(plan.walks)]
    named = _kept_bssids(world.transmitters, recordings, SCENARIOS[scenario])
    return [_as_walk(plan, recording, named, world, seed, inertial) for recording in recordings]


def _settle(
    scenario: str,
    seed: int,
    walks: int | None,
    devices: int | None,
    floors: int | None,
    hours: float | None,
) -> Scenario:
    """The scenario with the caller's numbers put in."""
    if scenario not in SCENARIOS:
        known = ", ".join(SCENARIOS)
        raise ConfigError(f"scenario: expected one of {known}, found {scenario!r}")
    for name, value in (("seed", seed + 1), ("walks", walks), ("devices", devices), ("floors", floors)):
        if value is not None and value < 1:
            raise ConfigError(f"{name}: expected at least {int(name != 'seed')}, found {value - (name == 'seed')}")
    if hours is not None and not 0 < hours < np.inf:
        raise ConfigError(f"hours: expected a positive number, found {hours}")
    plan = SCENARIOS[scenario]
    survey = replace(plan.survey, devices=devices or plan.survey.devices, hours=hours or plan.survey.hours)
    deployment = replace(plan.deployment, storeys=max(plan.deployment.storeys, floors or 1))
    return replace(plan, walks=walks or plan.walks, survey=survey, deployment=deployment)


def make_world(plan: Scenario, seed: int) -> Radio:
    """The building with everything that transmits in it during the survey."""
    building = plan.make_building()
    span_s = plan.survey.hours * 3600.0 + max(plan.survey.length_m) / plan.habits.speed_mps * 3.0
    transmitters = deploy(building, plan.deployment, span_s, seed, plan.name)
    storeys = plan.deployment.storeys
    return make_radio(building, transmitters, plan.propagation, storeys, seed, plan.name)


def record(plan: Scenario, world: Radio, seed: int, number: int, floors: int = 1) -> Recording:
    """One walk, the ``number``-th of the survey, and what its phone hears."""
    name = f"{plan.name}-{number:02d}"
    start_s = start_time_s(plan, seed, number)
    path = true_path(plan, world.building, seed, number)
    scan_s = scan_times(plan, path.duration_s, number, random_stream(seed, "clock", name))
    storey = (plan.deployment.storeys - floors) // 2 + number % floors
    device = number % plan.survey.devices
    phone, rng = receiver(plan, device, seed), random_stream(seed, "scans", name)
    readings = world.scan(path.at(scan_s), start_s + scan_s, storey, phone, rng)
    return Recording(name, start_s, path, number % floors, device, scan_s, readings)


def start_time_s(plan: Scenario, seed: int, number: int) -> float:
    """When the ``number``-th walk begins: spread evenly over the hours, however many walks there are."""
    golden = (5**0.5 - 1) / 2
    share = (random_stream(seed, "start", plan.name).random() + number * golden) % 1.0
    return float(np.round(share * plan.survey.hours * 3600.0))


def true_path(plan: Scenario, building: Building, seed: int, number: int) -> TruePath:
    """Where the ``number``-th walker goes, and when."""
    survey, rng = plan.survey, random_stream(seed, "path", plan.name, number)
    length_m = survey.length_m[number % len(survey.length_m)]
    scans = survey.scans[number % len(survey.scans)] if survey.scans else 0
    duration_s = scans * survey.scan_period_s[1] if scans else None
    graph = walkable_graph(building)
    favourites = favourite_places(graph, plan.habits, random_stream(seed, plan.name, "favourites"))
    route = plan_route(building, graph, length_m, plan.habits, rng, favourites)
    return walk_route(route, plan.habits, rng, duration_s)


def scan_times(plan: Scenario, duration_s: float, number: int, rng: np.random.Generator) -> Array:
    """When the phone's scans are read out, in seconds since the start."""
    shortest, longest = plan.survey.scan_period_s
    if plan.survey.scans:
        return longest * np.arange(1.0, plan.survey.scans[number % len(plan.survey.scans)] + 1.0)
    gaps = rng.uniform(shortest, longest, int(duration_s / shortest) + 1)
    times = np.asarray(np.round(np.cumsum(gaps), 3), dtype=float)
    return times[times <= duration_s]


def receiver(plan: Scenario, device: int, seed: int) -> Receiver:
    """The phone model number ``device``; number 0 is the reference phone."""
    if device == 0:
        return plan.phone
    rng = random_stream(seed, "device", device)
    offset_db = plan.survey.offset_sd_db * float(rng.standard_normal())
    deafness_db = plan.survey.detection_sd_db * float(rng.standard_normal())
    return replace(plan.phone, offset_db=offset_db, detection_dbm=plan.phone.detection_dbm + deafness_db)


def _kept_bssids(transmitters: Transmitters, recordings: list[Recording], scenario: Scenario) -> Mask:
    """Which BSSIDs exist at all: where the scenario knows their number, the rarest hotspots never were there.

    Only the scenario's own walks decide, so that further walks leave their data as they are.
    """
    kept = np.ones(len(transmitters.bssids), dtype=bool)
    heard = np.concatenate([r.readings.bssid for r in recordings[: scenario.walks]])
    times_heard = np.bincount(heard, minlength=len(kept))
    surplus = np.count_nonzero(times_heard) - (scenario.bssid_count or len(kept))
    candidates = np.flatnonzero((times_heard > 0) & transmitters.ephemeral)
    rarest = candidates[np.argsort(times_heard[candidates], kind="stable")]
    kept[rarest[: max(surplus, 0)]] = False
    return kept


def _as_walk(plan: Scenario, recording: Recording, kept: Mask, world: Radio, seed: int, inertial: bool) -> Walk:
    path, begin = recording.path, recording.start_s
    time_s = np.arange(np.ceil(path.duration_s) + 1.0)
    positions_xy = path.at(time_s)
    poses = drifted_poses(positions_xy, plan.drift, random_stream(seed, "tracker", recording.name))
    sensors = _inertial(plan, recording, seed) if inertial else None
    return Walk(
        name=recording.name,
        wifi=_as_scans(recording, kept, world.transmitters),
        odometry=Signal(begin + time_s, poses),
        inertial=sensors,
        reference=Reference(begin + time_s, positions_xy),
        device=f"phone-{recording.device}",
        floor=f"F{recording.floor + 1}",
    )


def _inertial(plan: Scenario, recording: Recording, seed: int) -> Inertial:
    sensors = PhoneSensors()
    steel = steel_fields(sensors, random_stream(seed, plan.name, "steel", recording.floor))
    rng = random_stream(seed, "inertial", recording.name)
    return inertial_streams(recording.path, recording.start_s, steel, sensors, rng)


def _as_scans(recording: Recording, kept: Mask, transmitters: Transmitters) -> RadioScans:
    readings = recording.readings
    chosen = kept[readings.bssid]
    scan, bssid = readings.scan[chosen], readings.bssid[chosen]
    return RadioScans.from_readings(
        recording.start_s + recording.scan_s[scan],
        np.array(transmitters.bssids)[bssid].tolist(),
        readings.rss_dbm[chosen],
        transmitters.radio_mhz[transmitters.bssid_radio[bssid]],
    )
