import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from radioslam.errors import LogError
from radioslam.formats import find_logs, read_walk, sensor_logger
from radioslam.formats.sensor_logger import walk_of_messages

from .samples import (
    SENSOR_LOGGER,
    SENSOR_LOGGER_FILES,
    SENSOR_LOGGER_JSON,
    SENSOR_LOGGER_PUSH,
    T_NS,
    sensor_logger_messages,
    zipped,
)

T_S = T_NS / 1e9
FORMS = {"zip": SENSOR_LOGGER, "json": SENSOR_LOGGER_JSON, "jsonl": SENSOR_LOGGER_PUSH}


def read(folder, content, name="2024-05-17_09-00-00.zip"):
    path = folder / name
    path.write_bytes(content)
    return sensor_logger.read(path)


def changed(**files):
    """The zip with some files replaced, or left out where None."""
    named = {f"{name}.csv": content for name, content in files.items()}
    both = {**SENSOR_LOGGER_FILES, **named}
    return zipped({name: content for name, content in both.items() if content is not None})


@pytest.mark.parametrize("ending", FORMS)
def test_all_forms_hold_the_same_walk(tmp_path, ending):
    walk = read(tmp_path, FORMS[ending], f"office.{ending}")
    assert walk.name == "office"
    assert walk.device == ("" if ending == "jsonl" else "Pixel 7")
    assert walk.wifi.transmitters == ("20:23:00:00:00:0a", "20:23:00:00:00:15")
    np.testing.assert_allclose(walk.wifi.scan_time_s - T_S, [1, 5], atol=1e-6)
    np.testing.assert_array_equal(walk.wifi.reading_scan, [0, 0, 1])
    np.testing.assert_array_equal(walk.wifi.rss_dbm, [-60, -63, -61])
    np.testing.assert_array_equal(walk.wifi.frequency_mhz, [2437, 5180, 5180])
    assert walk.ble.transmitters == ("db:08:d3:33:38:ef",)
    np.testing.assert_array_equal(walk.ble.rss_dbm, [-79])
    inertial = walk.inertial
    np.testing.assert_allclose(inertial.accelerometer.time_s - T_S, [0, 0.02, 9], atol=1e-6)
    np.testing.assert_array_equal(inertial.accelerometer.values[0], [0.3, 0.7, 9.9])
    np.testing.assert_array_equal(inertial.gyroscope.values, [[0.01, 0.02, 0.03]])
    np.testing.assert_array_equal(inertial.magnetometer.values, [[18, 2, -42]])
    np.testing.assert_allclose(inertial.rotation_vector.values, [[0, 0, 0.5**0.5, 0.5**0.5]])


def test_fixes_are_a_reference_as_good_as_the_phone_says(tmp_path):
    reference = read(tmp_path, SENSOR_LOGGER).reference
    assert reference.origin_wgs84 == (48.1, 11.5)
    np.testing.assert_allclose(reference.time_s - T_S, [0.5, 1.5], atol=1e-6)
    np.testing.assert_allclose(reference.positions_xy, [[0, 0], [7.45, 0]], atol=0.01)
    assert reference.sigma_m == pytest.approx((15.1 + 9.06) / 2 / 1.5096, rel=1e-3)


def test_notes_tell_what_was_left_out(tmp_path):
    assert read(tmp_path, SENSOR_LOGGER).notes == (
        "2 readings of hidden networks, _nomap or _optout left out",
        "1 advertisements without RSS or address left out",
        "1 fixes with an accuracy beyond 50 m or none left out",
    )


def test_without_total_acceleration_gravity_is_added(tmp_path):
    accelerometer = read(tmp_path, changed(TotalAcceleration=None)).inertial.accelerometer
    np.testing.assert_allclose(accelerometer.values, [[0.3, 0.7, 9.9], [0, 0.5, 9.8]])


def negated(content):
    head, *rows = content.decode().split()
    negative = [[*row.split(",")[:2], *(str(-float(cell)) for cell in row.split(",")[2:])] for row in rows]
    return "\n".join([head, *map(",".join, negative)]).encode()


@pytest.mark.parametrize("standardised", [False, True])
def test_signs_of_ios_become_those_of_android(tmp_path, standardised):
    metadata = SENSOR_LOGGER_FILES["Metadata.csv"].replace(b",android,", b",ios,")
    files = {name: SENSOR_LOGGER_FILES[f"{name}.csv"] for name in ("Accelerometer", "Gravity")}
    if standardised:
        metadata = metadata.replace(b",false,", b",true,")
    else:
        files = {name: negated(content) for name, content in files.items()}
    walk = read(tmp_path, changed(Metadata=metadata, TotalAcceleration=None, Magnetometer=None, **files))
    np.testing.assert_allclose(walk.inertial.accelerometer.values, [[0.3, 0.7, 9.9], [0, 0.5, 9.8]])
    half_turn = walk.inertial.rotation_vector.values  # x to north: a quarter more than Android's
    np.testing.assert_allclose(np.abs(half_turn), [[0, 0, 1, 0]], atol=1e-9)


@pytest.mark.parametrize(("field_xy", "turned_deg"), [((18, 2), 90), ((2, -18), 180), ((-18, 5), -90), ((-3, 18), 0)])
def test_the_magnetic_field_tells_which_axis_is_north(tmp_path, field_xy, turned_deg):
    x, y = field_xy
    magnetometer = f"time,seconds_elapsed,z,y,x\n{T_NS},0.0,-42,{y},{x}\n".encode()
    attitude = read(tmp_path, changed(Magnetometer=magnetometer)).inertial.rotation_vector.values
    half = np.radians(turned_deg) / 2
    np.testing.assert_allclose(np.abs(attitude @ [0, 0, np.sin(half), np.cos(half)]), 1, atol=1e-9)


def test_pushed_messages_of_an_iphone_are_told_by_gravity():
    messages = sensor_logger_messages()
    for message in messages:
        message["payload"] = [one for one in message["payload"] if one["name"] != "totalacceleration"]
        for one in message["payload"]:
            if one["name"] in ("accelerometer", "gravity"):
                one["values"] = {axis: -float(one["values"][axis]) for axis in "xyz"}
    walk = walk_of_messages(messages, "pushed")
    np.testing.assert_allclose(walk.inertial.accelerometer.values[0], [0.3, 0.7, 9.9])
    assert any("signs of iOS" in note for note in walk.notes)


def test_acceleration_without_gravity_is_no_motion(tmp_path):
    walk = read(tmp_path, changed(TotalAcceleration=None, Gravity=None))
    assert walk.motion is None
    assert "record gravity or total acceleration" in walk.notes[0]


@pytest.mark.parametrize(
    ("quaternion", "kept"),
    [("0.0,0.6,0.0,0.8", False), ("0.0,0.0,0.02549,0.99968", True), ("0.0,0.0,-0.02549,0.99968", True)],
)
def test_orientation_is_taken_in_the_sense_that_turns_gravity_upright(tmp_path, quaternion, kept):
    orientation = f"time,seconds_elapsed,qz,qy,qx,qw\n{T_NS + 10**9},1.0,{quaternion}\n".encode()
    walk = read(tmp_path, changed(Orientation=orientation, Magnetometer=None))
    assert (walk.inertial.rotation_vector is not None) == kept
    if kept:  # the phone lies tilted by 0.051 rad about x: both senses end as the same rotation
        np.testing.assert_allclose(walk.inertial.rotation_vector.values, [[0.02549, 0, 0, 0.99968]], atol=1e-4)
    else:
        assert any("orientation left out" in note for note in walk.notes)


def test_an_unpacked_recording_is_one_log(tmp_path):
    folder = tmp_path / "office"
    folder.mkdir()
    for name, content in SENSOR_LOGGER_FILES.items():
        (folder / name).write_bytes(content)
    assert find_logs([tmp_path]) == [folder / "Accelerometer.csv"]
    assert find_logs([folder / "WiFi.csv"]) == [folder / "Accelerometer.csv"]
    walk = read_walk(folder / "Accelerometer.csv")
    assert (walk.name, walk.wifi.reading_count, walk.device) == ("office", 3, "Pixel 7")


def test_files_may_lie_in_a_folder_of_the_zip_beside_others(tmp_path):
    files = {f"rec/{name}": content for name, content in SENSOR_LOGGER_FILES.items()}
    assert read(tmp_path, zipped({**files, "rec/Camera/1.jpg": b"\xff\xd8\0"})).wifi.reading_count == 3


@given(order=st.permutations(sensor_logger_messages()), twice=st.integers(0, 3))
def test_pushed_messages_may_come_in_any_order_and_twice(order, twice):
    walk = walk_of_messages([*order, *order[:twice]], "pushed")
    expected = walk_of_messages(sensor_logger_messages(), "pushed")
    np.testing.assert_array_equal(walk.wifi.rss_dbm, expected.wifi.rss_dbm)
    np.testing.assert_array_equal(walk.inertial.accelerometer.values, expected.inertial.accelerometer.values)
    assert walk.notes == expected.notes


def test_fields_of_a_push_may_stand_beside_the_time():
    flat = [
        {**message, "payload": [{**one, **one["values"], "values": None} for one in message["payload"]]}
        for message in sensor_logger_messages()
    ]
    assert walk_of_messages(flat, "pushed").wifi.reading_count == 3


@pytest.mark.parametrize(
    ("messages", "message"),
    [
        ([], "records with a sensor, or messages with a payload, found none"),
        ([{"messageId": 0, "payload": 3}], "pushed:1: expected a message with messageId and payload"),
        ([{"messageId": float("nan"), "payload": []}], "a message with messageId and payload"),
        ([{"messageId": 0, "payload": [{"time": 1}]}], "a record with name"),
        ([{"messageId": k, "sessionId": f"s{k}", "payload": []} for k in (0, 1)], "messages of one session"),
        ([{"payload": []}, 7], "pushed:2: expected records with a sensor"),
    ],
)
def test_messages_that_are_none_are_refused(messages, message):
    with pytest.raises(LogError, match=message):
        walk_of_messages(messages, "pushed")


@pytest.mark.parametrize(
    ("name", "old", "new", "line", "message"),
    [
        ("WiFi", b",-63,", b",63,", 3, "RSS in [-127, 0) dBm, found 63"),
        ("WiFi", b"20:23:00:00:00:15", b"Guest", 3, "a BSSID such as"),
        ("Gyroscope", b"0.03", b"nan", 2, "a finite number as z"),
        ("Gyroscope", str(T_NS).encode(), b"1e99", 2, "a time in seconds"),
        ("Orientation", b"0.7071067811865476,0.0", b"0.1,0.0", 2, "a unit quaternion"),
        ("Location", b"48.1\n", b"148.1\n", 2, "a latitude and longitude"),
    ],
)
def test_the_message_names_file_and_line(tmp_path, name, old, new, line, message):
    content = SENSOR_LOGGER_FILES[f"{name}.csv"]
    assert old in content
    with pytest.raises(LogError) as error:
        read(tmp_path, changed(**{name: content.replace(old, new, 1)}))
    assert (error.value.path.name, error.value.line) == (f"{name}.csv", line)
    assert message in str(error.value)


def test_zips_that_hold_no_recording(tmp_path):
    with pytest.raises(LogError, match=r"CSV files such as WiFi\.csv"):
        read(tmp_path, zipped({"a.csv": b"a,b\n"}))
    with pytest.raises(LogError, match="a complete zip file"):
        read(tmp_path, SENSOR_LOGGER[:-40])
    with pytest.raises(LogError, match="one file per sensor, found two of"):
        read(tmp_path, zipped({"a/WiFi.csv": b"x\n", "b/WiFi.csv": b"x\n"}))


def test_a_zip_that_unpacks_to_too_much_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(sensor_logger, "LARGEST_TEXT_BYTES", 1000)
    with pytest.raises(LogError, match="GB of CSV, found more"):
        read(tmp_path, SENSOR_LOGGER)


def test_a_missing_file_is_said(tmp_path):
    with pytest.raises(LogError, match="no such file"):
        sensor_logger.read(Path(tmp_path / "a.zip"))


def test_json_of_other_kinds_is_refused(tmp_path):
    with pytest.raises(LogError, match="a record with sensor"):
        read(tmp_path, json.dumps([{"time": "1"}]).encode(), "a.json")
