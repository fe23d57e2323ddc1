"""How the walks of a site are mapped: the configuration that its settings mean."""

from __future__ import annotations

from collections.abc import Sequence

from radioslam.config import Config, load_config
from radioslam.server.messages import NewSite


def site_config(starts: str, heading: str, overrides: Sequence[str]) -> Config:
    """The configuration of a site.

    Raises:
        ConfigError: an unknown key or a value out of range.
    """
    named = [f"merging.starts={starts}", f"merging.heading={heading}"]
    return load_config("default", overrides=[*overrides, *named], environment={})


def check_site(new: NewSite) -> None:
    """Refuse a site whose configuration cannot be; raises ConfigError."""
    site_config(new.starts, new.heading, new.overrides)
