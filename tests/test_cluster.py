"""Mapping on a real scheduler with worker processes on loopback, against this process."""

from __future__ import annotations

import os
import signal
import threading
import time

import numpy as np
import pytest

from radioslam.config import load_config
from radioslam.engine import OneMachine
from radioslam.errors import ConfigError
from radioslam.fingerprints import represent
from radioslam.formats import write_walk
from radioslam.object_store import ObjectStore
from radioslam.results import SlamResult
from radioslam.similarity import Pairs
from radioslam.simulator import simulate
from radioslam.slam import map_walks
from tests.command_line import run
from tests.crowds import office_result, office_walks

pytest.importorskip("dask.distributed")
pytestmark = pytest.mark.filterwarnings("default")

KNOWN = load_config(overrides=["merging.starts=known"], environment={})


@pytest.fixture(scope="module")
def client():
    from radioslam.cluster import connect

    with connect("local", workers=2) as client:
        yield client


@pytest.fixture
def engine(client, tmp_path, monkeypatch):
    from radioslam import cluster
    from radioslam.cluster import ClusterEngine

    monkeypatch.setattr(cluster, "MOST_SHARED", 1.0)  # areas, though the office is small and full of loops
    return ClusterEngine(client, ObjectStore(str(tmp_path / "store")))


def test_the_join_of_tiles_is_the_join(engine, monkeypatch):
    from radioslam import cluster

    monkeypatch.setattr(cluster, "FEWEST_SCANS", 30)
    samples = office_result("default", "known").radio_map
    strengths = represent(samples.rss_dbm, KNOWN.fingerprints)
    here, there = (Pairs.collect(one.join(strengths, 0.7)) for one in (OneMachine(), engine))
    np.testing.assert_array_equal(here.i, there.i)
    np.testing.assert_array_equal(here.j, there.j)
    np.testing.assert_allclose(here.similarity, there.similarity, rtol=1e-12)


def test_a_site_in_tiles_and_areas_is_mapped_as_on_one_machine(engine, tmp_path):
    here = office_result("default", "known")
    there = map_walks(office_walks(), KNOWN, engine=engine)
    assert np.hypot(*(here.radio_map.poses - there.radio_map.poses)[:, :2].T).max() < 0.05
    np.testing.assert_allclose(there.radio_map.sigma_m, here.radio_map.sigma_m, rtol=0.02)
    assert len(there.loops.kept) == pytest.approx(len(here.loops.kept), rel=0.05)
    assert list((tmp_path / "store").iterdir()) == []


def test_areas_that_share_too_much_are_optimized_on_one_machine(engine, monkeypatch):
    from radioslam import cluster

    monkeypatch.setattr(cluster, "MOST_SHARED", 0.0)
    graph = office_result("default", "known").graph
    here = OneMachine().optimize(graph, KNOWN.optimizer, last=False)
    np.testing.assert_array_equal(engine.optimize(graph, KNOWN.optimizer, last=False).x, here.x)


def _kill_one(client, after_s):
    victim = next(iter(client.run(os.getpid).values()))

    def kill():
        time.sleep(after_s)
        os.kill(victim, signal.SIGKILL)

    thread = threading.Thread(target=kill)
    thread.start()

    def died():
        thread.join()
        client.wait_for_workers(2, timeout=60)
        return victim not in client.run(os.getpid).values()

    return died


def test_a_worker_killed_in_mid_job_changes_nothing(client, engine):
    here = map_walks(office_walks(), KNOWN, engine=engine)
    client.wait_for_workers(2, timeout=60)
    died = _kill_one(client, 0.3)
    there = map_walks(office_walks(), KNOWN, engine=engine)
    assert died()
    np.testing.assert_allclose(there.radio_map.poses[:, :2], here.radio_map.poses[:, :2], atol=1e-6)


@pytest.fixture(scope="module")
def sites(tmp_path_factory):
    """Four small sites as folders of logs."""
    root = tmp_path_factory.mktemp("sites")
    for seed in range(4):
        folder = root / f"site-{seed}"
        folder.mkdir()
        for walk in simulate("office", seed=seed, walks=4):
            write_walk(walk, folder)
    return root


def test_sites_in_parallel_give_the_results_of_one_machine_though_a_worker_dies(client, sites, tmp_path):
    from radioslam.cluster import map_sites
    from radioslam.formats import read_walks

    client.wait_for_workers(2, timeout=60)
    logs = {folder.name: [folder] for folder in sorted(sites.iterdir())}
    died = _kill_one(client, 1.0)
    totals = map_sites(client, logs, KNOWN, ObjectStore(str(tmp_path / "results")))
    assert died()
    for name, paths in logs.items():
        there, here = SlamResult.load(tmp_path / "results" / name), map_walks(read_walks(paths), KNOWN)
        np.testing.assert_allclose(there.radio_map.poses, here.radio_map.poses, atol=1e-9)
        assert totals[name]["scans"] == len(here.radio_map)
    assert sorted(path.name for path in (tmp_path / "results").iterdir()) == sorted(logs)


def test_a_site_that_cannot_be_mapped_tells_why_and_the_others_are(client, sites, tmp_path):
    from radioslam.cluster import map_sites

    empty = tmp_path / "empty"
    empty.mkdir()
    totals = map_sites(
        client, {"empty": [empty], "good": [sites / "site-0"]}, KNOWN, ObjectStore(str(tmp_path / "out"))
    )
    assert "reason" in totals["empty"]
    assert totals["good"]["walks"] == 4


def test_the_command_line_maps_on_a_cluster_by_its_address(client, sites, tmp_path, capsys):
    address = client.scheduler.address
    assert address.startswith("tcp://127.0.0.1:")
    common = ("--starts", "known", "-q")
    assert run(capsys, "map", sites / "site-1", "--out", tmp_path / "here", *common)[0] == 0
    assert run(capsys, "map", sites / "site-1", "--out", tmp_path / "there", "--cluster", address, *common)[0] == 0
    here, there = (SlamResult.load(tmp_path / name).radio_map.poses for name in ("here", "there"))
    assert np.hypot(*(here - there)[:, :2].T).max() < 0.05
    code, output, _ = run(
        capsys, "map-sites", sites, "--starts", "known", "--out", tmp_path / "all", "--cluster", address
    )
    assert code == 0
    assert output.count('"walks": 4') == 4
    assert SlamResult.load(tmp_path / "all" / "site-2").walks


def test_nobody_at_an_address_is_told(capsys, sites, tmp_path, monkeypatch):
    from radioslam import cluster

    monkeypatch.setattr(cluster, "ANSWER_S", 0.5)
    code, _, error = run(capsys, "map", sites / "site-0", "--out", tmp_path / "r", "--cluster", "tcp://127.0.0.1:9")
    assert code == 1
    assert "expected a Dask scheduler at tcp://127.0.0.1:9" in error
    with pytest.raises(ConfigError), cluster.connect("nonsense://"):
        pass
