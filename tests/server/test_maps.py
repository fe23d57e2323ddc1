"""The map: made of what came, versioned, without withdrawn walks, and served while a new one is made."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest

from radioslam.config import load_config
from radioslam.results import SlamResult
from radioslam.server.worker import MOST_ATTEMPTS, Worker
from radioslam.simulator import simulate
from radioslam.slam import map_walks

WALKS = simulate("office", seed=1, walks=4)


@pytest.fixture
def mapped(service):
    service.make_site()
    for walk in WALKS:
        service.send_walk(walk, device=walk.device, floor=walk.floor)
    service.build()
    return service


def served(service, tmp_path, version="latest"):
    content = service.ask("GET", f"/sites/office/maps/{version}/files", expect=200).content
    zipfile.ZipFile(io.BytesIO(content)).extractall(tmp_path / str(version))
    return SlamResult.load(tmp_path / str(version) / "floor-0")


def test_the_map_is_the_one_that_radioslam_map_makes(mapped, tmp_path):
    truth = map_walks(WALKS, load_config("default", overrides=["merging.starts=common"]))
    result = served(mapped, tmp_path)
    assert result.walks == truth.walks
    np.testing.assert_allclose(result.radio_map.poses, truth.radio_map.poses, atol=1e-9)
    summary = mapped.get("/sites/office/maps/latest")["summary"]
    assert summary["floors"][0]["floor"] == "F1"
    assert summary["skipped"] == []


def test_withdrawn_is_as_never_sent(mapped, tmp_path):
    mapped.post("/sites/office/walks/office-01/withdraw", expect=200)
    mapped.build()  # the pause between maps is not over
    assert mapped.get("/sites/office")["map_version"] == 1
    mapped.post("/sites/office/build", expect=202)
    mapped.build()
    rest = [walk for walk in WALKS if walk.name != "office-01"]
    truth = map_walks(rest, load_config("default", overrides=["merging.starts=common"]))
    np.testing.assert_allclose(served(mapped, tmp_path, 2).radio_map.poses, truth.radio_map.poses, atol=1e-9)
    assert served(mapped, tmp_path, 1).walks == tuple(walk.name for walk in WALKS)
    mapped.post("/sites/office/walks/office-01/withdraw?restore=true", expect=200)
    mapped.post("/sites/office/build", expect=202)
    mapped.build()
    np.testing.assert_array_equal(
        served(mapped, tmp_path, 3).radio_map.poses, served(mapped, tmp_path, 1).radio_map.poses
    )


def test_what_the_page_shows(mapped):
    place = "/sites/office/maps/1"
    paths = mapped.get(f"{place}/paths")
    assert [one["walk"] for one in paths] == [walk.name for walk in WALKS]
    assert len(paths[0]["estimate"]) == len(paths[0]["odometry"]) == len(paths[0]["time_s"])
    loops = mapped.get(f"{place}/loops")
    assert len(loops["rows"][0]) == len(loops["columns"])
    points = mapped.get(f"{place}/access-points")
    heat = mapped.get(f"{place}/heat", params={"access_point": points[0]["bssid"]})
    assert all(-127 <= row[2] < 0 for row in heat["rows"])
    assert mapped.get(f"{place}/coverage")[0][2] > 0
    assert mapped.get(f"{place}/errors")["tied"]["walks"] == len(WALKS)
    for missing in ("heat?access_point=none", "paths?floor=9"):
        assert mapped.ask("GET", f"{place}/{missing}").status_code == 404
    assert mapped.ask("GET", "/sites/office/maps/2").status_code == 404


def test_floors_are_mapped_apart(service):
    service.make_site()
    for floor in ("1", "2"):
        for walk in WALKS:
            service.send_walk(type(walk)(**{**vars(walk), "name": f"f{floor}-{walk.name}"}), floor=floor)
    service.send_walk(type(WALKS[0])(**{**vars(WALKS[0]), "name": "stray"}))
    service.build()
    info = service.get("/sites/office/maps/latest")["summary"]
    assert [floor["floor"] for floor in info["floors"]] == ["1", "2"]
    assert [one["walk"] for one in info["skipped"]] == ["stray"]
    assert all(one["walk"].startswith("f2") for one in service.get("/sites/office/maps/1/paths", params={"floor": "2"}))


def test_walks_that_cannot_be_mapped_are_named_and_the_map_fails_without_any(service):
    service.make_site()
    service.post("/sites/office/walks", {"name": "silent"}, expect=201)
    service.post("/sites/office/walks/silent/batches", {"sequence": 0}, expect=200)
    service.post("/sites/office/build", expect=202)
    service.build()
    build = service.get("/sites/office/build")
    assert build["state"] == "failed"
    assert "WiFi scans" in build["message"]
    for walk in WALKS[:2]:
        service.send_walk(walk)
    service.post("/sites/office/build", expect=202)
    service.build()
    assert service.get("/sites/office/build")["state"] == "idle"
    assert service.get("/sites/office/maps/latest")["summary"]["skipped"][0]["walk"] == "silent"


def test_a_map_that_kills_the_worker_again_and_again_is_given_up(mapped):
    worker = Worker(mapped.settings)
    try:
        for attempt in range(1, MOST_ATTEMPTS + 1):
            worker._begin("office", "the same walks")
            worker.recover()
            build = mapped.get("/sites/office/build")
            assert (build["attempts"], build["wanted"]) == (attempt, attempt < MOST_ATTEMPTS)
    finally:
        worker.database.close()
    assert build["state"] == "failed"
    assert "died 3 times" in build["message"]
    assert mapped.get("/sites/office")["map_version"] == 1


def test_old_versions_go(service):
    few = service.settings.model_copy(update={"keep_maps": 2})
    service.make_site()
    for walk in WALKS[:2]:
        service.send_walk(walk)
    worker = Worker(few)
    for _ in range(4):
        service.post("/sites/office/build", expect=202)
        worker.run_once()
    worker.database.close()
    assert [one["version"] for one in service.get("/sites/office/maps")] == [4, 3]
    assert sorted(path.name for path in (few.maps / "office").iterdir()) == ["3", "4"]
