"""Positions over HTTP: one scan, a followed phone, another place, degrees."""

from __future__ import annotations

import numpy as np
import pytest

from radioslam.server.replay import batches
from radioslam.simulator import simulate
from tests.server.test_privacy import readings

WALKS = simulate("office", seed=1, walks=7)
FAR = [{"bssid": f"aa:bb:cc:00:00:0{k}", "rssi_dbm": -50.0} for k in range(9)]


@pytest.fixture
def mapped(service):
    service.make_site(starts="known")
    for walk in WALKS[:6]:
        service.send_walk(walk)
    service.build()
    return service


def test_scans_of_a_stranger_are_where_they_were_made(mapped):
    walk, errors, inside = WALKS[6], [], []
    for k in range(len(walk.wifi)):
        answer = mapped.post("/sites/office/locate", {"readings": readings(walk, k)}, expect=200, role="read").json()
        if answer["here"]:
            error = np.hypot(*(walk.reference.at(walk.wifi.scan_time_s[k : k + 1])[0] - [answer["x_m"], answer["y_m"]]))
            errors.append(error)
            inside.append(error < answer["radius_m"])
    assert len(errors) > 0.7 * len(walk.wifi)
    assert np.nanmean(errors) < 8
    assert np.mean(inside) > 0.7


def test_another_place_is_not_here(mapped):
    answer = mapped.post("/sites/office/locate", {"readings": FAR}, expect=200).json()
    assert not answer["here"]
    assert "no access point in common" in answer["reason"]
    hidden = [{"bssid": "aa:bb:cc:00:00:01", "rssi_dbm": -50.0, "ssid": ""}]
    assert not mapped.post("/sites/office/locate", {"readings": hidden}, expect=200).json()["here"]


def test_no_map_yet(service):
    service.make_site()
    answer = service.post("/sites/office/locate", {"readings": FAR}, expect=409)
    assert "no map yet" in answer.json()["error"]["message"]


def test_a_phone_is_followed(mapped):
    walk = WALKS[6]
    session = mapped.post("/sites/office/sessions", expect=201, role="read").json()["session"]
    place, errors = f"/sites/office/sessions/{session}", []
    for _, batch in batches(walk, 10.0):
        sent = {"poses": batch["poses"], "scans": batch["scans"]}
        answer = mapped.post(place, sent, expect=200, role="read").json()
        if answer["here"]:
            truth = walk.reference.at(np.array([batch["poses"][-1]["time_s"]]))[0]
            errors.append(np.hypot(*(truth - [answer["x_m"], answer["y_m"]])))
    assert len(errors) > 5
    assert np.nanmean(errors[len(errors) // 2 :]) < 8
    mapped.post(place, {}, expect=404, role="admin")  # another key's
    mapped.post("/sites/office/sessions/unknown", {}, expect=404)


def test_a_session_without_motion_says_what_it_needs(mapped):
    session = mapped.post("/sites/office/sessions", expect=201).json()["session"]
    answer = mapped.post(f"/sites/office/sessions/{session}", {}, expect=200).json()
    assert (answer["here"], answer["reason"]) == (False, "expected two poses and a scan between them; send more")


def test_degrees_where_the_site_is_georeferenced(mapped):
    points = [
        {"x_m": 0, "y_m": 0, "latitude_deg": 53.0, "longitude_deg": 71.0},
        {"x_m": 40, "y_m": 0, "latitude_deg": 53.0, "longitude_deg": 71.000597},
    ]
    mapped.ask("PUT", "/sites/office/georeference", json={"points": points}, expect=200)
    answer = mapped.post("/sites/office/locate", {"readings": readings(WALKS[0], 3)}, expect=200).json()
    assert answer["latitude_deg"] == pytest.approx(53 + answer["y_m"] / 111_300, abs=2e-6)
    assert answer["longitude_deg"] == pytest.approx(71 + answer["x_m"] * 0.000597 / 40, abs=2e-6)
    far = [points[0], {**points[1], "latitude_deg": 54.0}]
    mapped.ask("PUT", "/sites/office/georeference", json={"points": far}, expect=422)
