"""Several looks at one crowd, averaged.

Which fingerprints tie which walks is largely chance: the same walks, seen through fingerprints of moments one second
later, stand half a metre to a metre elsewhere. The mean of a few such looks errs less than each of them, and how far
they stand apart says how well a walk's place is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from radioslam import planar
from radioslam.rigid_walks import Placement

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

ALONE = "no similar scan in another walk"
APART = "no similar scan in a walk of the main part"
LOOSE = "tied too loosely (σ {:.0f} m)"


@dataclass(frozen=True)
class Part:
    """Walks (w,) that loops tie: places (w, 4) about their centres (w, 2), σ of each (w,) in m, and the radio's lag."""

    walks: Integers
    centre: Array
    place: Array
    sigma_m: Array
    lag_s: float


def collect_parts(parts: Sequence[Part], fixed: NDArray[np.bool_], max_sigma_m: float) -> Placement:
    """All parts as one numbering; walks alone, and those tied too loosely, are parts of their own."""
    walks = len(fixed)
    centre, place = np.zeros((walks, 2)), np.zeros((walks, 4))
    part, sigma_m = max(len(parts), 1) + np.arange(walks), np.full(walks, np.nan)
    reason = np.full(walks, ALONE, dtype="<U60")
    for number, solved in enumerate(parts):
        real = solved.walks < walks
        here = solved.walks[real]
        centre[here], place[here], sigma_m[here] = solved.centre[real], solved.place[real], solved.sigma_m[real]
        part[here] = number
        reason[here] = APART if number else ""
    return _without_loose(Placement(centre, place, part, sigma_m, tuple(reason.tolist()), fixed), max_sigma_m)


def average_looks(looks: Sequence[Placement], max_sigma_m: float) -> Placement:
    """One placement of many: the mean place of each walk over the looks that tie it, if they are at least half.

    Each look's main part is laid on the first's by a rigid alignment, or left as it is where known positions hold it.
    σ² is the mean of the looks' own plus their variance. What is no part of the main one is as in the first look.
    """
    first = looks[0]
    if len(looks) == 1:
        return first
    tied = np.array([look.part == 0 for look in looks])
    places = np.array([_on(first, look) for look in looks])
    main = 2 * tied.sum(axis=0) >= len(looks)
    weight = tied / np.maximum(tied.sum(axis=0), 1)
    mean = np.einsum("lw,lwk->wk", weight, places)
    apart = np.einsum("lw,lwk->w", weight, (places[:, :, :2] - mean[:, :2]) ** 2) / 2
    sigma_m = np.sqrt(np.einsum("lw,lw->w", weight, np.nan_to_num([look.sigma_m for look in looks]) ** 2) + apart)
    lost = (first.part == 0) & ~main
    alone = first.part.max(initial=0) + 1 + np.arange(len(main))
    averaged = Placement(
        centre=first.centre,
        place=np.where(main[:, None], mean, first.place),
        part=np.where(main, 0, np.where(lost, alone, first.part)),
        sigma_m=np.where(main, sigma_m, first.sigma_m),
        reason=tuple("" if here else why or APART for here, why in zip(main.tolist(), first.reason, strict=True)),
        fixed=first.fixed,
    )
    return _without_loose(averaged, max_sigma_m)


def _on(first: Placement, look: Placement) -> Array:
    """Places (w, 4) of a look about the first's centres, in the first's frame; turns within π of the first's."""
    place = look.place.copy()
    place[:, :2] += np.exp(place[:, 3:]) * planar.rotate(place[:, 2], first.centre - look.centre)
    both = (first.part == 0) & (look.part == 0)
    if not first.fixed.any() and both.sum() > 1:
        T_first_look = planar.align_rigid(place[both, :2], first.place[both, :2])
        place[:, :2], place[:, 2] = planar.transform(T_first_look, place[:, :2]), place[:, 2] + T_first_look[2]
    place[:, 2] = first.place[:, 2] + planar.wrap(place[:, 2] - first.place[:, 2])
    return place


def _without_loose(placement: Placement, max_sigma_m: float) -> Placement:
    """The same with each walk whose place is known less well than ``max_sigma_m`` as a part of its own."""
    loose = placement.sigma_m > max_sigma_m
    own = placement.part.max(initial=0) + 1 + np.arange(len(loose))
    sigma_m = placement.sigma_m.tolist()
    reason = [
        LOOSE.format(sigma) if far else why
        for sigma, far, why in zip(sigma_m, loose.tolist(), placement.reason, strict=True)
    ]
    return replace(placement, part=np.where(loose, own, placement.part), reason=tuple(reason))
