"""Small simulated crowds that several tests map."""

from __future__ import annotations

from functools import cache

from radioslam.config import load_config
from radioslam.results import SlamResult
from radioslam.simulator import simulate
from radioslam.slam import map_walks
from radioslam.walk import Walk


@cache
def office_walks(seed: int = 1) -> tuple[Walk, ...]:
    return tuple(simulate("office", seed=seed))


@cache
def office_result(preset: str = "default", starts: str = "common") -> SlamResult:
    config = load_config(preset, overrides=[f"merging.starts={starts}"], environment={})
    return map_walks(office_walks(), config)
