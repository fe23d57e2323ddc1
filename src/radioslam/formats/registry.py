"""Which formats there are, which files are logs, and reading many of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from radioslam.errors import ConfigError, LogError
from radioslam.formats import (
    ar_session,
    get_sensor_data,
    indoor_location,
    iw_scan,
    open_format,
    sensor_logger,
    termux,
    wifine,
    wigle,
)
from radioslam.formats.loading import load_head, shown
from radioslam.walk import Walk, check_walk


def _itself(path: Path) -> Path:
    return path


@dataclass(frozen=True)
class Format:
    """A log format: ``sniff`` judges by the first bytes of a file's text, ``read`` takes the file.

    ``log_of`` tells for a file of a log that consists of several which of them stands for all.
    """

    name: str
    title: str
    sniff: Callable[[bytes], bool]
    read: Callable[[Path], Walk]
    log_of: Callable[[Path], Path] = _itself


FORMATS: tuple[Format, ...] = (
    Format(
        "indoor-location",
        "Indoor Location Competition 2.0 trace (TYPE_… records)",
        indoor_location.sniff,
        indoor_location.read,
    ),
    Format(
        "get-sensor-data",
        "GetSensorData / IPIN competition log (ACCE;…, WIFI;…)",
        get_sensor_data.sniff,
        get_sensor_data.read,
    ),
    Format("wifine", "WiFine CSV (scans at known positions, no motion)", wifine.sniff, wifine.read),
    Format(
        "sensor-logger",
        "Sensor Logger app: zip or JSON export, or pushed messages",
        sensor_logger.sniff,
        sensor_logger.read,
        sensor_logger.log_of,
    ),
    Format(
        "ar-session",
        "WiFi CSV by its column names, beside poses of an ARCore or ARKit logger",
        ar_session.sniff,
        ar_session.read,
        ar_session.log_of,
    ),
    Format("termux", "termux-wifi-scaninfo JSON (scans, no motion)", termux.sniff, termux.read),
    Format("iw-scan", "iw dev … scan text (scans, no motion)", iw_scan.sniff, iw_scan.read),
    Format("wigle", "WiGLE CSV (scans at latitudes and longitudes, no motion)", wigle.sniff, wigle.read),
    Format(
        "open",
        "RadioSLAM's own: scans CSV beside a TUM trajectory",
        open_format.sniff,
        open_format.read,
        open_format.log_of,
    ),
)

_LOG_ENDINGS = (".txt", ".csv", ".log", ".zip")
"""Within a folder, a file that bears such an ending and cannot be read is a broken log, not a side file."""


def find_logs(paths: Iterable[Path | str]) -> list[Path]:
    """The logs that these files and folders mean; of a folder every log below it, sorted; each log once.

    Raises:
        LogError: a path that does not exist, or a folder without a log.
    """
    found: dict[Path, Path] = {}
    for path in map(Path, paths):
        if not path.exists():
            raise LogError(path, "a log or a folder of logs", "no such file", "check the path")
        for log in _logs_below(path) if path.is_dir() else [path]:
            log = _log_of(log)
            found.setdefault(log.resolve(), log)
    return list(found.values())


def read_walk(path: Path | str, format: str = "auto") -> Walk:
    """Read one log, as it is: whether it can be mapped is not judged.

    Args:
        path: the log.
        format: the name of a format, or "auto" to tell by content.

    Raises:
        LogError: the log cannot be read.
        ConfigError: there is no such format.
    """
    path = Path(path)
    if format == "auto":
        return recognise(path).read(path)
    chosen = [known for known in FORMATS if known.name == format]
    if not chosen:
        raise ConfigError(f"expected a format out of auto, {_names()}; found {format!r}")
    return chosen[0].read(path)


def is_log(path: Path | str) -> bool:
    """Whether the content is that of a known format.

    Raises:
        LogError: the file cannot be read.
    """
    head = load_head(Path(path))
    return any(known.sniff(head) for known in FORMATS)


def read_walks(
    paths: Iterable[Path | str],
    format: str = "auto",
    on_error: Callable[[LogError], None] | None = None,
    progress: Callable[[int, int, Path], None] | None = None,
    *,
    prepare: Callable[[Walk], Walk] | None = None,
    check: bool = True,
) -> list[Walk]:
    """Read logs and folders of logs: walks sorted by name, their references in one frame.

    Args:
        paths: files and folders.
        format: the name of a format, or "auto" to tell by content.
        on_error: is given each error, and the log is left out; None raises it.
        progress: is given the number of logs done, of all logs, and the log that was just done.
        prepare: completes a walk before it is checked, for instance by simulating its odometry.
        check: reject walks that cannot be mapped.

    Raises:
        LogError: a log cannot be read or mapped, or two logs have one name.
    """
    walks: dict[str, Walk] = {}
    logs = _find_all(paths, on_error)
    for done, path in enumerate(logs, start=1):
        try:
            _add(walks, _prepared(read_walk(path, format), prepare, check), path)
        except LogError as error:
            _report(error, on_error)
        if progress is not None:
            progress(done, len(logs), path)
    return share_origin([walks[name] for name in sorted(walks)])


def share_origin(walks: Sequence[Walk]) -> list[Walk]:
    """Bring references that have a WGS 84 origin to that of the first walk which has one."""
    origins = (walk.reference.origin_wgs84 for walk in walks if walk.reference)
    origin = next((origin for origin in origins if origin), None)
    if origin is None:
        return list(walks)
    return [replace(walk, reference=walk.reference.with_origin(origin)) if walk.reference else walk for walk in walks]


def _log_of(path: Path) -> Path:
    """The file that stands for the log that this one belongs to."""
    path = open_format.log_of(path)
    try:
        head = load_head(path)
    except LogError:
        return path
    return next((known.log_of(path) for known in FORMATS if known.sniff(head)), path)


def _find_all(paths: Iterable[Path | str], on_error: Callable[[LogError], None] | None) -> list[Path]:
    found: dict[Path, Path] = {}
    for path in paths:
        try:
            found |= {log.resolve(): log for log in find_logs([path]) if log.resolve() not in found}
        except LogError as error:
            _report(error, on_error)
    return list(found.values())


def _report(error: LogError, on_error: Callable[[LogError], None] | None) -> None:
    if on_error is None:
        raise error
    on_error(error)


def _prepared(walk: Walk, prepare: Callable[[Walk], Walk] | None, check: bool) -> Walk:
    walk = prepare(walk) if prepare else walk
    return check_walk(walk) if check else walk


def _add(walks: dict[str, Walk], walk: Walk, path: Path) -> None:
    if walk.name in walks:
        found = f"{walk.name!r} here and in {walks[walk.name].path}"
        raise LogError(path, "one log per walk name", found, "rename one of them")
    walks[walk.name] = walk


def recognise(path: Path) -> Format:
    """The format of a log by its content.

    Raises:
        LogError: it is none that is known.
    """
    head = load_head(path)
    for known in FORMATS:
        if known.sniff(head):
            return known
    first = head.strip().split(b"\n", 1)[0]
    raise LogError(path, f"a log ({_names()})", f"a text that begins {shown(first)}", "see `radioslam formats`")


def _logs_below(folder: Path) -> list[Path]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    logs = [path for path in files if not _is_hidden(path, folder) and _is_log(path)]
    if not logs:
        raise LogError(folder, f"a folder with logs ({_names()})", "none below it", "check the path")
    return logs


def _is_hidden(path: Path, folder: Path) -> bool:
    return any(part.startswith(".") for part in path.relative_to(folder).parts)


def _is_log(path: Path) -> bool:
    """Whether a file within a folder is a log, be it a broken one; partners and side files are not."""
    if open_format.is_partner(path):
        return False
    try:
        head = load_head(path)
    except LogError:
        return path.name.removesuffix(".gz").endswith(_LOG_ENDINGS)
    return open_format.is_scans(path) or any(known.sniff(head) for known in FORMATS)


def _names() -> str:
    return ", ".join(known.name for known in FORMATS)
