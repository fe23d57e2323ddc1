"""A floor plan with its walls, access points and walks, as an image."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from radioslam.simulator.building import CONCRETE, GLASS, PARTITION
from radioslam.simulator.scenarios import SCENARIOS
from radioslam.simulator.survey import make_world, true_path

WALL_STYLE = {
    CONCRETE: {"color": "black", "linewidth": 1.8},
    PARTITION: {"color": "#999999", "linewidth": 1.0},
    GLASS: {"color": "#3fa7d6", "linewidth": 1.4},
}


def draw_survey(scenario: str, seed: int, path: Path | str) -> None:
    """Draw the surveyed floor of a scenario with its own walks; needs matplotlib (``radioslam[figures]``)."""
    from matplotlib.figure import Figure

    plan = SCENARIOS[scenario]
    world = make_world(plan, seed)
    building, transmitters = world.building, world.transmitters
    figure = Figure(figsize=(11, 1.8 + 9 * building.depth_m / building.width_m), layout="constrained")
    axes = figure.add_subplot(aspect="equal", xlabel="x (m)", ylabel="y (m)")
    for kind, style in WALL_STYLE.items():
        ends = building.wall_ends(kind)
        if len(ends):
            axes.plot(ends[:, ::2].T, ends[:, 1::2].T, **style)  # type: ignore[arg-type]
            axes.plot([], [], label=kind, **style)  # type: ignore[arg-type]
    for number in range(plan.walks):
        points = true_path(plan, building, seed, number).route.points_xy
        axes.plot(*points.T, linewidth=1.2, alpha=0.85, color=f"C{number}", label=f"walk {number}")
    here = transmitters.site_floor == (plan.deployment.storeys - 1) // 2
    ephemeral = np.isin(np.arange(len(here)), transmitters.radio_site[transmitters.bssid_radio][transmitters.ephemeral])
    fixed = here & ~ephemeral & ~world.is_outside()
    axes.plot(*transmitters.site_xy[fixed].T, "^", color="#d62828", markersize=6, label="access point")
    axes.plot(*building.start_xy, "o", color="black", markersize=8, label="start")
    figure.legend(loc="outside upper center", ncols=5, frameon=False)
    figure.savefig(path, dpi=110, bbox_inches="tight")
