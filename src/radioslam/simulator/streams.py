"""Random streams that depend on what they are for, not on the order in which they are drawn."""

from __future__ import annotations

import hashlib

import numpy as np


def digest(*words: object) -> bytes:
    """Sixteen bytes that depend on every word and on nothing else (no hash randomisation)."""
    return hashlib.blake2b("\x1f".join(map(str, words)).encode(), digest_size=16).digest()


def random_stream(*words: object) -> np.random.Generator:
    """A generator of its own for these words, for example ``random_stream(seed, "walk", name)``."""
    return np.random.default_rng(int.from_bytes(digest(*words), "little"))
