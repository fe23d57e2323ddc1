"""WiFi readings that name their networks -> scans without the names and without networks that must not be mapped."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from radioslam.formats.lines import Lines
from radioslam.formats.loading import shown
from radioslam.formats.streams import PHONE_SENTINELS_DBM, make_scans
from radioslam.privacy import may_be_mapped
from radioslam.walk import RadioScans

Array = NDArray[np.float64]

_MAC = re.compile(r"([0-9a-f]{2})[:.-]?" * 5 + r"([0-9a-f]{2})")


def mac_address(text: str) -> str | None:
    """Six octets in lower case with colons, or None; written with ``:``, ``-``, ``.`` or nothing between them."""
    match = _MAC.fullmatch(text.strip().lower())
    return ":".join(match.groups()) if match else None


def wifi_scans(
    lines: Lines,
    time_s: Array,
    bssid: Sequence[str],
    rss_dbm: Array,
    notes: list[str],
    *,
    ssid: Sequence[str] | None = None,
    frequency_mhz: Array | None = None,
    last_seen_s: Array | None = None,
) -> RadioScans:
    """Scans of readings (n,); readings of one time are one scan. None as ``ssid`` where the log has no names.

    Raises:
        LogError: what stands as BSSID is none, an RSS outside [-127, 0) or a time that cannot be.
    """
    addresses = known_addresses(lines, bssid, "BSSID")
    keep = np.array([may_be_mapped(name) for name in ssid], dtype=bool) if ssid is not None else None
    if keep is None or keep.all():
        kept = np.arange(len(lines))
    else:
        kept = np.flatnonzero(keep)
        notes.append(f"{len(lines) - len(kept)} readings of hidden networks, _nomap or _optout left out")
    return make_scans(
        lines.take(kept),
        time_s[kept],
        [addresses[k] for k in kept],
        rss_dbm[kept],
        None if frequency_mhz is None else frequency_mhz[kept],
        None if last_seen_s is None else last_seen_s[kept],
        PHONE_SENTINELS_DBM,
        notes,
    )


def known_addresses(lines: Lines, texts: Sequence[str], what: str) -> list[str]:
    """The addresses (n,) in one form.

    Raises:
        LogError: one is none; it names the line.
    """
    addresses = []
    for index, text in enumerate(texts):
        address = mac_address(text)
        if address is None:
            raise lines.error(index, f"a {what} such as aa:bb:cc:dd:ee:ff", shown(text), "mend or remove the line")
        addresses.append(address)
    return addresses
