"""Walks through the door: batches in any order, once each; whole files; what may not be."""

from __future__ import annotations

import io
import random
import zipfile

import numpy as np
import pytest

from radioslam.formats import write_walk
from radioslam.server.replay import batches
from radioslam.server.store import find_walk, load_walk
from radioslam.simulator import simulate

WALK = simulate("office", seed=3, walks=1)[0]
INERTIAL = simulate("office", seed=3, walks=1, inertial=True)[0]


def same(a, b) -> bool:
    """Whether two walks hold the same, whatever they are called."""
    if a.wifi.transmitters != b.wifi.transmitters or (a.odometry is None) != (b.odometry is None):
        return False
    arrays = [
        (a.wifi.scan_time_s, b.wifi.scan_time_s),
        (a.wifi.reading_scan, b.wifi.reading_scan),
        (a.wifi.reading_transmitter, b.wifi.reading_transmitter),
        (a.wifi.rss_dbm, b.wifi.rss_dbm),
        (a.wifi.frequency_mhz, b.wifi.frequency_mhz),
        (a.wifi.last_seen_s, b.wifi.last_seen_s),
    ]
    for name in ("odometry", "reference"):
        for part in ("time_s", "values" if name == "odometry" else "positions_xy"):
            one, other = getattr(a, name), getattr(b, name)
            if (one is None) != (other is None):
                return False
            if one is not None:
                arrays.append((getattr(one, part), getattr(other, part)))
    for sensor in ("accelerometer", "gyroscope", "magnetometer", "rotation_vector") if a.inertial else ():
        one, other = getattr(a.inertial, sensor), getattr(b.inertial, sensor)
        arrays += [(one.time_s, other.time_s), (one.values, other.values)] if one is not None else []
    return all(np.array_equal(one, other, equal_nan=True) for one, other in arrays)


def stored(service, name, site="office"):
    with service.context.database.read() as session:
        return load_walk(session, find_walk(session, site, name))


@pytest.mark.parametrize("walk", [WALK, INERTIAL], ids=["poses", "inertial"])
def test_batches_in_any_order_and_repeated_make_the_walk(service, walk):
    service.make_site()
    service.post("/sites/office/walks", {"name": "a", "device": walk.device}, expect=201, role="upload")
    sent = [batch for _, batch in batches(walk, 20.0)]
    order = [*sent, *sent[::2]]
    random.Random(1).shuffle(order)
    answers = [
        service.post("/sites/office/walks/a/batches", batch, expect=200, role="upload").json() for batch in order
    ]
    assert sum(answer["duplicate"] for answer in answers) == len(sent[::2])
    info = service.post("/sites/office/walks/a/finish", {"batches": len(sent)}, expect=200, role="upload").json()
    assert (info["state"], info["batches"]) == ("finished", len(sent))
    assert same(stored(service, "a"), walk)


def test_overlapping_batches_count_once(service):
    service.make_site()
    service.post("/sites/office/walks", {"name": "a"}, expect=201, role="upload")
    whole = next(batch for _, batch in batches(WALK, 1e6))
    for k, batch in enumerate([batch for _, batch in batches(WALK, 20.0)]):
        service.post("/sites/office/walks/a/batches", {**batch, "sequence": 2 * k}, expect=200)
    service.post("/sites/office/walks/a/batches", {**whole, "sequence": 1}, expect=200)
    assert same(stored(service, "a"), WALK)


def test_same_number_with_other_content_is_refused(service):
    service.make_site()
    service.post("/sites/office/walks", {"name": "a"}, expect=201)
    pose = {"time_s": 1.0, "x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0}
    service.post("/sites/office/walks/a/batches", {"sequence": 4, "poses": [pose]}, expect=200)
    other = service.post("/sites/office/walks/a/batches", {"sequence": 4, "poses": [pose, pose]}, expect=409)
    assert other.json()["error"]["kind"] == "conflict"
    assert "accepted with other content" in other.json()["error"]["message"]


def test_finish_names_what_is_missing_and_closes(service):
    service.make_site()
    service.post("/sites/office/walks", {"name": "a"}, expect=201)
    for k in (0, 2):
        service.post("/sites/office/walks/a/batches", {"sequence": k}, expect=200)
    lacks = service.post("/sites/office/walks/a/finish", {"batches": 4}, expect=409).json()["error"]["message"]
    assert "lacks batches 1, 3;" in lacks
    service.post("/sites/office/walks/a/finish", {}, expect=200)
    service.post("/sites/office/walks/a/finish", {}, expect=200)
    service.post("/sites/office/walks/a/batches", {"sequence": 2}, expect=200)  # had been accepted
    service.post("/sites/office/walks/a/batches", {"sequence": 1}, expect=409)


def test_beginning_twice_is_one_walk_of_one_key(service):
    service.make_site()
    service.post("/sites/office/walks", {"name": "a", "device": "p"}, expect=201, role="upload")
    service.post("/sites/office/walks", {"name": "a", "device": "p"}, expect=200, role="upload")
    service.post("/sites/office/walks", {"name": "a", "device": "q"}, expect=409, role="upload")
    service.post("/sites/office/walks", {"name": "a", "device": "p"}, expect=409, role="admin")
    service.post("/sites/nowhere/walks", {"name": "a"}, expect=404, role="upload")


def test_other_keys_cannot_write_into_a_walk(service):
    from radioslam.server.keys import add_key

    service.make_site()
    service.post("/sites/office/walks", {"name": "a"}, expect=201, role="upload")
    service.keys["other"] = add_key(service.context.database, "other", "upload")
    service.post("/sites/office/walks/a/batches", {"sequence": 0}, expect=403, role="other")
    service.post("/sites/office/walks/a/finish", {}, expect=403, role="other")


def zipped(folder) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(folder.rglob("*")):
            archive.write(path, path.relative_to(folder))
    return packed.getvalue()


def upload(service, name, content, expect=201, role="upload", **query):
    return service.ask(
        "POST", "/sites/office/files", role=role, expect=expect, params={"name": name, **query}, content=content
    )


def test_zip_of_walks_is_read_once(service, tmp_path):
    service.make_site()
    walks = simulate("office", seed=3, walks=2)
    for walk in walks:
        write_walk(walk, tmp_path / "walks")
    content = zipped(tmp_path / "walks")
    assert upload(service, "walks.zip", content).json() == {
        "walks": [walk.name for walk in walks],
        "duplicates": [],
        "dropped_readings": 0,
    }
    assert upload(service, "walks.zip", content).json()["duplicates"] == [walk.name for walk in walks]
    from radioslam.formats import read_walks

    for walk in read_walks([tmp_path / "walks"]):
        assert same(stored(service, walk.name), walk)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.txt", b"nothing of use", "expected"),
        ("a.txt", b"", "expected"),
        ("../../etc/passwd", b"root", "expected"),
        ("a.zip", b"PK\x03\x04 cut short", "expected"),
        ("a.txt.gz", b"\x1f\x8b\x08 broken", "expected"),
        ("a.scans.csv", b"time_s,bssid,rssi_dbm\n1,aa:aa:aa:aa:aa:aa,-50\n", "expected motion"),
        ("a.scans.csv", b"time_s,bssid,rssi_dbm\n1,aa:aa:aa:aa:aa:aa,loud\n", "a.scans.csv:2"),
    ],
)
def test_bad_files_are_named_and_refused(service, name, content, says):
    service.make_site()
    message = upload(service, name, content, expect=422).json()["error"]["message"]
    assert says in message
    assert "/tmp" not in message
    assert service.get("/sites/office/walks") == []
