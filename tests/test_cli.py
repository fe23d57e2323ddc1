"""The command line as people type it: each call is a process of its own or runs ``main`` as the script does."""

from __future__ import annotations

import gzip
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from radioslam.formats import write_walk
from tests.command_line import run
from tests.crowds import office_walks


@pytest.fixture(scope="module")
def logs(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("logs")
    for walk in office_walks():
        write_walk(walk, folder)
    return folder


def test_map_prints_a_table_and_writes_the_folder(logs, tmp_path, capsys):
    code, out, _ = run(capsys, "map", logs, "--out", tmp_path / "r")
    assert code == 0
    assert "office-00" in out
    assert "optimizer converged" in out
    assert re.search(r"peak memory \d+ MB", out)
    assert re.search(r"reading \d", out)
    assert (tmp_path / "r" / "report.html").exists()


def test_json_and_the_file_agree(logs, tmp_path, capsys):
    code, out, _ = run(capsys, "map", logs, "--out", tmp_path / "r", "--json")
    printed, saved = json.loads(out), json.loads((tmp_path / "r" / "summary.json").read_text())
    assert code == 0
    assert printed["walks"] == saved["walks"]
    assert printed["peak_memory_mb"] > 0


def test_quiet_prints_nothing(logs, tmp_path, capsys):
    assert run(capsys, "map", logs, "--out", tmp_path / "r", "--quiet") == (0, "", "")


def test_an_existing_result_is_kept_without_force(logs, tmp_path, capsys):
    (tmp_path / "r").mkdir()
    code, _, err = run(capsys, "map", logs, "--out", tmp_path / "r")
    assert code == 1
    assert "--force" in err
    assert list((tmp_path / "r").iterdir()) == []


def test_a_bad_log_stops_with_one_line_that_names_it(logs, tmp_path, capsys):
    bad = tmp_path / "bad.txt.gz"
    bad.write_bytes(gzip.compress(b"1574559495260\tTYPE_WAYPOINT\t81.3\t93.3\n" * 50)[:40])
    code, _, err = run(capsys, "map", logs, bad, "--out", tmp_path / "r")
    assert code == 1
    assert len(err.splitlines()) == 1
    assert str(bad) in err
    assert not (tmp_path / "r").exists()


def test_keep_going_skips_a_bad_log_and_names_it(logs, tmp_path, capsys):
    bad = tmp_path / "bad.csv"
    bad.write_text("time_s,bssid,rssi_dbm\n1.0,aa,soft\n")
    code, out, _ = run(capsys, "map", logs, bad, "--out", tmp_path / "r", "--keep-going", "--json")
    skipped = json.loads(out)["skipped"]
    assert code == 0
    assert [skip["path"] for skip in skipped] == [str(bad)]
    assert "bad.csv:2" in skipped[0]["reason"]


def test_keep_going_with_nothing_left_is_an_error(tmp_path, capsys):
    bad = tmp_path / "bad.csv"
    bad.write_text("time_s,bssid,rssi_dbm\n1.0,aa,soft\n")
    code, _, err = run(capsys, "map", bad, "--out", tmp_path / "r", "--keep-going")
    assert code == 1
    assert "at least one walk" in err


def test_two_logs_of_one_name_are_an_error_that_names_both(logs, tmp_path, capsys):
    twin = write_walk(office_walks()[0], tmp_path)
    code, _, err = run(capsys, "map", logs, tmp_path, "--out", tmp_path / "r")
    assert code == 1
    assert str(twin) in err


def test_an_unknown_key_is_an_error_before_any_log_is_read(tmp_path, capsys):
    code, _, err = run(capsys, "map", tmp_path / "nowhere", "--set", "loops.gate=3")
    assert code == 1
    assert "loops.gate" in err


def test_walks_without_motion_get_simulated_odometry_on_demand(tmp_path, capsys):
    folder = tmp_path / "wifine"
    folder.mkdir()
    header = ",".join([*map(str, range(4)), "num_visible_APs,timestamp,x,y,z,floorID"])
    for name in ("a", "b"):
        lines = [
            f"-{50 + k % 9}.0,-{60 + k % 7}.0,-100.0,-7{k % 10}.0,3,{k * 4.0},{k * 2.0},0.5,1.4,0" for k in range(60)
        ]
        (folder / f"{name}.csv").write_text("\n".join([header, *lines]) + "\n")
    code, _, err = run(capsys, "map", folder, "--out", tmp_path / "r")
    assert code == 1
    assert "motion" in err
    arguments = ("map", folder, "--starts", "known", "--simulate-odometry", "7", "--out", tmp_path / "r", "--json")
    code, out, _ = run(capsys, *arguments)
    assert code == 0
    assert json.loads(out)["total"]["error"]["odometry"]["mean"] > 0.1


def test_info_tells_what_is_in_a_log(logs, capsys):
    code, out, _ = run(capsys, "info", logs / "office-00", "--json")
    (facts,) = json.loads(out)
    walk = office_walks()[0]
    assert code == 0
    assert facts["scans"] == len(walk.wifi)
    assert facts["duration_s"] == pytest.approx(walk.duration_s, abs=1e-3)
    assert facts["streams"]["odometry"]["rate_hz"] == pytest.approx(1.0, rel=0.05)
    code, out, _ = run(capsys, "info", logs / "office-00")
    assert "longest gap" in out


def test_formats_are_listed(capsys):
    code, out, _ = run(capsys, "formats")
    assert code == 0
    assert all(name in out for name in ("indoor-location", "get-sensor-data", "wifine", "open"))


def test_config_prints_what_map_would_use_and_reads_it_back(tmp_path, capsys):
    code, out, _ = run(capsys, "config", "--preset", "paper", "--set", "loops.similarity_threshold=0.5")
    assert code == 0
    assert "similarity_threshold = 0.5" in out
    assert "rss_threshold_dbm = -70.0" in out
    run(capsys, "config", "--out", tmp_path / "c.toml")
    assert run(capsys, "config", "--preset", "paper", "--config", tmp_path / "c.toml")[1] == run(capsys, "config")[1]


def test_simulate_writes_the_same_bytes_twice(tmp_path, capsys):
    for name in ("a", "b"):
        assert run(capsys, "simulate", "office", "--seed", "5", "--walks", "2", "--out", tmp_path / name)[0] == 0
    files = sorted(path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*") if path.is_file())
    assert files
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_simulate_names_the_buildings_it_knows(tmp_path, capsys):
    code, _, err = run(capsys, "simulate", "castle", "--out", tmp_path / "w")
    assert code == 1
    assert "office" in err


def test_version_is_printed(capsys):
    code, out, _ = run(capsys, "--version")
    assert code == 0
    assert re.fullmatch(r"\d+\.\d+\.\d+\n", out)


def test_help_imports_nothing_heavy():
    probe = (
        "import sys; sys.argv = ['radioslam', '--help']\n"
        "from radioslam import cli\n"
        "try: cli.main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'scipy', 'pyarrow', 'plotly', 'matplotlib', 'pydantic'} & set(sys.modules)\n"
        "sys.exit(f'imported {heavy}' if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_an_interrupt_leaves_nothing_behind(logs, tmp_path):
    """Ctrl-C at several moments of a run: exit code 130, no result, no leftovers."""
    for wait_s in (0.3, 0.8, 1.3):
        command = [sys.executable, "-m", "radioslam", "map", str(logs), "--out", str(tmp_path / "out" / "r")]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, env={**os.environ})
        time.sleep(wait_s)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        left = list((tmp_path / "out").iterdir()) if (tmp_path / "out").exists() else []
        if process.returncode == 0:  # it was faster than the interrupt
            assert [path.name for path in left] == ["r"]
            break
        assert left == []


@pytest.fixture(scope="module")
def mapped(tmp_path_factory) -> Path:
    from tests.crowds import office_result

    return office_result(starts="known").save(tmp_path_factory.mktemp("mapped") / "r")


def test_evaluate_prints_tables_in_four_forms(mapped, capsys):
    code, out, _ = run(capsys, "evaluate", mapped)
    assert code == 0
    assert "mean error of the estimate over that of odometry" in out
    judged = json.loads(run(capsys, "evaluate", mapped, "--json")[1])
    mean = f"{judged['total']['errors']['estimate']['mean']:.2f}"
    assert mean in out
    assert mean in run(capsys, "evaluate", mapped, "--markdown")[1]
    assert mean in run(capsys, "evaluate", mapped, "--latex")[1]


def test_evaluate_writes_plots_and_pairs(mapped, tmp_path, capsys):
    assert run(capsys, "evaluate", mapped, "--plots", tmp_path / "p", "--tum", tmp_path / "t")[0] == 0
    assert {path.name for path in (tmp_path / "p").iterdir()} == {"error-cdf.png", "paths.png"}
    assert len(list((tmp_path / "t").rglob("*.tum"))) == 3 * len(office_walks())


def test_evaluate_refuses_what_is_no_result_and_no_alignment(mapped, tmp_path, capsys):
    assert run(capsys, "evaluate", tmp_path)[0] == 1
    code, _, err = run(capsys, "evaluate", mapped, "--align", "scaled")
    assert code == 1
    assert "none, start or rigid" in err


def test_experiment_prints_and_writes_its_table(tmp_path, capsys):
    arguments = ("experiment", "bin-width", "office", "--values", "0.1", "--seeds", "1", "--jobs", "1")
    code, out, _ = run(capsys, *arguments, "--out", tmp_path)
    assert code == 0
    assert "| default | 0.1 |" in out
    assert {path.name for path in tmp_path.iterdir()} == {f"bin-width-office.{end}" for end in ("md", "csv", "png")}
    assert run(capsys, "experiment", "magic", "office")[0] == 1


def test_simulate_gives_positions_a_trackers_drift(tmp_path, capsys):
    from dataclasses import replace

    from radioslam.formats import read_walks

    for walk in office_walks()[:2]:
        write_walk(replace(walk, odometry=None), tmp_path / "still")
    arguments = ("simulate", "--drift", tmp_path / "still", "--seed", "4", "--out", tmp_path / "moving")
    assert run(capsys, *arguments)[0] == 0
    assert all(walk.odometry is not None for walk in read_walks([tmp_path / "moving"]))
    assert run(capsys, "simulate", "--out", tmp_path / "x")[0] == 1


def test_walks_are_never_replaced_by_their_own_map(logs, capsys):
    before = sorted(logs.rglob("*"))
    code, _, err = run(capsys, "map", logs, "--out", logs, "--force")
    assert code == 1
    assert "apart from the input" in err
    assert sorted(logs.rglob("*")) == before


def test_a_place_that_cannot_be_written_is_one_line(mapped, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    for arguments in (
        ("config", "--out", tmp_path / "nowhere" / "c.toml"),
        ("evaluate", mapped, "--plots", tmp_path / "file"),
        ("evaluate", mapped, "--tum", tmp_path / "file"),
        ("experiment", "bin-width", "office", "--out", tmp_path / "file"),
    ):
        code, _, err = run(capsys, *arguments)
        assert code == 1, arguments
        assert "could not be read or written" in err
        assert len(err.splitlines()) == 1
