"""What clients send and get, typed; the OpenAPI description is made of these.

Lengths are metres, times seconds on the phone's own clock, angles radians, strengths dBm. A name is checked so far that
it can be part of a path of files.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints

from radioslam.walk import RSS_RANGE_DBM

LARGEST_TIME_S = 1e11
LARGEST_LENGTH_M = 1e6
LARGEST_NUMBER = 2**31 - 1

Slug = Annotated[str, StringConstraints(pattern=r"^[a-z0-9][a-z0-9-]{0,62}$")]
Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,99}$")]
Label = Annotated[str, StringConstraints(pattern=r"^[^\x00-\x1f\x7f]{0,100}$")]
Address = Annotated[str, StringConstraints(pattern=r"^[!-~]{1,64}$", to_lower=True)]
Time = Annotated[float, Field(ge=-LARGEST_TIME_S, le=LARGEST_TIME_S)]
Metres = Annotated[float, Field(ge=-LARGEST_LENGTH_M, le=LARGEST_LENGTH_M)]
Number = Annotated[float, Field(ge=-1e6, le=1e6)]
Strength = Annotated[float, Field(ge=RSS_RANGE_DBM[0], lt=RSS_RANGE_DBM[1])]
Count = Annotated[int, Field(ge=0, le=LARGEST_NUMBER)]
Latitude = Annotated[float, Field(ge=-90, le=90)]
Longitude = Annotated[float, Field(ge=-180, le=180)]
Role = Literal["upload", "read", "admin"]


def _printable(text: Any) -> Any:
    """A network's name may hold anything, also what is no Unicode; it is only looked at and never stored."""
    return text.encode("utf-8", "replace").decode() if isinstance(text, str) else text


Ssid = Annotated[str, BeforeValidator(_printable), StringConstraints(max_length=200)]


class Message(BaseModel):
    """Base of what clients send: unknown keys and numbers that are none are errors."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)


class Pose(Message):
    """Where the phone's own tracker believes it is, in the walk's own frame."""

    time_s: Time
    x_m: Metres
    y_m: Metres
    heading_rad: Annotated[float, Field(ge=-1000, le=1000)]


class Reading(Message):
    """One access point, or beacon, in a scan."""

    bssid: Address
    rssi_dbm: Strength
    ssid: Ssid | None = None
    """Only looked at, to leave out networks that opted out; blank means hidden. Never stored."""
    frequency_mhz: Annotated[float, Field(ge=0, le=1e6)] | None = None
    last_seen_s: Time | None = None


class Scan(Message):
    """What was heard at a time."""

    time_s: Time
    readings: Annotated[list[Reading], Field(max_length=2000)]


class Fix(Message):
    """A known position in the site's frame."""

    time_s: Time
    x_m: Metres
    y_m: Metres


class Samples(Message):
    """A sensor's samples: ``values`` has a row per time, in the phone's axes (see docs/formats.md)."""

    time_s: list[Time]
    values: list[Annotated[list[Number], Field(min_length=3, max_length=4)]]


class InertialSamples(Message):
    """Raw sensors: m/s² with gravity, rad/s, µT, unit quaternion x, y, z, w from phone to world."""

    accelerometer: Samples | None = None
    gyroscope: Samples | None = None
    magnetometer: Samples | None = None
    rotation_vector: Samples | None = None


class Origin(Message):
    """Latitude and longitude of the zero of a frame, x east and y north."""

    latitude_deg: Latitude
    longitude_deg: Longitude


class Batch(Message):
    """A part of a walk. ``sequence`` numbers the walk's batches; each number is accepted once, in any order.

    What two batches have in common by its time counts once, as the batch of the lower number has it.
    """

    sequence: Count
    poses: list[Pose] = []
    scans: list[Scan] = []
    beacons: list[Scan] = []
    fixes: list[Fix] = []
    fix_origin: Origin | None = None
    fix_sigma_m: Annotated[float, Field(gt=0, le=1000)] | None = None
    inertial: InertialSamples | None = None


class NewSite(Message):
    """A site to make."""

    id: Slug
    title: Label = ""
    starts: Literal["common", "known", "unknown", "mixed"] = "unknown"
    heading: Literal["device", "unknown"] = "device"
    overrides: Annotated[list[Label], Field(max_length=50)] = []
    """``GROUP.KEY=VALUE`` of the mapping's configuration."""


class GeoPoint(Message):
    """A place known in the map's frame and on the globe."""

    x_m: Metres
    y_m: Metres
    latitude_deg: Latitude
    longitude_deg: Longitude


class Georeference(Message):
    """Two or more known points."""

    points: Annotated[list[GeoPoint], Field(min_length=2, max_length=100)]


class NewWalk(Message):
    """A walk to begin; the same again is no error, so that a phone can repeat what got no answer."""

    name: Name
    contributor: Label | None = None
    """Pseudonym under which walks can be exported and erased; default: the key's name."""
    device: Label = ""
    floor: Label = ""


class Finish(Message):
    """The end of a walk; with ``batches`` it is refused until sequences 0 … batches - 1 are all there."""

    batches: Count | None = None


class LocateRequest(Message):
    """One scan."""

    readings: Annotated[list[Reading], Field(min_length=1, max_length=2000)]


class TrackRequest(Message):
    """What a tracked phone recorded since the last request: poses around at least one scan."""

    poses: Annotated[list[Pose], Field(max_length=2000)] = []
    scans: Annotated[list[Scan], Field(max_length=200)] = []


class Accepted(BaseModel):
    """A batch is durable; ``duplicate`` where it was so before."""

    sequence: int
    duplicate: bool
    dropped_readings: int = 0
    """Of hidden networks and of those that opted out."""


class SiteInfo(BaseModel):
    """A site."""

    id: str
    title: str
    starts: str
    heading: str
    overrides: list[str]
    georeference: list[float] | None
    """Latitude and longitude of (0, 0) and the angle (rad) from east to the x axis."""
    walks: int
    map_version: int | None
    has_plan: bool


class WalkInfo(BaseModel):
    """A walk."""

    name: str
    contributor: str
    device: str
    floor: str
    state: Literal["open", "finished", "withdrawn"]
    batches: int
    size_bytes: int


class Uploaded(BaseModel):
    """What became of an uploaded file."""

    walks: list[str]
    duplicates: list[str]
    dropped_readings: int


class BuildInfo(BaseModel):
    """How the making of the map stands."""

    state: Literal["idle", "running", "failed"]
    wanted: bool
    step: str
    attempts: int
    message: str
    changed_s: float
    made: Literal["full", "grown"] | None
    """How the newest version was made: of all walks anew, or grown from the one before."""


class MapInfo(BaseModel):
    """A version of a map, with the numbers of its result folder's ``summary.json``."""

    version: int
    made_s: float
    summary: dict[str, Any]


class LocationInfo(BaseModel):
    """Where a scan was made, or why it is not of this place."""

    here: bool
    map_version: int
    reason: str = ""
    x_m: float | None = None
    y_m: float | None = None
    heading_rad: float | None = None
    sigma_x_m: float | None = None
    sigma_y_m: float | None = None
    radius_m: float | None = None
    """Within it lies the truth with 95 %."""
    floor: str = ""
    floor_probability: float | None = None
    latitude_deg: float | None = None
    longitude_deg: float | None = None


class Problem(BaseModel):
    """The one shape of errors."""

    status: int
    kind: str
    message: str


class ProblemResponse(BaseModel):
    """An error's body."""

    error: Problem
