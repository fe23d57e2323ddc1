"""Robust losses of factors: what an outlier may cost."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LossName = Literal["none", "huber", "cauchy", "dcs"]


def robust_loss(name: LossName, q: Array, scale: float) -> tuple[Array, Array]:
    """ρ(q) and its derivative, the weight, for squared whitened residuals q (m,).

    With k = scale: ``huber`` 2k√q - k² beyond k²; ``cauchy`` k² log(1 + q/k²); ``dcs`` (dynamic covariance scaling,
    Agarwal et al. 2013, Φ = k²) q up to Φ, then 3Φ - 4Φ²/(Φ+q), whose weight is (2Φ/(Φ+q))².
    """
    k2 = scale * scale
    if name == "none":
        return q, np.ones_like(q)
    if name == "cauchy":
        return k2 * np.log1p(q / k2), 1.0 / (1.0 + q / k2)
    inside = q <= k2
    if name == "huber":
        root = np.sqrt(np.maximum(q, k2))
        return np.where(inside, q, 2 * scale * root - k2), np.where(inside, 1.0, scale / root)
    weight = (2 * k2 / (k2 + q)) ** 2
    return np.where(inside, q, 3 * k2 - 4 * k2 * k2 / (k2 + q)), np.where(inside, 1.0, weight)
