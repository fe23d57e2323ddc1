"""Apps that exist: the location APIs of Google and Mozilla as they have them, and Sensor Logger's push."""

from __future__ import annotations

import json
import random
import zlib

import numpy as np
import pytest
from sqlalchemy import select

from radioslam.georeference import frame_to_wgs84
from radioslam.server.store import find_walk, load_walk
from radioslam.server.tables import StoredBatch
from radioslam.simulator import simulate
from tests.server.test_privacy import readings

WALKS = simulate("office", seed=1, walks=6)
TIE = (53.0, 71.0, 0.3)
NOW_S = 1_700_000_000
ONE_NETWORK = b'{"wifiAccessPoints": [{"macAddress": "aa:bb:cc:dd:ee:ff"}]}'


def tied(service, starts="known"):
    service.make_site(starts=starts)
    at = np.array([[0.0, 0.0], [40.0, 0.0], [0.0, 30.0]])
    points = [
        {"x_m": x, "y_m": y, "latitude_deg": lat, "longitude_deg": lon}
        for (x, y), (lat, lon) in zip(at.tolist(), frame_to_wgs84(TIE, at).tolist(), strict=True)
    ]
    service.ask("PUT", "/sites/office/georeference", json={"points": points}, expect=200)


def networks(walk, k):
    return [{"macAddress": r["bssid"].upper(), "signalStrength": int(r["rssi_dbm"])} for r in readings(walk, k)]


def test_geolocate_answers_as_google_does(service):
    tied(service)
    for walk in WALKS:
        service.send_walk(walk)
    service.build()
    body = {"considerIp": False, "wifiAccessPoints": networks(WALKS[0], 3)}
    answer = service.ask("POST", f"/v1/geolocate?key={service.keys['read']}", json=body, headers={"Authorization": ""})
    assert answer.status_code == 200, answer.text
    answer = answer.json()
    assert set(answer) == {"location", "accuracy"}
    truth = frame_to_wgs84(TIE, WALKS[0].reference.at(WALKS[0].wifi.scan_time_s[3:4]))[0]
    assert abs(answer["location"]["lat"] - truth[0]) * 111_300 < 15
    assert abs(answer["location"]["lng"] - truth[1]) * 67_000 < 15


@pytest.mark.parametrize(
    ("path", "role", "body", "code", "reason", "domain"),
    [
        ("/v1/geolocate", "read", b"{no json", 400, "parseError", "global"),
        ("/v1/geolocate", "read", b"[]", 400, "parseError", "global"),
        ("/v1/geolocate", "read", b'{"wifiAccessPoints": 3}', 400, "parseError", "global"),
        ("/v1/geolocate", "read", b"", 404, "notFound", "geolocation"),
        ("/v1/geolocate", "read", ONE_NETWORK, 404, "notFound", "geolocation"),
        ("/v1/geolocate", "upload", b"{}", 400, "keyInvalid", "usageLimits"),
        ("/v2/geosubmit", "read", b"{}", 400, "keyInvalid", "usageLimits"),
        ("/v2/geosubmit", "upload", b"{}", 400, "parseError", "global"),
    ],
)  # fmt: skip
def test_errors_are_those_of_the_apis(service, path, role, body, code, reason, domain):
    answer = service.ask("POST", path, role=role, content=body)
    assert answer.status_code == code
    error = answer.json()["error"]
    assert (error["code"], error["errors"][0]["reason"], error["errors"][0]["domain"]) == (code, reason, domain)
    assert error["message"] == error["errors"][0]["message"]


def test_geosubmit_reports_become_a_map(service):
    tied(service)
    items = []
    for walk in WALKS[:3]:
        degrees = frame_to_wgs84(TIE, walk.reference.at(walk.wifi.scan_time_s))
        for k, (lat, lon) in enumerate(degrees.tolist()):
            if np.isfinite(lat):
                position = {"latitude": lat, "longitude": lon, "accuracy": 3.0}
                items.append(
                    {
                        "timestamp": (NOW_S + len(items)) * 1000,
                        "position": position,
                        "wifiAccessPoints": networks(walk, k),
                    }
                )
    far = {
        "timestamp": NOW_S * 1000,
        "position": {"latitude": 10.0, "longitude": 10.0},
        "wifiAccessPoints": networks(WALKS[0], 1),
    }
    for _ in range(2):  # repeated, as a phone does that got no answer
        assert service.post("/v2/geosubmit", {"items": [*items, far]}, expect=200, role="upload").json() == {}
    (walk,) = service.get("/sites/office/walks")
    assert walk["batches"] == 1
    service.build()
    body = {"wifiAccessPoints": networks(WALKS[4], 5)}
    answer = service.post("/v1/geolocate", body, expect=200, role="read").json()
    truth = frame_to_wgs84(TIE, WALKS[4].reference.at(WALKS[4].wifi.scan_time_s[5:6]))[0]
    assert abs(answer["location"]["lat"] - truth[0]) * 111_300 < 20
    service.ask("GET", "/sites/office/maps/1/paths", expect=404)


def messages(session="s-1"):
    rng = np.random.default_rng(0)
    made = []
    for k in range(8):
        time_ns = [int((NOW_S + k + i / 50) * 1e9) for i in range(50)]
        payload = []
        for at in time_ns:
            x, y, z = rng.normal(0, 1, 3).tolist()
            payload.append({"name": "accelerometer", "time": at, "values": {"x": x, "y": y, "z": z}})
            payload.append({"name": "gravity", "time": at, "values": {"x": 0.0, "y": 0.0, "z": 9.81}})
            payload.append({"name": "gyroscope", "time": at, "values": {"x": x, "y": y, "z": z}})
        for ssid, last in (("Home", "1"), ("x_nomap", "2"), ("", "3")):
            values = {"bssid": f"aa:bb:cc:00:00:0{last}", "ssid": ssid, "level": -50, "frequency": 2412}
            payload.append({"name": "wifi", "time": time_ns[0], "values": values})
        made.append({"messageId": k, "sessionId": session, "deviceId": "phone", "payload": payload})
    return made


def test_sensor_logger_pushes_out_of_order(service):
    service.make_site()
    sent = [*messages(), *messages()[:3]]
    random.Random(2).shuffle(sent)
    answers = [service.post("/sites/office/sensor-logger", m, expect=200, role="upload").json() for m in sent]
    assert sum(answer["duplicate"] for answer in answers) == 3
    assert all(answer["dropped_readings"] == 2 for answer in answers)
    with service.context.database.read() as session:
        walk = load_walk(session, find_walk(session, "office", "sensor-logger-s-1"))
        text = "".join(zlib.decompress(body).decode() for body in session.scalars(select(StoredBatch.body)))
    assert walk.wifi.transmitters == ("aa:bb:cc:00:00:01",)
    assert len(walk.wifi) == 8
    assert len(walk.inertial.accelerometer) == 400
    assert walk.inertial.accelerometer.values[:, 2].mean() == pytest.approx(9.81, abs=0.2)
    assert "Home" not in text
    assert "nomap" not in text


def test_sensor_logger_messages_that_make_no_sense_are_refused(service):
    service.make_site()
    for change in (
        {"payload": [{"name": "wifi", "time": 1, "values": {"bssid": "no address", "level": -50}}]},
        {"payload": 3},
        {"messageId": -1},
        {"sessionId": ""},
    ):
        service.post("/sites/office/sensor-logger", {**messages()[0], **change}, expect=422, role="upload")
    assert service.get("/sites/office/walks") == []
    assert json.loads(service.ask("GET", "/sites/office/build", expect=200).content)["state"] == "idle"
