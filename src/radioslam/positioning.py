"""Scan + radio map -> position with a confidence that holds, or "not here".

A ``Positioner`` is made once from a radio map (it learns the field, leaves walks out in turn to calibrate itself, and
sets aside access points that are not to be trusted) and then locates any number of scans.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.special import logsumexp

from radioslam.calibration import Calibration, calibrate, learn_models
from radioslam.config import Config, PositioningConfig, load_config
from radioslam.errors import PositioningError
from radioslam.field import Field
from radioslam.likelihood import Candidates
from radioslam.map_health import find_unhealthy, trust
from radioslam.neighbours import Neighbours
from radioslam.radio_map import RadioMap

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Scan = Mapping[str, float]

RSS_RANGE_DBM = (-127.0, 0.0)


@dataclass(frozen=True)
class FloorModel:
    """One floor made ready: its field's candidates, its samples and its calibration."""

    floor: str
    field: Field
    candidates: Candidates
    neighbours: Neighbours
    calibration: Calibration

    def radius_m(self, sigma_xy: Array, closest: Array) -> Array:
        """Radius (s,) of 95 % for standard deviations (s, 2) of scans so similar (s,) to the likest sample."""
        known = self.calibration
        spread = np.sqrt(np.sum(sigma_xy**2, axis=1) + known.sigma_floor_m**2)
        radius: Array = known.radius_per_sigma[np.digitize(closest, known.similarities)] * spread
        return radius


@dataclass(frozen=True)
class Location:
    """Where a scan was made.

    Attributes:
        position_xy: metres in the map's frame, or None where the scan does not belong to the map.
        sigma_xy: standard deviations.  radius_m: within it lies the truth with 95 %.
        access_points: those used.  floor, floor_probability: the floor decided first.
        reason: why it is not here, "" if it is.
    """

    position_xy: tuple[float, float] | None
    sigma_xy: tuple[float, float] = (np.nan, np.nan)
    radius_m: float = np.nan
    access_points: tuple[str, ...] = ()
    floor: str = ""
    floor_probability: float = 0.0
    reason: str = ""

    @property
    def here(self) -> bool:
        """Whether the scan belongs to the map."""
        return self.position_xy is not None

    def as_dict(self) -> dict[str, Any]:
        """For JSON; without a position only the reason."""
        if not self.here:
            return {"here": False, "reason": self.reason}
        return {"here": True, **asdict(self)}


@dataclass(frozen=True)
class Positioner:
    """A radio map made ready for positioning; ``weights`` (m,) say how far each access point is trusted."""

    transmitters: tuple[str, ...]
    weights: Array
    floors: tuple[FloorModel, ...]
    config: PositioningConfig

    @staticmethod
    def of(radio_map: RadioMap, config: Config | None = None) -> Positioner:
        """Learn and calibrate; the largest map of each floor is used.

        Raises:
            PositioningError: fewer than two samples that heard something on a floor.
        """
        config = config or load_config()
        samples = radio_map.select(radio_map.map == 0)
        weights = trust(samples, find_unhealthy(samples), config.positioning.local_address_weight)
        labels = samples.floor_of_sample
        floors = tuple(
            _prepare(str(floor), samples.select(labels == floor), weights, config) for floor in np.unique(labels)
        )
        return Positioner(samples.transmitters, weights, floors, config.positioning)

    def locate(self, scan: Scan) -> Location:
        """The position of one scan, access point -> RSS in dBm.

        Raises:
            PositioningError: the scan is empty or holds what is no RSS.
        """
        return self.locate_many([scan])[0]

    def locate_many(self, scans: Sequence[Scan]) -> list[Location]:
        """The same for many scans at once."""
        matrix, unknown = scan_matrix(scans, self.transmitters)
        return self.locate_rows(matrix, unknown)

    def locate_rows(self, scans_dbm: sparse.csr_array, unknown: Array) -> list[Location]:
        """The same for scans as rows (s, m) of the map's access points beside (s,) counts of unknown ones."""
        similarity = [floor.neighbours.similarity(scans_dbm, unknown) for floor in self.floors]
        fits = [floor.candidates.tempered(scans_dbm, floor.calibration.temperature) for floor in self.floors]
        evidence = np.stack([logsumexp(fit, axis=1) - np.log(fit.shape[1]) for fit in fits], axis=1)
        probability = np.exp(evidence - logsumexp(evidence, axis=1, keepdims=True))
        chosen = probability.argmax(axis=1)
        answers: list[Location | None] = [None] * len(chosen)
        for k, floor in enumerate(self.floors):
            rows = np.flatnonzero(chosen == k)
            mean, sigma = floor.candidates.moments(fits[k][rows])
            closest = similarity[k][rows].max(axis=1, initial=0.0)
            radius = floor.radius_m(sigma, closest)
            for i, row in enumerate(rows):
                if closest[i] < floor.calibration.least_similarity:
                    answers[row] = Location(None, reason=_foreign(scans_dbm, int(row), unknown[row], closest[i]))
                    continue
                answers[row] = Location(
                    (float(mean[i, 0]), float(mean[i, 1])),
                    (float(sigma[i, 0]), float(sigma[i, 1])),
                    float(radius[i]),
                    self._used(scans_dbm, int(row)),
                    floor.floor,
                    float(probability[row, k]),
                )
        return [answer for answer in answers if answer is not None]

    def _used(self, scans_dbm: sparse.csr_array, row: int) -> tuple[str, ...]:
        columns = scans_dbm.indices[slice(*scans_dbm.indptr[row : row + 2])]
        return tuple(self.transmitters[k] for k in columns if self.weights[k] > 0)


def scan_matrix(scans: Sequence[Scan], transmitters: Sequence[str]) -> tuple[sparse.csr_array, Array]:
    """Scans as rows (s, m) of known access points, and how many unknown ones each holds (s,).

    Raises:
        PositioningError: a scan is empty, or a value is not finite or no RSS in dBm.
    """
    column = {name: k for k, name in enumerate(transmitters)}
    low, high = RSS_RANGE_DBM
    entries: list[tuple[int, int, float]] = []
    unknown = np.zeros(len(scans))
    for k, scan in enumerate(scans):
        if not scan:
            raise PositioningError(f"scan {k + 1}: expected at least one access point, found none; scan again")
        for name, rss in scan.items():
            if not low <= rss < high:
                advice = "give received strengths in dBm, such as -67"
                raise PositioningError(
                    f"scan {k + 1}: expected RSS in [{low:g}, {high:g}) dBm, found {rss:g}; {advice}"
                )
            if name in column:
                entries.append((k, column[name], float(rss)))
            else:
                unknown[k] += 1
    shape = (len(scans), len(transmitters))
    table = np.array(entries, dtype=float).reshape(-1, 3)
    row, col = table[:, 0].astype(int), table[:, 1].astype(int)
    return sparse.csr_array((table[:, 2], (row, col)), shape=shape), unknown


def _foreign(scans_dbm: sparse.csr_array, row: int, unknown: float, similarity: float) -> str:
    known = int(np.diff(scans_dbm.indptr[row : row + 2])[0])
    if not known:
        return "not here: no access point in common with the map"
    return f"not here: {known} of {known + int(unknown)} access points known, similarity {similarity:.2f} at best"


def _prepare(floor: str, samples: RadioMap, weights: Array, config: Config) -> FloorModel:
    usable = samples.select(np.diff(samples.rss_dbm.indptr) > 0)
    if len(usable) < 2:
        raise PositioningError(f"floor {floor!r}: expected at least two samples with readings, found {len(usable)}")
    field, candidates, neighbours = learn_models(usable, weights, config)
    learned = (field.length_m, field.noise)
    return FloorModel(floor, field, candidates, neighbours, calibrate(usable, weights, config, learned))


def read_scan(path: Path) -> dict[str, float]:
    """A scan from JSON: an object of access point -> RSS in dBm.

    Raises:
        PositioningError: not such a file.
    """
    try:
        scan = json.loads(path.read_text("utf-8"))
        return {str(name): float(rss) for name, rss in scan.items()}
    except (OSError, ValueError, AttributeError, TypeError) as error:
        raise PositioningError(f"{path}: expected JSON of access point -> RSS in dBm, found: {error}") from None
