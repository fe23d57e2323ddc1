"""Every parameter of the method in one typed tree, a group per step.

Command line beats environment beats file beats preset. The preset ``paper`` holds the values of arXiv:1904.11712
(section III and its experiments); ``default`` differs where real crowds asked for it (see docs/method.md).
Unknown keys and values out of range are errors.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

import tomli_w
from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, ValidationError, field_validator

from radioslam.errors import ConfigError

ENVIRONMENT_PREFIX = "RADIOSLAM_SET_"


class _Group(BaseModel):
    model_config = ConfigDict(
        extra="forbid", frozen=True, validate_default=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


class OdometryConfig(_Group):
    """Dead reckoning from a phone's sensors, and how far any odometry is to be trusted."""

    step_band_hz: tuple[float, float] = (0.75, 2.75)
    """Pass band of the acceleration norm in which steps are sought."""

    @field_validator("step_band_hz")
    @classmethod
    def _band_is_ordered(cls, band: tuple[float, float]) -> tuple[float, float]:
        if not 0 < band[0] < band[1] < 25:
            raise ValueError("expected 0 < low < high < 25 Hz, half of the rate at which steps are sought")
        return band

    step_peak_mps2: float = Field(0.8, gt=0)
    """Lowest peak of the filtered norm that counts as a step."""
    step_interval_s: float = Field(0.3, gt=0)
    """Steps are at least so far apart."""
    tumbling_radps: float = Field(3.0, gt=0)
    """While the phone turns faster than this over some seconds, it is waved about and nobody walks: no steps. A hand
    that swings with the walk stays below."""
    step_length: Literal["pendulum", "weinberg", "constant"] = "pendulum"
    """``pendulum``: T · √a_pp per step, scaled so that each phone model's median step is ``typical_step_m``;
    ``weinberg``: k · a_pp^(1/4);  ``constant``: no law. See ``steps``."""
    typical_step_m: float = Field(0.66, gt=0.1, lt=2.0)
    """Step of a person of unknown height, of ``pendulum`` and ``constant``: 0.414 of the world's mean adult height of
    1.65 m (the rule of pedometers; NCD-RisC 2016)."""
    weinberg_constant: float = Field(0.42, gt=0.1, lt=2.0)
    """k of ``weinberg``, for those who have calibrated theirs."""
    heading: Literal["fused", "rotation_vector"] = "fused"
    """``fused``: the gyroscope's vertical rate, slowly corrected towards the compass."""
    heading_correction_s: float = Field(60.0, gt=0)
    """Half width of the robust moving average that corrects the integrated rate."""
    step_length_sigma: float = Field(0.1, gt=0)
    """Standard deviation of one step's length, relative."""
    step_scale_sigma: float = Field(0.1, gt=0, lt=1)
    """Of a walk's steps as a whole: standard deviation of the logarithm of their scale."""
    tracker_scale_sigma: float = Field(0.02, gt=0, lt=1)
    """The same of given odometry."""
    step_heading_sigma_rad: float = Field(0.04, gt=0)
    """Standard deviation of the heading's change from step to step."""
    tracker_translation_sigma: float = Field(0.05, gt=0)
    """Of given odometry: standard deviation in m of 1 m walked; grows with the root of the distance."""
    tracker_heading_sigma_rad: float = Field(0.02, gt=0)
    """Of given odometry: standard deviation in rad of 1 m walked; grows with the root of the distance."""


class FingerprintConfig(_Group):
    """Scans -> sparse strengths."""

    rss_threshold_dbm: float = Field(-70.0, ge=-127, lt=0)
    """ϑ_r: weaker readings are dropped."""
    representation: Literal["dbm", "positive", "exponential"] = "dbm"
    """What the cosine compares; see ``fingerprints.represent``."""
    floor_dbm: float = Field(-100.0, ge=-128, lt=0)
    """Zero of ``positive`` and ``exponential``."""
    exponential_scale_db: float = Field(24.0, gt=0)
    """α of ``exponential``: strength = exp((RSS - floor) / α)."""
    max_age_s: float = Field(5.0, gt=0)
    """A reading last heard longer before its scan is stale."""
    beacons: bool = False
    """Whether Bluetooth beacons are further columns beside the WiFi access points."""
    beacon_window_s: float = Field(3.0, gt=0)
    """A beacon's reading belongs to the nearest scan if that is no farther in time."""


class UncertaintyConfig(_Group):
    """Similarity -> variance, learned from short-term odometry (section III-D)."""

    max_distance_m: float = Field(30.0, gt=0)
    """Pairs of one walk closer than this along the walk are samples."""
    bin_width: float = Field(0.1, gt=0, le=2)
    """b: samples within b/2 of s make var(s)."""
    min_samples: int = Field(5, ge=1)
    """Intervals with fewer samples count as empty."""
    per_axis: bool = False
    """Halve var(s): d² is spread over two axes, and var(s) is used for each. The paper does not."""
    min_sigma_m: float = Field(0.5, gt=0)
    """No similarity promises more than this."""


class MergingConfig(_Group):
    """Many tracks -> one frame (section III-E)."""

    starts: Literal["common", "known", "unknown", "mixed"] = "common"
    """How the walks' starts are related: ``common``, one place; ``known``, each at its first reference position;
    ``unknown``, found from the scans; ``mixed``, the first reference position where there is one, else found."""
    heading_variance: float = Field(1000.0, gt=0)
    """Variance of θ (rad²) of the links between common starts, as in the paper."""
    start_sigma_m: float = Field(1.0, gt=0)
    """Standard deviation of a known start."""
    heading: Literal["device", "unknown"] = "device"
    """``device``: the phone points the way its bearer walks; ``unknown``: at an angle of each walk's own (a pocket, a
    bag), which is found from the crowd."""
    heading_sigma_rad: float = Field(0.2, gt=0)
    """Standard deviation of the compass heading of a whole walk."""
    placed_sigma_m: float = Field(3.0, gt=0)
    """Of starts that were found: standard deviation of a walk's middle around its first place."""
    placed_heading_sigma_rad: float = Field(0.07, gt=0)
    """The same for the heading of the whole walk."""
    walk_scales: bool = False
    """Whether the scale of each walk's odometry is an unknown of the graph."""


class PlacementConfig(_Group):
    """First places of walks whose starts are not known: ``unknown`` and ``mixed``."""

    period_s: float = Field(3.0, gt=0)
    """Clock of the smoothed fingerprints."""
    smoothing_s: float = Field(1.5, gt=0)
    """τ of the Gaussian weights; beyond τ from its nearest reading an access point fades."""
    smoothing_reach_s: float = Field(6.0, gt=0)
    """Readings farther away in time do not count."""
    fade_db_per_s: float = Field(3.0, ge=0)
    """How fast an access point fades between its readings."""
    max_age_s: float = Field(30.0, gt=0)
    """A reading last heard longer before its scan is stale; younger ones count when they were heard."""
    spacing_m: float = Field(3.0, gt=0)
    """One smoothed fingerprint per so many metres walked."""
    standing_mps: float = Field(0.5, ge=0)
    """A walker who stands counts as walking so fast."""
    rss_threshold_dbm: float = Field(-90.0, ge=-127, lt=0)
    """Weaker smoothed readings are dropped."""
    similarity_threshold: float = Field(0.7, gt=0, le=1)
    """Scans of two walks at least so similar may be one place."""
    stretch_m: float = Field(5.0, gt=0)
    """Two walks are tied once per so many metres."""
    turn_sigma_rad: float = Field(0.21, gt=0)
    """Standard deviation of the heading of a whole walk: 12 degrees."""
    common_turn_sigma_rad: float = Field(0.3, gt=0)
    """Of ``mixed``: the same of all compasses together against the frame of the known positions."""
    log_scale_sigma: float = Field(0.08, gt=0, lt=1)
    """Standard deviation of the logarithm of the scale of a whole walk."""
    mean_log_scale_sigma: float = Field(0.003, gt=0, lt=1)
    """Gauge: so near to zero is the mean over the walks, since loops would shrink them all."""
    lag_sigma_s: float = Field(3.0, gt=0)
    """Standard deviation of the radio's lag, by which readings are older than what the phone says."""
    mean_turn_sigma_rad: float = Field(0.01, gt=0)
    """Gauge of ``unknown``: the mean turn over the walks."""
    apart_quantile: float = Field(0.1, gt=0, lt=1)
    """Quantile of the distance within walks, by similarity, that two walks' scans keep."""
    apart_limit_m: float = Field(8.0, ge=3)
    """That distance counts at most so much: beyond, too few pairs of one walk have taught it."""
    apart_sigma_m: float = Field(5.0, gt=0)
    """Standard deviation of that distance for a weight of 1."""
    apart_weight: float = Field(2.0, gt=0)
    """λ: weight of a pair of scans that have nobody else around."""
    crowd_radius_m: float = Field(15.0, gt=0)
    """Scans of other walks within this radius share one say."""
    looks: int = Field(3, ge=1)
    """How often all is done with the lag that a first look has found, each with fingerprints of other moments; the
    mean place counts."""
    rounds: int = Field(3, ge=1)
    """Rounds of finding what stands too near and solving."""
    iterations: int = Field(15, ge=1)
    """Optimizer steps of each round."""
    max_sigma_m: float = Field(20.0, gt=0)
    """Walks whose place is known less well are not tied."""


class LoopConfig(_Group):
    """Loop candidates (section III-F)."""

    similarity_threshold: float = Field(0.8, ge=0, le=1)
    """ϑ_s: candidates are at least so similar."""
    gates_m: tuple[PositiveFloat, ...] = Field((20.0,), min_length=1)
    """Candidates are at most so far apart under the current estimate. One gate is one round of candidates, screening
    and optimization; each further gate is applied to the estimate of the round before."""
    max_orientation_rad: float = Field(3.1416, gt=0)
    """Candidates' headings differ at most so much under the current estimate."""
    heading_variance: float = Field(1000.0, gt=0)
    """Variance of θ (rad²) of a loop: same place, any direction."""
    lag_sigma_s: float = Field(0.0, ge=0)
    """Standard deviation of the radio's lag, by which what a scan holds is older than its time; the lag is an unknown
    of the graph. 0: there is none."""


class DirectionsConfig(_Group):
    """Straight legs along the building's axes."""

    use: bool = False
    """Whether legs that run along the axes which most of them share are turned into them."""
    min_legs: int = Field(30, ge=2)
    """Fewer legs show no axis."""
    min_share: float = Field(0.5, gt=0, le=1)
    """Least share of all metres that must run within 10° of an axis; 0.22 do by chance."""
    min_leg_m: float = Field(6.0, gt=0)
    """Shorter straight stretches are no legs."""
    max_turn_rad: float = Field(0.21, gt=0)
    """A leg ends where the direction between nodes changes by more."""
    sigma_rad: float = Field(0.05, gt=0)
    """Standard deviation of a leg's direction about its axis."""
    lateral_sigma_m: float = Field(0.5, ge=0)
    """How far a leg's ends lie beside its line; what it adds to the direction shrinks with the length."""


class ScreeningConfig(_Group):
    """Which candidates become loops (section III-G)."""

    rule: Literal["window", "mutual", "single"] = "window"
    """``window``: the paper's; ``mutual``: each scan's mutual best match; ``single``: one loop per scan."""
    min_index_gap: int = Field(20, ge=1)
    """M: scans of one walk nearer than this in number are no loop."""
    min_loops_per_walk: int = Field(1, ge=1)
    """Walks with fewer loops have none."""
    neighbour_m: float = Field(15.0, gt=0)
    """Loops of two walks this near along both are neighbours."""
    consistency_m: float = Field(0.0, ge=0)
    """A loop whose two neighbours agree within so much and disagree with it by more is dropped; 0: none is."""
    window_m: float = Field(5.0, ge=0)
    """ϑ_w: of the candidates of one scan within so many metres along the other track the most similar stays."""


class OptimizerConfig(_Group):
    """Levenberg-Marquardt."""

    loop_loss: Literal["none", "huber", "cauchy", "dcs"] = "none"
    """Robust loss of the loop edges."""
    loss_scale: float = Field(1.0, gt=0)
    """Where the loss leaves the square, in standard deviations."""
    max_iterations: int = Field(100, ge=1)
    """Give up (and say so) after this many."""
    standard_deviations: bool = True
    """Whether to find the standard deviation of every position, the costliest part in large crowds; NaN without."""
    tolerance: float = Field(1e-6, gt=0)
    """Converged when the cost falls by less than this part of itself, or no step is longer."""


class GrowingConfig(_Group):
    """A map that grows walk by walk."""

    cell_m: float = Field(2.0, gt=0)
    """Side of the cells that the map is condensed to."""
    per_cell: int = Field(6, ge=1)
    """Scans that stand for all that were made in a cell."""
    partners: int = Field(12, ge=0)
    """Walks of the map, those with most loops to a new one, that are optimized together with it."""
    rebuild_growth: float = Field(0.25, gt=0)
    """A full optimization pays once the map has grown by this part of what the last one saw."""


class FieldConfig(_Group):
    """Samples -> strengths anywhere (Gaussian process)."""

    cell_m: float = Field(0.5, gt=0)
    """Samples of one square of this side are averaged."""
    max_cells: int = Field(1500, ge=10)
    """Squares are widened until there are no more than this."""
    floor_below_db: float = Field(3.0, ge=0)
    """The mean far from everything lies so far below the weakest reading of the map."""
    sweeps: int = Field(3, ge=0)
    """Sweeps of the expectation of what was not heard; with none it stands at the floor."""
    min_sigma_db: float = Field(3.0, gt=0)
    """No reading is trusted more than this."""


class PositioningConfig(_Group):
    """Scan -> position."""

    neighbours: int = Field(5, ge=1)
    """k of the weighted nearest neighbours."""
    offset_sigma_db: float = Field(3.0, ge=0)
    """Standard deviation of the offset between a phone and those of the map; 0: there is none."""
    local_address_weight: float = Field(0.5, ge=0, le=1)
    """Weight of access points with a locally administered address; others have 1."""
    folds: int = Field(4, ge=2)
    """Groups of walks that are left out in turn to calibrate confidence."""
    particles: int = Field(2000, ge=10)
    """Of the filter for moving users."""
    lag_scans: int = Field(10, ge=0)
    """The filter's answer for a scan waits for so many more scans; 0 answers at once."""


class RegistrationConfig(_Group):
    """Two point clouds -> the rigid motion between them."""

    max_range_m: float = Field(6.0, gt=0)
    """Points farther from the sensor are dropped: the noise of depth cameras grows with the square of the range."""
    voxel_m: float = Field(0.05, gt=0)
    """Clouds are down-sampled to one point per cube of this side."""
    normal_neighbours: int = Field(20, ge=5)
    """Points from which a normal is estimated."""
    harris_radius_m: float = Field(0.15, gt=0)
    """Neighbourhood whose normals tell a key point."""
    key_point_separation_m: float = Field(0.06, gt=0)
    """A key point has the strongest response so far around."""
    least_response: float = Field(2e-6, ge=0)
    """Weaker responses above that of a plane (at most 1/27) are no key points."""
    key_points: int = Field(400, ge=0)
    """At most so many per cloud, the strongest; with 0 ICP starts from the estimate alone."""
    shot_radius_m: float = Field(0.6, gt=0)
    """Ball that a descriptor describes."""
    match_ratio: float = Field(0.95, gt=0, le=1)
    """A descriptor's nearest match must be nearer than this part of the distance to the second."""
    ransac_tolerance_m: float = Field(0.1, gt=0)
    """A match agrees with a motion within so much."""
    ransac_trials: int = Field(4000, ge=1)
    """Triples of matches that are drawn."""
    hypotheses: int = Field(3, ge=1)
    """Motions, the best supported ones, that are refined by ICP until one is accepted."""
    icp_reach_m: float = Field(0.1, gt=0)
    """ICP pairs points no farther apart."""
    icp_points: int = Field(1500, ge=100)
    """About so many points of the source, evenly chosen, are laid over all of the target's."""
    icp_iterations: int = Field(20, ge=1)
    """At most."""
    match_distance_m: float = Field(0.05, gt=0)
    """A point is matched if the other cloud has one so near ..."""
    match_angle_rad: float = Field(0.64, gt=0, le=1.6)
    """... whose normal differs by no more than this."""
    least_matched: float = Field(0.5, gt=0, lt=1)
    """A registration is accepted if more than this part of the points of either cloud is matched."""
    slide_m: float = Field(0.3, gt=0)
    """... and if sliding one cloud so far in any direction ..."""
    least_loss: float = Field(0.2, gt=0, lt=1)
    """... loses more than this part of the matched points: walls match however far clouds slide along them ..."""
    max_sigma_m: float = Field(0.1, gt=0)
    """... and if no direction is known worse than this."""
    systematic_sigma_m: float = Field(0.01, ge=0)
    """Errors that residuals do not show (bent depth), added to each axis of the covariance ..."""
    systematic_sigma_rad: float = Field(0.005, ge=0)
    """... and to each angle."""
    effective_points: float = Field(100.0, gt=6)
    """Residuals of neighbouring points err alike: their covariance is that of at most so many independent ones."""
    normal_sigma_rad: float = Field(0.0, ge=0)
    """Least standard deviation of a normal per axis: rings of two clouds err alike, and do not show it."""
    seed: int = Field(0, ge=0)
    """Of RANSAC."""


class ReferenceConfig(_Group):
    """Point clouds at odometry poses -> reference paths."""

    key_frame_m: float = Field(0.1, ge=0)
    """A cloud becomes a node of the graph when the sensor has moved so far since the last one ..."""
    key_frame_rad: float = Field(0.1, ge=0)
    """... or turned so far."""
    local_map_m: float = Field(0.0, ge=0)
    """Odometry is corrected by registering each cloud with the key frames of so many metres before it (0: not) ..."""
    local_range_m: float = Field(20.0, gt=0)
    """... with points no farther from the sensor ..."""
    local_voxel_m: float = Field(0.1, gt=0)
    """... and one per cube of this side."""
    submap_m: float = Field(0.0, ge=0)
    """Each cloud is joined by odometry with those that were taken so far before and after it; 0: it stands alone."""
    chain: int = Field(4, ge=0)
    """Each node is registered with so many that follow it, from odometry's guess; 0: with none."""
    gates_m: tuple[float, ...] = (6.0, 1.5)
    """Rounds of loop closing: nodes whose clouds' middles are so near under the current estimate are candidates."""
    stretch_m: float = Field(0.5, gt=0)
    """Two stretches of path of this length are tried once per round, by the pair whose middles are nearest."""
    max_turn_rad: float = Field(1.0, gt=0)
    """Sensors that look more different ways see different sides of things; π for lidars that look all around."""
    max_drift_rad: float = Field(0.8, gt=0)
    """A loop may turn the estimate by no more than this: corridors look alike forwards and backwards."""
    least_walked_m: float = Field(1.0, ge=0)
    """Nodes of one walk closer along the path than this are no loop candidates."""
    loops_per_stretch: int = Field(4, ge=1)
    """Each stretch is tried with so many others per round, the nearest first."""
    similarity_threshold: float = Field(0.7, ge=0, le=1)
    """Scans of two walks that are so alike make their clouds candidates."""
    radio_candidates: int = Field(3, ge=0)
    """Each scan is tried with so many scans of each other walk, the most similar."""
    least_ties: int = Field(3, ge=1)
    """Two walks are tied by so many registrations or more ..."""
    tie_distance_m: float = Field(3.0, gt=0)
    """... that lay them over each other alike within so much ..."""
    tie_angle_rad: float = Field(0.35, gt=0)
    """... and this."""
    odometry_translation_sigma_m: float = Field(0.1, gt=0)
    """Standard deviation per axis of 1 m moved; grows with the root of the distance."""
    odometry_rotation_sigma_rad: float = Field(0.05, gt=0)
    """Standard deviation per angle of 1 m moved; grows with the root of the distance."""
    odometry_scale_sigma: float = Field(0.02, gt=0, lt=1)
    """Of a walk's metres as a whole, relative; an unknown of the planar graph."""
    loop_loss_scale: float = Field(3.0, gt=0)
    """Where the robust loss of registrations leaves the square in the end, in standard deviations."""
    max_iterations: int = Field(100, ge=1)
    """Of the optimizer."""


class Config(_Group):
    """All of it."""

    odometry: OdometryConfig = OdometryConfig()
    fingerprints: FingerprintConfig = FingerprintConfig()
    uncertainty: UncertaintyConfig = UncertaintyConfig()
    merging: MergingConfig = MergingConfig()
    placement: PlacementConfig = PlacementConfig()
    loops: LoopConfig = LoopConfig()
    directions: DirectionsConfig = DirectionsConfig()
    screening: ScreeningConfig = ScreeningConfig()
    optimizer: OptimizerConfig = OptimizerConfig()
    growing: GrowingConfig = GrowingConfig()
    field: FieldConfig = FieldConfig()
    positioning: PositioningConfig = PositioningConfig()
    registration: RegistrationConfig = RegistrationConfig()
    reference: ReferenceConfig = ReferenceConfig()

    def to_toml(self) -> str:
        """The whole configuration as TOML."""
        return tomli_w.dumps(self.model_dump(mode="json"))


PRESETS: dict[str, dict[str, Any]] = {
    "paper": {},
    "default": {
        "odometry": {"tracker_heading_sigma_rad": 0.05},
        "fingerprints": {"rss_threshold_dbm": -90.0, "representation": "exponential", "max_age_s": 10.0},
        "uncertainty": {"per_axis": True},
        "merging": {"heading_variance": 0.04, "walk_scales": True},
        "loops": {"similarity_threshold": 0.7, "gates_m": [20.0, 8.0], "lag_sigma_s": 3.0},
        "directions": {"use": True},
        "screening": {"rule": "single", "window_m": 3.0, "min_loops_per_walk": 6, "consistency_m": 6.0},
        "optimizer": {"loop_loss": "cauchy", "loss_scale": 0.5},
    },
}
PRESETS["lidar"] = PRESETS["default"] | {
    "registration": {"max_range_m": 8.0, "icp_reach_m": 0.5, "normal_sigma_rad": 0.1},
    "reference": {
        "max_turn_rad": 3.1416,
        "key_frame_m": 1.0,
        "key_frame_rad": 3.1416,
        "submap_m": 1.0,
        "chain": 0,
        "local_map_m": 15.0,
        "least_walked_m": 15.0,
    },
}


def load_config(
    preset: str | None = None,
    file: Path | None = None,
    overrides: Iterable[str] = (),
    environment: Mapping[str, str] | None = None,
) -> Config:
    """Build the effective configuration.

    Args:
        preset: ``paper`` or ``default``; without it what the file's top-level ``preset`` key says, else ``default``.
        file: TOML with any subset of the keys.
        overrides: ``group.key=value`` texts, TOML values (bare words count as strings).
        environment: ``RADIOSLAM_SET_GROUP__KEY`` variables are read from here; default ``os.environ``.

    Raises:
        ConfigError: unknown preset, unknown key, wrong type, or value out of range.
    """
    settings = _read_file(file) if file else {}
    named = settings.pop("preset", "default")
    preset = named if preset is None else preset
    if not isinstance(preset, str) or preset not in PRESETS:
        raise ConfigError(f"unknown preset {preset!r}; expected one of {', '.join(PRESETS)}")
    merged = _merge(PRESETS[preset], settings)
    for key, text in _from_environment(os.environ if environment is None else environment):
        merged = _merge(merged, _nested(key, text))
    for override in overrides:
        key, equals, text = override.partition("=")
        if not equals:
            raise ConfigError(f"expected group.key=value, found {override!r}")
        merged = _merge(merged, _nested(key.strip(), text.strip()))
    try:
        return Config.model_validate(merged)
    except ValidationError as error:
        raise ConfigError(_one_line(error)) from None


def _read_file(file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(file.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ConfigError(f"{file}: expected a TOML file, found: {error}") from None


def _from_environment(environment: Mapping[str, str]) -> list[tuple[str, str]]:
    names = sorted(name for name in environment if name.startswith(ENVIRONMENT_PREFIX))
    return [(n.removeprefix(ENVIRONMENT_PREFIX).lower().replace("__", "."), environment[n]) for n in names]


def _nested(dotted_key: str, text: str) -> dict[str, Any]:
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text
    for part in reversed(dotted_key.split(".")):
        value = {part: value}
    return dict(value)


def _merge(base: Mapping[str, Any], top: Mapping[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in top.items():
        below = merged.get(key)
        merged[key] = _merge(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
    return merged


def _one_line(error: ValidationError) -> str:
    first = error.errors()[0]
    key = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        return f"unknown key {key!r}; `radioslam config` prints the known ones"
    return f"{key} = {first['input']!r}: {first['msg']}"
