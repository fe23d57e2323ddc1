"""What must not be stored is not; all works with hidden addresses; a contributor's walks can be taken out."""

from __future__ import annotations

import io
import sqlite3
import zipfile
import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import select

from radioslam.errors import ConfigError
from radioslam.formats import read_walks, write_walk
from radioslam.map_health import locally_administered
from radioslam.server.privacy import hashed, scrub
from radioslam.server.settings import Settings
from radioslam.server.tables import StoredBatch, StoredMap
from radioslam.simulator import simulate
from tests.server.service import Service

WALKS = simulate("office", seed=1, walks=4)


def test_they_are_dropped_at_the_door_and_names_are_never_stored(service):
    service.make_site()
    service.post("/sites/office/walks", {"name": "a"}, expect=201)
    names = ["Secret Name", "x_nomap", "y_optout", "", None]
    readings = [{"bssid": f"aa:00:00:00:00:0{k}", "rssi_dbm": -50, "ssid": name} for k, name in enumerate(names)]
    answer = service.post(
        "/sites/office/walks/a/batches", {"sequence": 0, "scans": [{"time_s": 1, "readings": readings}]}, expect=200
    )
    assert answer.json()["dropped_readings"] == 3
    with service.context.database.read() as session:
        text = zlib.decompress(session.scalar(select(StoredBatch.body))).decode()
    assert "aa:00:00:00:00:00" in text
    assert "aa:00:00:00:00:04" in text
    assert not any(part in text for part in ("Secret", "nomap", "optout", "0:01", "0:02", "0:03"))


def test_log_lines_of_such_networks_are_dropped(tmp_path):
    lines = [
        "1560000000000\tTYPE_WIFI\thome\taa:00:00:00:00:00\t-50\t2412\t1560000000000",
        "1560000000000\tTYPE_WIFI\thome_nomap\taa:00:00:00:00:01\t-50\t2412\t1560000000000",
        "1560000000000\tTYPE_WIFI\t\taa:00:00:00:00:02\t-50\t2412\t1560000000000",
    ]
    log = tmp_path / "log.txt"
    log.write_text("\n".join(lines))
    assert scrub(log, "indoor-location") == 2
    assert log.read_text() == lines[0]
    log.write_text(
        "WIFI;1;1;a;b_optout;aa:00:00:00:00:01;-50\nWIFI;1;1;free;aa:00:00:00:00:02;2412;-50\nACCE;1;1;0;0;9;3"
    )
    assert scrub(log, "get-sensor-data") == 1
    assert "optout" not in log.read_text()


@given(st.text(max_size=30), st.binary(min_size=32, max_size=32))
def test_hashes_look_like_addresses_and_keep_the_local_bit(address, secret):
    hidden = hashed(address, secret)
    assert len(hidden) == 17
    assert locally_administered(hidden) == locally_administered(address)
    assert hashed(address, secret) == hidden != hashed(address, secret[::-1] + b"x")


def test_hashed_addresses_map_and_locate_as_plain_ones_do(tmp_path):
    answers = {}
    for hide in (False, True):
        settings = Settings(data=tmp_path / str(hide), hash_bssids=hide, worker=False)
        with Service(settings) as service:
            service.make_site()
            for walk in WALKS:
                service.send_walk(walk)
            service.build()
            scan = readings(WALKS[0], 3)
            answers[hide] = service.post("/sites/office/locate", {"readings": scan}, expect=200).json()
            points = service.get("/sites/office/maps/latest/access-points")
            stored = {point["bssid"] for point in points}
            assert (scan[0]["bssid"] in stored) is not hide
        if hide:
            assert (tmp_path / "True" / "bssid.secret").stat().st_mode & 0o777 == 0o600
            with pytest.raises(ConfigError, match="with --hash-bssids"):
                Service(settings.model_copy(update={"hash_bssids": False}))
    assert answers[True]["here"]
    assert answers[True]["x_m"] == pytest.approx(answers[False]["x_m"], abs=0.01)
    assert answers[True]["radius_m"] == pytest.approx(answers[False]["radius_m"], abs=0.01)


def readings(walk, k):
    rows = walk.wifi.reading_scan == k
    names = [walk.wifi.transmitters[i] for i in walk.wifi.reading_transmitter[rows]]
    return [{"bssid": n, "rssi_dbm": r} for n, r in zip(names, walk.wifi.rss_dbm[rows].tolist(), strict=True)]


def test_a_contributor_exports_and_erases(service, tmp_path):
    service.make_site()
    for k, walk in enumerate(WALKS):
        service.send_walk(walk, contributor="anna" if k == 1 else "others")
    service.build()
    assert {one["walk"] for one in service.get("/sites/office/maps/1/paths")} == {walk.name for walk in WALKS}
    exported = service.ask("GET", "/contributors/anna/export", expect=200).content
    zipfile.ZipFile(io.BytesIO(exported)).extractall(tmp_path / "export")
    write_walk(WALKS[1], tmp_path / "truth")
    mine, truth = read_walks([tmp_path / "export"]), read_walks([tmp_path / "truth"])
    assert [walk.name for walk in mine] == [WALKS[1].name]
    assert mine[0].wifi.rss_dbm.tolist() == truth[0].wifi.rss_dbm.tolist()
    assert service.ask("DELETE", "/contributors/anna", expect=200).json() == {"erased": 1}
    service.build()
    assert [one["version"] for one in service.get("/sites/office/maps")] == [2]
    assert not (service.settings.maps / "office" / "1").exists()
    left = {one["walk"] for one in service.get("/sites/office/maps/latest/paths")}
    assert left == {walk.name for walk in WALKS} - {WALKS[1].name}


def test_when_the_last_walks_are_erased_no_map_is_left(service):
    service.make_site()
    for walk in WALKS[:2]:
        service.send_walk(walk, contributor="anna")
    service.build()
    assert len(service.get("/sites/office/maps/1/paths")) == 2
    service.ask("DELETE", "/contributors/anna", expect=200)
    service.build()
    service.post("/sites/office/locate", {"readings": readings(WALKS[0], 3)}, expect=409)
    assert service.get("/sites/office/maps") == []
    assert service.get("/sites/office/build")["state"] == "failed"
    with service.context.database.read() as session:
        assert session.scalar(select(StoredMap.version)) is None
        assert session.scalar(select(StoredBatch.sequence)) is None
    for walk in WALKS[2:]:
        service.send_walk(walk)
    service.post("/sites/office/build", expect=202)
    service.build()
    assert service.get("/sites/office")["map_version"] == 2  # a number is never used again: nothing old is remembered
    assert [one["walk"] for one in service.get("/sites/office/maps/latest/paths")] == [walk.name for walk in WALKS[2:]]


def test_erased_bytes_leave_the_embedded_database(tmp_path):
    settings = Settings(data=tmp_path, worker=False)
    with Service(settings) as service:
        service.make_site()
        service.post("/sites/office/walks", {"name": "erase-me-please"}, expect=201)
        service.ask("DELETE", "/sites/office/walks/erase-me-please", expect=204)
    with sqlite3.connect(tmp_path / "radioslam.sqlite") as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()
    assert b"erase-me-please" not in (tmp_path / "radioslam.sqlite").read_bytes()
