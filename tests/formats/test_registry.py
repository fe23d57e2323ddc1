import gzip
from dataclasses import replace

import numpy as np
import pytest

from radioslam.errors import ConfigError, LogError
from radioslam.formats import FORMATS, find_logs, read_walk, read_walks
from radioslam.walk import Signal

from .samples import (
    AR_WIFI,
    INDOOR,
    IW,
    OPEN_FOLDER,
    REFERENCE,
    SENSOR,
    SENSOR_LOGGER,
    TERMUX,
    TUM,
    WIFINE,
    WIGLE,
)

SAMPLES = {
    "indoor-location": INDOOR,
    "get-sensor-data": SENSOR,
    "wifine": WIFINE,
    "sensor-logger": SENSOR_LOGGER,
    "ar-session": AR_WIFI,
    "termux": TERMUX,
    "iw-scan": IW,
    "wigle": WIGLE,
    "open": OPEN_FOLDER["scans.csv"],
}


@pytest.fixture
def survey(tmp_path):
    """A folder of two logs, a walk of the open format, side files and hidden ones."""
    (tmp_path / "b.txt").write_bytes(SENSOR)
    (tmp_path / "deep" / "er").mkdir(parents=True)
    (tmp_path / "deep" / "er" / "a.txt.gz").write_bytes(gzip.compress(INDOOR))
    (tmp_path / "walk7").mkdir()
    for name, content in OPEN_FOLDER.items():
        (tmp_path / "walk7" / name).write_bytes(content)
    (tmp_path / "image.png").write_bytes(b"\x89PNG\0\0")
    (tmp_path / "map.geojson").write_text("{}")
    (tmp_path / "README.md").write_text("Read me")
    (tmp_path / "notes.txt").write_text("It rained.")
    (tmp_path / "truth.tum").write_bytes(TUM)
    (tmp_path / ".hidden.txt").write_bytes(SENSOR)
    (tmp_path / ".cache").mkdir()
    (tmp_path / ".cache" / "c.txt").write_bytes(SENSOR)
    return tmp_path


@pytest.mark.parametrize("known", FORMATS, ids=lambda known: known.name)
def test_formats_are_told_by_content(tmp_path, known):
    path = tmp_path / "whatever.dat"
    path.write_bytes(SAMPLES[known.name])
    assert [other.name for other in FORMATS if other.sniff(SAMPLES[known.name])] == [known.name]
    np.testing.assert_array_equal(read_walk(path).wifi.rss_dbm, read_walk(path, format=known.name).wifi.rss_dbm)


def test_an_unknown_format(tmp_path):
    with pytest.raises(ConfigError, match=r"indoor-location, get-sensor-data, wifine, .*, open; found 'csv'"):
        read_walk(tmp_path / "a.txt", format="csv")


def test_a_folder_means_every_log_below_it(survey):
    names = [path.relative_to(survey).as_posix() for path in find_logs([survey])]
    assert names == ["b.txt", "deep/er/a.txt.gz", "walk7/scans.csv"]


def test_each_log_counts_once(survey):
    again = [survey / "walk7" / "trajectory.tum", survey, survey / "deep" / ".." / "b.txt", survey / "walk7"]
    assert len(find_logs(again)) == 3


def test_folders_without_a_log(tmp_path):
    (tmp_path / "truth.tum").write_bytes(TUM)
    (tmp_path / "reference.csv").write_bytes(REFERENCE)
    with pytest.raises(LogError, match="expected a folder with logs"):
        find_logs([tmp_path])
    with pytest.raises(LogError, match="no such file"):
        read_walks([tmp_path / "nowhere"])


@pytest.mark.parametrize("broken", [b"", b"\0\0", gzip.compress(SENSOR, mtime=0)[:-9]])
def test_a_broken_log_in_a_folder_is_not_passed_over(survey, broken):
    (survey / "broken.txt.gz").write_bytes(broken)
    with pytest.raises(LogError, match=r"broken\.txt\.gz: expected"):
        read_walks([survey], check=False)


def test_a_trajectory_without_scans_is_not_passed_over(survey):
    (survey / "walk7" / "scans.csv").unlink()
    with pytest.raises(LogError, match="expected WiFi scans, found none"):
        read_walks([survey / "walk7"])


@pytest.mark.parametrize("name", ["image.png", "README.md", "notes.txt", "map.geojson"])
def test_a_side_file_named_directly_is_an_error(survey, name):
    with pytest.raises(LogError, match=name):
        read_walks([survey / name])


def test_walks_come_sorted_whatever_the_order(survey):
    logs = find_logs([survey])
    for paths in (logs, logs[::-1], [str(survey)]):
        assert [walk.name for walk in read_walks(paths)] == ["a", "b", "walk7"]


def test_references_come_to_one_origin(survey):
    a, b, open_walk = read_walks([survey])
    assert a.reference.origin_wgs84 is None
    assert b.reference.origin_wgs84 == open_walk.reference.origin_wgs84
    np.testing.assert_allclose(b.reference.positions_xy[0], [0, 0], atol=1e-6)
    assert open_walk.reference.positions_xy[0, 1] == pytest.approx(0.038684 * 111_230, rel=1e-2)


def test_two_walks_of_one_name_are_refused(survey):
    (survey / "deep" / "b.log").write_bytes(SENSOR)
    with pytest.raises(LogError, match=r"b\.log: .*'b' here and in .*b\.txt; rename one of them"):
        read_walks([survey])


def test_errors_can_be_gathered(survey):
    (survey / "c.txt").write_bytes(SENSOR.replace(b"-60", b"60"))
    (survey / "d.txt").write_bytes(b"")
    errors, seen = [], []
    walks = read_walks([survey, survey / "nowhere"], on_error=errors.append, progress=lambda *step: seen.append(step))
    assert [walk.name for walk in walks] == ["a", "b", "walk7"]
    assert sorted(error.path.name for error in errors) == ["c.txt", "d.txt", "nowhere"]
    assert [step[:2] for step in seen] == [(done, 5) for done in range(1, 6)]


def test_walks_without_motion_can_be_prepared_or_looked_at(tmp_path):
    (tmp_path / "w.csv").write_bytes(WIFINE)
    with pytest.raises(LogError, match="expected motion"):
        read_walks([tmp_path])
    assert len(read_walks([tmp_path], check=False)) == 1
    still = Signal([0.0, 5.0], np.zeros((2, 3)))
    (walk,) = read_walks([tmp_path], prepare=lambda walk: replace(walk, odometry=still))
    assert walk.odometry is still
