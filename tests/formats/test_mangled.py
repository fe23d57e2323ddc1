"""Whatever the bytes: a walk, or a LogError of one line. Nothing else."""

import gzip
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from radioslam.errors import LogError
from radioslam.formats import FORMATS, read_walk
from radioslam.walk import check_walk

from . import samples
from .samples import INDOOR, OPEN_FOLDER, SCANS, SENSOR, TUM, WIFINE

SAMPLES = {
    "indoor-location": INDOOR,
    "get-sensor-data": SENSOR,
    "wifine": WIFINE,
    "open": SCANS,
    "tum": TUM,
    "ar-session": samples.AR_WIFI,
    "ar-session poses": samples.POSES,
    "ar-session arcore": samples.ARCORE_POSES,
    "ar-session arkit": samples.ARKIT_POSES,
    "termux": samples.TERMUX,
    "iw-scan": samples.IW,
    "wigle": samples.WIGLE,
    "sensor-logger json": samples.SENSOR_LOGGER_JSON,
    "sensor-logger push": samples.SENSOR_LOGGER_PUSH,
}
TOKENS = [
    *(b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e400", b"-", b"", b"0", b"127", b"-128", b"1_0"),
    *(b"\t", b";", b",", b" ", b"\n", b"\r", b"\r\n", b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b'"', b"#", b"%"),
    *(b"{", b"}", b"[", b"]", b"null", b"true", b":", b"1e999", b'""', b"BSS ", b"BSS 20:23:00:00:00:15(on", b"9e99"),
    *(b"1574559495401\tTYPE_WIFI\t", b"\tTYPE_", b"99999999999999999999", b"\xc3\x28", "é".encode()),
]
damaged = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@st.composite
def mangled(draw: st.DrawFn, sample: bytes) -> bytes:
    """The sample with a few pieces replaced, removed, doubled or cut off."""
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(sample)))
        end = min(len(sample), start + draw(st.integers(0, 12)))
        piece = draw(st.sampled_from(TOKENS) | st.binary(max_size=6) | st.just(sample[start:end] * 2))
        sample = sample[:start] + piece + sample[end:]
    return sample[: draw(st.integers(0, len(sample)))] if draw(st.booleans()) else sample


@st.composite
def mangled_fields(draw: st.DrawFn, sample: bytes) -> bytes:
    """The sample with one field of one line replaced, or its lines shuffled."""
    lines = sample.split(b"\n")
    if draw(st.integers(0, 4)) == 0:
        return b"\n".join(draw(st.permutations(lines)))
    row = draw(st.integers(0, len(lines) - 1))
    separator = next((s for s in (b"\t", b";", b",") if s in lines[row]), b" ")
    fields = lines[row].split(separator)
    column = draw(st.integers(0, len(fields) - 1))
    fields[column] = draw(st.sampled_from(TOKENS) | st.floats().map(lambda value: repr(value).encode()))
    lines[row] = separator.join(fields)
    return b"\n".join(lines)


def read_or_refuse(path: Path, format: str = "auto") -> None:
    message = ""
    try:
        check_walk(read_walk(path, format))
    except LogError as error:
        message = str(error)
    assert not message or message.startswith(str(path.parent))
    assert "\n" not in message


@pytest.mark.parametrize("name", SAMPLES)
@damaged
@given(data=st.data())
def test_mangled_logs_are_read_or_refused(name: str, data: st.DataObject, tmp_path: Path) -> None:
    path = tmp_path / ("walk.tum" if name == "tum" else "walk.txt")
    strategy = mangled(SAMPLES[name]) | mangled_fields(SAMPLES[name])
    path.write_bytes(data.draw(strategy))
    read_or_refuse(path)
    read_or_refuse(path, "open" if name == "tum" else name.split()[0])


@pytest.mark.parametrize("partner", sorted(set(OPEN_FOLDER) - {"scans.csv"}))
@damaged
@given(data=st.data())
def test_mangled_partners_are_read_or_refused(partner: str, data: st.DataObject, tmp_path: Path) -> None:
    for name, content in OPEN_FOLDER.items():
        (tmp_path / name).write_bytes(content)
    sample = OPEN_FOLDER[partner]
    (tmp_path / partner).write_bytes(data.draw(mangled(sample) | mangled_fields(sample)))
    read_or_refuse(tmp_path / "scans.csv")


@pytest.mark.parametrize("format", ["auto", *(known.name for known in FORMATS)])
@damaged
@given(content=st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(format: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "walk.csv"
    path.write_bytes(content)
    read_or_refuse(path, format)


@damaged
@given(data=st.data())
def test_mangled_zips_are_read_or_refused(data: st.DataObject, tmp_path: Path) -> None:
    path = tmp_path / "walk.zip"
    path.write_bytes(data.draw(mangled(samples.SENSOR_LOGGER)))
    read_or_refuse(path)
    read_or_refuse(path, "sensor-logger")


@pytest.mark.parametrize("name", sorted(samples.SENSOR_LOGGER_FILES))
@damaged
@given(data=st.data())
def test_mangled_files_of_a_zip_are_read_or_refused(name: str, data: st.DataObject, tmp_path: Path) -> None:
    path, sample = tmp_path / "walk.zip", samples.SENSOR_LOGGER_FILES[name]
    content = data.draw(mangled(sample) | mangled_fields(sample))
    path.write_bytes(samples.zipped({**samples.SENSOR_LOGGER_FILES, name: content}))
    read_or_refuse(path)


@pytest.mark.parametrize("name", ["pose.csv", "ARCore_sensor_pose.txt", "walk.tum"])
@damaged
@given(data=st.data())
def test_mangled_poses_beside_scans_are_read_or_refused(name: str, data: st.DataObject, tmp_path: Path) -> None:
    sample = {"pose.csv": samples.POSES, "walk.tum": TUM}.get(name, samples.ARCORE_POSES)
    (tmp_path / name).write_bytes(data.draw(mangled(sample) | mangled_fields(sample)))
    (tmp_path / "wifi.csv").write_bytes(samples.AR_WIFI)
    read_or_refuse(tmp_path / "wifi.csv")


@damaged
@given(data=st.data())
def test_mangled_gzip_is_refused(data: st.DataObject, tmp_path: Path) -> None:
    path = tmp_path / "walk.txt.gz"
    path.write_bytes(data.draw(mangled(gzip.compress(SENSOR, mtime=0))))
    read_or_refuse(path)
