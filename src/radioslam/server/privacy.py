"""What is left out at the door, and how addresses are hidden.

A network whose owner asked not to be mapped (SSID ending in ``_nomap`` or containing ``_optout``) and a hidden one are
dropped. Hashed addresses keep the bit that tells locally administered ones apart, and look like addresses, so that
everything downstream works on them alike.
"""

from __future__ import annotations

import hashlib
import os
import re
import secrets
from collections.abc import Callable
from pathlib import Path

from radioslam.errors import ConfigError
from radioslam.privacy import may_be_mapped

SECRET_FILE = "bssid.secret"
SECRET_BYTES = 32
Hide = Callable[[str], str]

_LINES = {
    "indoor-location": re.compile(rb"\tTYPE_WIFI\t(.*)\t(?:[0-9A-Fa-f]{2}:){5}[0-9A-Fa-f]{2}\t"),
    "get-sensor-data": re.compile(rb"^WIFI;[^;]*;[^;]*;(.*);(?:[0-9A-Fa-f]{2}:){5}[0-9A-Fa-f]{2};"),
}
"""Where the lines of a log format have the SSID; readers of the other formats leave such networks out themselves."""


def scrub(path: Path, format: str) -> int:
    """Take the lines of networks that opted out from a log's text; how many."""
    if format not in _LINES:
        return 0
    lines = path.read_bytes().split(b"\n")
    kept = [line for line in lines if not _is_opted_out(line, _LINES[format])]
    if len(kept) < len(lines):
        path.write_bytes(b"\n".join(kept))
    return len(lines) - len(kept)


def _is_opted_out(line: bytes, pattern: re.Pattern[bytes]) -> bool:
    match = pattern.search(line)
    return match is not None and not may_be_mapped(match[1].decode("utf-8", "replace"))


def hashed(address: str, secret: bytes) -> str:
    """46 bits of BLAKE2b under a secret, written as an address that is local if ``address`` is."""
    from radioslam.map_health import locally_administered

    digest = bytearray(hashlib.blake2b(address.encode(), key=secret, digest_size=6).digest())
    digest[0] = digest[0] & 0xFC | (0x02 if locally_administered(address) else 0)
    return ":".join(f"{octet:02x}" for octet in digest)


def hider(data: Path, hash_bssids: bool) -> Hide:
    """What makes stored addresses of real ones; the secret is a file beside the maps, readable by its owner only."""
    if not hash_bssids:
        return lambda address: address
    secret = _secret(data / SECRET_FILE)
    known: dict[str, str] = {}

    def hide(address: str) -> str:
        if len(known) > 100_000:
            known.clear()
        if address not in known:
            known[address] = hashed(address, secret)
        return known[address]

    return hide


def _secret(path: Path) -> bytes:
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        secret = path.read_bytes()
        if len(secret) != SECRET_BYTES:
            raise ConfigError(f"{path}: expected {SECRET_BYTES} bytes, found {len(secret)}; restore it") from None
        return secret
    with os.fdopen(handle, "wb") as file:
        file.write(secrets.token_bytes(SECRET_BYTES))
        file.flush()
        os.fsync(file.fileno())
    return path.read_bytes()
