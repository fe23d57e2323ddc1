"""``radioslam reference`` as people type it."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from radioslam.formats import read_tum, write_tum
from tests.point_cloud.test_clouds import POINTS, write_ply
from tests.point_cloud.test_reference import circle, record
from tests.test_cli import run


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    from radioslam import rigid

    folder = tmp_path_factory.mktemp("clouds")
    recording = record(folder, circle(30)[:22])
    np.savetxt(folder / "walk" / "mount.txt", recording.T_body_sensor)
    write_tum(folder / "walk.tum", recording.time_s, rigid.to_planar(recording.T_odom_body))
    return folder


def test_the_folder_holds_all_that_is_promised(walk, tmp_path, capsys):
    code, out, _ = run(capsys, "reference", walk / "walk", "--odometry", walk / "walk.tum", "--out", tmp_path / "r")
    assert code == 0
    assert "along the walk" in out
    assert "rejected:" in out
    written = {path.relative_to(tmp_path / "r").as_posix() for path in (tmp_path / "r").rglob("*") if path.is_file()}
    assert written == {
        "trajectories/walk.tum",
        "graph.g2o",
        "loops.csv",
        "config.toml",
        "summary.json",
        "report.html",
    }
    assert len(read_tum(tmp_path / "r" / "trajectories" / "walk.tum")) == 22
    assert "From above" in (tmp_path / "r" / "report.html").read_text()
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    rows = (tmp_path / "r" / "loops.csv").read_text().splitlines()[1:]
    assert len(rows) == sum(counts["tried"] for counts in summary["loops"].values())
    assert sum(",true," in row for row in rows) == sum(counts["accepted"] for counts in summary["loops"].values())


def test_an_existing_folder_is_not_overwritten_unless_told(walk, tmp_path, capsys):
    arguments = ("reference", walk / "walk", "--odometry", walk / "walk.tum", "--out", tmp_path / "r", "--json")
    (tmp_path / "r").mkdir()
    code, _, message = run(capsys, *arguments)
    assert code == 1
    assert "use --force" in message
    code, out, _ = run(capsys, *arguments, "--force", "--set", "reference.gates_m=[1.0]")
    assert code == 0
    assert json.loads(out)["planar"]


def test_without_the_extra_one_line_says_what_to_install(walk, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "small_gicp", None)
    code, out, message = run(
        capsys, "reference", walk / "walk", "--odometry", walk / "walk.tum", "--out", tmp_path / "r"
    )
    assert (code, out) == (1, "")
    assert message == "radioslam: point clouds need small_gicp; install it with: pip install 'radioslam[pointcloud]'"


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda points: points[:0], "found an empty cloud"),
        (lambda points: np.where(np.arange(len(points))[:, None] == 5, np.nan, points), "found 1 of 500 with NaN"),
        (lambda points: points * [1, 1, 0] + [0, 0, 1], "all of them on a plane"),
        (lambda points: points * [1, 0, 0] + [0, 1, 1], "all of them on a line"),
        (lambda points: points * 1000, "as if in millimetres; try --unit 0.001"),
    ],
)
def test_bad_clouds_are_one_clear_line(tmp_path, capsys, spoil, message):
    (tmp_path / "walk").mkdir()
    for k in range(3):
        write_ply(tmp_path / "walk" / f"{k}.ply", spoil(POINTS).astype(np.float32))
    write_tum(tmp_path / "walk.tum", np.arange(3.0), np.column_stack([np.arange(3.0), np.zeros((3, 2))]))
    code, out, error = run(
        capsys, "reference", tmp_path / "walk", "--odometry", tmp_path / "walk.tum", "--out", tmp_path / "r"
    )
    assert (code, out) == (1, "")
    assert message in error
    assert "\n" not in error
    assert not (tmp_path / "r").exists()


def test_missing_poses_and_intrinsics_are_one_clear_line(walk, tmp_path, capsys):
    import shutil

    code, _, error = run(capsys, "reference", walk / "walk", "--out", tmp_path / "r")
    assert code == 1
    assert "000.pose.txt: expected the cloud's pose (or --odometry TUM), found no such file" in error
    shutil.copytree(walk / "walk", tmp_path / "walk")
    (tmp_path / "walk" / "camera-intrinsics.txt").unlink()
    code, _, error = run(
        capsys, "reference", tmp_path / "walk", "--odometry", walk / "walk.tum", "--out", tmp_path / "r"
    )
    assert code == 1
    assert "camera-intrinsics.txt: expected intrinsics of the depth camera, found no such file" in error


def test_simulate_gives_walks_with_clouds(tmp_path, capsys):
    code, _, _ = run(capsys, "simulate", "office", "--walks", 1, "--clouds", "depth", "--out", tmp_path / "w")
    assert code == 0
    folder = tmp_path / "w" / "office-00" / "clouds"
    names = {path.name for path in folder.iterdir()}
    assert {"camera-intrinsics.txt", "mount.txt", "clouds.txt", "frame-000000.depth.png"} <= names
    code, _, error = run(capsys, "simulate", "--drift", tmp_path / "w", "--clouds", "depth", "--out", tmp_path / "x")
    assert code == 1
    assert "--clouds: expected a building" in error
    code, _, error = run(capsys, "simulate", "office", "--clouds", "sonar", "--out", tmp_path / "x")
    assert code == 1
    assert "--clouds: expected depth or lidar, found 'sonar'" in error


def test_a_simulated_lidar_walk_becomes_its_reference_path(tmp_path, capsys):
    """From ``simulate --clouds lidar`` to ``reference --preset lidar``, on the first seconds of a walk."""
    from benchmarks.reference_walks import errors, truth_of

    walks, result = tmp_path / "w", tmp_path / "r"
    code, _, _ = run(capsys, "simulate", "office", "--walks", 1, "--seed", 2, "--clouds", "lidar", "--out", walks)
    assert code == 0
    folder = walks / "office-00"
    for path in sorted((folder / "clouds").glob("*.pcd"))[30:]:
        path.unlink()
    last_s = float((folder / "clouds" / "clouds.txt").read_text().splitlines()[29].split()[0])
    trajectory = folder / "trajectory.tum"
    rows = [
        row for row in trajectory.read_text().splitlines() if row.startswith("#") or float(row.split()[0]) <= last_s
    ]
    trajectory.write_text("\n".join(rows) + "\n")
    code, out, _ = run(
        capsys, "reference", walks, "--preset", "lidar", "--set", "registration.key_points=0", "--out", result
    )
    assert code == 0
    assert "odometry corrected by 29 of 30 clouds" in out
    truth = truth_of(folder)
    before, after = errors(trajectory, truth), errors(result / "trajectories" / "office-00.tum", truth)
    assert before[0] > 0.2
    assert after[0] < 0.1 * before[0]
    assert after[0] < 0.05
