"""Spatially correlated shadowing: a Gaussian random field per radio, made of plane waves.

A field with the correlation exp(-d / D) (Gudmundson, 1991) in the plane has the spectral density
(1 + k² D²)^(-3/2), whose radial distribution can be inverted: k = sqrt(1 / (1 - u)² - 1) / D for uniform u.
The sum sqrt(2 / K) Σ cos(k_i · x + φ_i) over K waves drawn so has zero mean, unit variance and that
correlation, and needs no grid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WAVES = 32
"""Enough that single values are close to Gaussian; the correlation is right for any number."""


@dataclass(frozen=True)
class ShadowFields:
    """Fields f of unit variance: ``wave_xy`` (f, K, 2) rad/m and ``phase`` (f, K) rad."""

    wave_xy: Array
    phase: Array

    def at(self, positions_xy: Array, fields: NDArray[np.bool_]) -> Array:
        """Values (n, f) at positions (n, 2) where the mask ``fields`` (n, f) is true, 0 elsewhere."""
        values = np.zeros(fields.shape)
        scale = np.sqrt(2.0 / self.phase.shape[1])
        for number in range(len(self.phase)):
            rows = np.flatnonzero(fields[:, number])
            angle = positions_xy[rows] @ self.wave_xy[number].T + self.phase[number]
            values[rows, number] = scale * np.cos(angle).sum(axis=1)
        return values

    def only(self, fields: NDArray[np.bool_]) -> ShadowFields:
        """Those of the fields that the mask (f,) names."""
        return ShadowFields(self.wave_xy[fields], self.phase[fields])


def shadow_fields(
    group: NDArray[np.int64], correlation_m: float, shared: float, rng: np.random.Generator
) -> ShadowFields:
    """A field per entry of ``group`` (f,); fields of one group correlate by ``shared`` (0 to 1).

    The radios of one access point stand behind the same obstacles, therefore they share waves.
    """
    own, common = (_waves(count, correlation_m, rng) for count in (len(group), int(group.max(initial=-1)) + 1))
    split = round(shared * WAVES)
    wave = np.concatenate([common[0][group][:, :split], own[0][:, split:]], axis=1)
    phase = np.concatenate([common[1][group][:, :split], own[1][:, split:]], axis=1)
    return ShadowFields(wave, phase)


def _waves(count: int, correlation_m: float, rng: np.random.Generator) -> tuple[Array, Array]:
    u, direction, phase = rng.random((3, count, WAVES)) * np.array([1.0, 2 * np.pi, 2 * np.pi])[:, None, None]
    number = np.sqrt((1.0 - u) ** -2 - 1.0) / correlation_m
    return number[..., None] * np.stack([np.cos(direction), np.sin(direction)], axis=-1), phase
