"""Bodies of geolocate and geosubmit: what is taken, what is passed over, what is refused."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from radioslam.doors import LARGEST_BODY_ITEMS, reports_of_geosubmit, scan_of_geolocate, walk_of_reports
from radioslam.errors import DoorError

A, B, C = "01:23:45:67:89:ab", "01:23:45:67:89:cd", "23:45:67:89:ab:cd"
NOW_S = 1_715_936_400.0


def geolocate(*networks, **more):
    return {"considerIp": True, "wifiAccessPoints": list(networks), **more}


def heard(address, dbm=-51, **more):
    return {"macAddress": address, "signalStrength": dbm, **more}


def item(*networks, **more):
    position = {"latitude": -22.7539192, "longitude": -43.4371081, "accuracy": 10.0, "age": 1000, "source": "gps"}
    return {"timestamp": 1405602028568, "position": position, "wifiAccessPoints": list(networks), **more}


def test_a_geolocate_body_is_a_scan():
    body = geolocate(heard(A, -51, age=3, channel=11, frequency=2412, signalToNoiseRatio=13), heard(B, -70))
    assert scan_of_geolocate(body) == {A: -51, B: -70}


@pytest.mark.parametrize("form", ["01-23-45-67-89-AB", "0123456789ab", "0123.4567.89ab", "01:23:45:67:89:AB"])
def test_addresses_come_in_many_forms(form):
    assert scan_of_geolocate(geolocate(heard(form), heard(B))) == {A: -51, B: -51}


def test_networks_without_strength_count_but_are_no_reading():
    assert scan_of_geolocate(geolocate(heard(A), {"macAddress": B})) == {A: -51}
    assert scan_of_geolocate(geolocate(heard(A), heard(B, -101), heard(C, -9))) == {A: -51}


@pytest.mark.parametrize(
    "address", ["00:00:00:00:00:00", "FF:FF:FF:FF:FF:FF", "01005e901000", "01:23", "", "guest", None, 7]
)
def test_one_network_is_too_few_and_bad_addresses_are_none(address):
    with pytest.raises(DoorError, match="expected 2 or more networks") as error:
        scan_of_geolocate(geolocate(heard(A), heard(address)))
    assert error.value.reason == "notFound"


@pytest.mark.parametrize("ssid", ["home_nomap", "x_optout_y", ""])
def test_networks_that_must_not_be_mapped_are_left_out_and_names_are_not_kept(ssid):
    body = geolocate(heard(A, ssid="Guest"), heard(B, ssid=ssid), heard(C))
    assert scan_of_geolocate(body) == {A: -51, C: -51}


def test_the_same_network_counts_once_with_its_strongest_reading():
    assert scan_of_geolocate(geolocate(heard(A, -60), heard(A.upper(), -50), {"macAddress": A}, heard(B))) == {
        A: -50,
        B: -51,
    }
    with pytest.raises(DoorError):
        scan_of_geolocate(geolocate(heard(A), heard(A)))


def test_two_beacons_are_a_scan_too():
    body = {"bluetoothBeacons": [heard(A, -90, name="b"), heard(B, -127)]}
    assert scan_of_geolocate(body) == {f"ble:{A}": -90, f"ble:{B}": -127}
    with pytest.raises(DoorError):
        scan_of_geolocate({"bluetoothBeacons": [heard(A)], "wifiAccessPoints": [heard(B)]})


@pytest.mark.parametrize(
    "body", [None, [], "x", 3, {"wifiAccessPoints": {}}, {"wifiAccessPoints": [3]}, {"wifiAccessPoints": "ab"}]
)
def test_what_is_no_body_is_a_parse_error(body):
    for parse in (scan_of_geolocate, lambda one: reports_of_geosubmit({"items": [one]}, NOW_S)):
        with pytest.raises(DoorError) as error:
            parse(body)
        assert error.value.reason == "parseError"


def test_a_geosubmit_body_is_reports():
    beacon = heard("ff:74:27:89:5a:77", -110, age=2000, name="beacon")
    (report,) = reports_of_geosubmit(
        {"items": [item(heard(A, -77, age=5000, frequency=2437), {"macAddress": B}, bluetoothBeacons=[beacon])]}, NOW_S
    )
    assert report.time_s == 1405602028.568
    assert report.position == (-22.7539192, -43.4371081, 10.0)
    assert [one.address for one in report.wifi] == [A, B]
    assert (report.wifi[0].rss_dbm, report.wifi[0].frequency_mhz, report.wifi[0].age_s) == (-77, 2437, 5)
    assert math.isnan(report.wifi[1].rss_dbm)
    assert report.beacons[0].rss_dbm == -110


def test_reports_need_two_networks_or_a_beacon():
    items = [item(heard(A)), item(), item(bluetoothBeacons=[heard(A)]), item(heard(A), heard(B))]
    assert len(reports_of_geosubmit({"items": items}, NOW_S)) == 2


@pytest.mark.parametrize(
    "change",
    [
        {"accuracy": 201},
        {"age": 20_001},
        {"age": -20_001},
        {"speed": 51},
        {"latitude": 91},
        {"longitude": None},
        {"latitude": "x"},
    ],
)
def test_positions_that_tell_nothing_are_set_aside(change):
    one = item(heard(A), heard(B))
    one["position"] = {**one["position"], **change}
    (report,) = reports_of_geosubmit({"items": [one]}, NOW_S)
    assert report.position is None


def test_times_outside_the_limits_are_now():
    items = [item(heard(A), heard(B), timestamp=timestamp) for timestamp in (None, 5, 1e14, "soon", float("nan"))]
    assert {report.time_s for report in reports_of_geosubmit({"items": items}, NOW_S)} == {NOW_S}


def test_too_many_items_are_refused():
    with pytest.raises(DoorError, match="send less"):
        reports_of_geosubmit({"items": [{}] * (LARGEST_BODY_ITEMS + 1)}, NOW_S)
    with pytest.raises(DoorError, match="expected an array items"):
        reports_of_geosubmit({}, NOW_S)


def test_reports_are_a_walk_with_a_reference():
    items = [
        item(heard(A, -60 - k, age=500), heard(B), timestamp=1e12 + 5000 * k, bluetoothBeacons=[heard(C, -90)])
        for k in range(3)
    ]
    items[1]["position"] = None
    items[2]["position"] = {"latitude": -22.7539192, "longitude": -43.437, "accuracy": 4.53}
    walk = walk_of_reports(reports_of_geosubmit({"items": items}, NOW_S), "phone")
    np.testing.assert_array_equal(walk.wifi.scan_time_s, 1e9 + np.array([0, 5, 10]))
    assert walk.wifi.as_dicts()[2] == {A: -62, B: -51}
    np.testing.assert_array_equal(walk.wifi.last_seen_s[:1], [1e9 - 0.5])
    assert walk.ble.reading_count == 3
    np.testing.assert_array_equal(walk.reference.time_s, 1e9 + np.array([0, 10]))
    np.testing.assert_allclose(walk.reference.positions_xy[1], [11.1, 0], atol=0.05)
    assert walk.motion is None


def test_a_walk_of_reports_without_positions_has_scans_only():
    walk = walk_of_reports(reports_of_geosubmit({"items": [item(heard(A), heard(B), position=None)]}, NOW_S), "phone")
    assert (walk.reference, walk.ble, walk.wifi.reading_count) == (None, None, 2)


def test_the_error_crosses_process_borders_whole():
    twin = pickle.loads(pickle.dumps(DoorError("notFound", "expected two")))
    assert (twin.reason, str(twin)) == ("notFound", "expected two")


SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from([A, B, "home_nomap"])
)
NAMES = st.sampled_from(
    [
        *("items", "wifiAccessPoints", "bluetoothBeacons", "macAddress", "signalStrength", "age", "frequency", "ssid"),
        *("position", "latitude", "longitude", "accuracy", "speed", "timestamp"),
    ]
)
BODIES = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(NAMES, inner, max_size=5), max_leaves=25
)
FIELDS = st.fixed_dictionaries(
    {"macAddress": st.sampled_from([A, B, C, "x"])},
    optional={"signalStrength": SCALARS, "age": SCALARS, "ssid": SCALARS, "frequency": SCALARS},
)
ITEMS = st.fixed_dictionaries(
    {"wifiAccessPoints": st.lists(FIELDS, max_size=4)},
    optional={
        "timestamp": SCALARS,
        "position": st.none() | st.dictionaries(NAMES, SCALARS),
        "bluetoothBeacons": st.lists(FIELDS, max_size=2),
    },
)


def reason_of(parse, *arguments):
    """Why a body is refused, "" if it is taken."""
    try:
        parse(*arguments)
    except DoorError as error:
        return error.reason
    return ""


@given(BODIES)
def test_whatever_comes_is_taken_or_refused(body):
    assert reason_of(scan_of_geolocate, body) in ("", "parseError", "notFound")
    assert reason_of(reports_of_geosubmit, body, NOW_S) in ("", "parseError")


@given(st.lists(ITEMS, max_size=4))
def test_odd_fields_are_as_if_they_were_not_there(items):
    walk = walk_of_reports(reports_of_geosubmit({"items": items}, NOW_S), "phone")
    assert set(walk.wifi.transmitters) <= {A, B, C}
    assert all(reason_of(scan_of_geolocate, one) in ("", "notFound") for one in items)
