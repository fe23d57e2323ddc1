"""Which networks may be kept at all: those whose owners did not say no."""

from __future__ import annotations

OPT_OUT_SUFFIX = "_nomap"
"""As Google and Mozilla's location service have it: a name that ends so is not to be mapped."""
OPT_OUT_WORD = "_optout"
"""As Microsoft has it: a name that contains this anywhere is not to be mapped."""


def may_be_mapped(ssid: str | None) -> bool:
    """Whether a network of this name may be kept; its name never is.

    None means that nobody told the name: it is the sender's part to have left such networks out. An empty name, or one
    of zero bytes, is a hidden network, which is not kept.
    """
    if ssid is None:
        return True
    name = ssid.replace("\\x00", "").strip(' \0"').lower()
    return bool(name) and not name.endswith(OPT_OUT_SUFFIX) and OPT_OUT_WORD not in name
