"""Versions grow from the one before while walks come in; where they must not, or it pays, they are made in full."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from radioslam.config import load_config
from radioslam.results import SlamResult
from radioslam.server.map_files import GROWING
from radioslam.server.settings import Settings
from radioslam.server.standing import STANDING
from radioslam.simulator import simulate
from radioslam.slam import map_walks
from tests.server.apart import apart_m
from tests.server.service import Service

WALKS = simulate("office", seed=1, walks=10)
TOLERANCE_M = 1.2
"""Mean distance between a grown map and a batch run of the same ten walks; stated in docs/service.md."""


@pytest.fixture
def service(database_url, tmp_path):
    """A service that makes a map whenever it is asked to look and walks changed."""
    with Service(Settings(data=tmp_path / "data", database=database_url, worker=False, map_every_s=0.001)) as one:
        yield one


def send(service, walks, site="office"):
    for walk in walks:
        service.send_walk(walk, site=site, device=walk.device)
    service.build()


def newest(service, site="office"):
    return service.get(f"/sites/{site}/maps/latest")["summary"]


def served(service, tmp_path, site="office"):
    content = service.ask("GET", f"/sites/{site}/maps/latest/files", expect=200).content
    archive = zipfile.ZipFile(io.BytesIO(content))
    assert not any(name.startswith(GROWING) for name in archive.namelist())
    folder = tmp_path / f"{site}-{service.get(f'/sites/{site}')['map_version']}"
    archive.extractall(folder)
    return SlamResult.load(folder / "floor-0")


@pytest.mark.parametrize("starts", ["common", "known", "mixed", "unknown"])
def test_a_grown_map_agrees_with_the_batch_map_of_the_same_walks(service, tmp_path, starts):
    service.make_site(starts=starts)
    send(service, WALKS[:9])
    assert newest(service)["made"] == "full"
    send(service, WALKS[9:])
    assert newest(service)["made"] == "grown"
    assert newest(service)["floors"][0]["laid"] == 1
    assert service.get("/sites/office/build")["made"] == "grown"
    truth = map_walks(WALKS, load_config("default", overrides=[f"merging.starts={starts}"], environment={}))
    grown = served(service, tmp_path)
    assert apart_m(grown, truth, aligned=starts == "unknown") < TOLERANCE_M


def test_an_ordered_map_is_made_in_full(service, tmp_path):
    service.make_site()
    send(service, WALKS[:9])
    send(service, WALKS[9:])
    service.post("/sites/office/build", expect=202)
    service.build()
    assert newest(service)["made"] == "full"
    assert newest(service)["floors"][0]["why"] == "it was ordered"
    truth = map_walks(WALKS, load_config("default", overrides=["merging.starts=common"], environment={}))
    np.testing.assert_allclose(served(service, tmp_path).radio_map.poses, truth.radio_map.poses, atol=1e-9)


def test_after_a_walk_was_withdrawn_the_map_is_as_if_it_had_never_been_sent(service, tmp_path):
    service.make_site()
    send(service, WALKS[:9])
    send(service, WALKS[9:])
    service.post(f"/sites/office/walks/{WALKS[9].name}/withdraw", expect=200)
    service.build()
    assert newest(service)["floors"][0]["why"] == "1 walks were taken out"
    service.make_site("clean")
    send(service, WALKS[:9], "clean")
    ours, clean = served(service, tmp_path), served(service, tmp_path, "clean")
    np.testing.assert_array_equal(ours.radio_map.poses, clean.radio_map.poses)


def test_after_an_erasure_the_map_is_as_if_the_walk_had_never_been_sent(service, tmp_path):
    service.make_site()
    send(service, WALKS[:9])
    service.send_walk(WALKS[9], device=WALKS[9].device, contributor="anna")
    service.build()
    assert newest(service)["made"] == "grown"
    service.ask("DELETE", "/contributors/anna", expect=200)
    service.build()
    assert newest(service)["floors"][0]["why"] in ("walks were erased", "it was ordered")
    service.make_site("clean")
    send(service, WALKS[:9], "clean")
    ours, clean = served(service, tmp_path), served(service, tmp_path, "clean")
    np.testing.assert_array_equal(ours.radio_map.poses, clean.radio_map.poses)


def test_floors_grow_apart_and_a_version_with_a_full_one_is_full(service):
    service.make_site()
    for floor in ("1", "2"):
        for walk in WALKS[:8]:
            service.send_walk(replace(walk, name=f"f{floor}-{walk.name}"), floor=floor)
    service.build()
    service.send_walk(replace(WALKS[8], name="f2-more"), floor="2")
    service.build()
    assert [(floor["made"], floor["laid"]) for floor in newest(service)["floors"]] == [("grown", 0), ("grown", 1)]
    assert newest(service)["made"] == "grown"
    for walk in WALKS[3:9]:
        service.send_walk(replace(walk, name=f"f1-new-{walk.name}"), floor="1")
    service.build()
    assert [floor["made"] for floor in newest(service)["floors"]] == ["full", "grown"]
    assert newest(service)["made"] == "full"


def test_where_headings_are_unknown_every_version_is_full(service):
    service.make_site(heading="unknown")
    send(service, WALKS[:9])
    send(service, WALKS[9:])
    assert newest(service)["made"] == "full"


def test_a_walk_that_went_on_is_laid_in_anew(service, tmp_path):
    from radioslam.server.replay import batches

    service.make_site()
    send(service, WALKS[:9])
    last = WALKS[9]
    service.post("/sites/office/walks", {"name": last.name, "device": last.device}, expect=201)
    sent = [batch for _, batch in batches(last, 30.0)]
    for part in (sent[: len(sent) // 2], sent[len(sent) // 2 :]):
        for batch in part:
            service.post(f"/sites/office/walks/{last.name}/batches", batch, expect=200)
        service.build()
        assert newest(service)["made"] == "grown"
    result = served(service, tmp_path)
    assert result.walks == tuple(walk.name for walk in WALKS)
    assert np.sum(result.radio_map.walk == 9) == len(last.wifi)


def test_many_new_walks_pay_for_a_full_map(service):
    service.make_site()
    send(service, WALKS[:4])
    send(service, WALKS[4:])
    assert newest(service)["floors"][0]["why"] == "so much is new that a full optimization pays"


@pytest.mark.parametrize("content", ["", "[]", json.dumps({"made_by": [], "floors": [], "walks": {}})])
def test_a_state_that_cannot_be_read_or_is_of_another_program_makes_a_full_map(service, content):
    service.make_site()
    send(service, WALKS[:9])
    version = service.settings.maps / "office" / "1"
    (version / GROWING / STANDING).write_text(content)
    send(service, WALKS[9:])
    assert newest(service)["made"] == "full"
    assert not (version / GROWING).exists(), "only the newest version keeps what the next one grows from"
