"""Where access points are placed, against where the simulator hung them: office, tower and campus, seeds 4-6.

Beside the centroid of strong readings weighted by received power, on the surveyed map and on RadioSLAM's own. Not on
the seeds from which the constants were chosen (1-3).
"""

from __future__ import annotations

import numpy as np

from radioslam.access_points import access_points
from radioslam.config import load_config
from radioslam.positioning_experiment import surveyed
from radioslam.radio_map import RadioMap
from radioslam.simulator import SCENARIOS, simulate
from radioslam.simulator.survey import make_world
from radioslam.slam import map_walks

SEEDS = (4, 5, 6)
STRONG_DBM = -65.0
INSIDE_SIGMAS = 2.45
"""95 % of a circular Gaussian."""
Positions = dict[str, np.ndarray]


def centroids(samples: RadioMap) -> Positions:
    columns = samples.rss_dbm.tocsc()
    found = {}
    for k, name in enumerate(samples.transmitters):
        part = slice(columns.indptr[k], columns.indptr[k + 1])
        rows, rss = columns.indices[part], columns.data[part]
        if np.sum(rss >= STRONG_DBM) >= 3:
            weight = np.where(rss >= STRONG_DBM, 10 ** (rss / 20), 0.0)
            found[name] = weight @ samples.poses[rows, :2] / weight.sum()
    return found


def row(scenario: str, seed: int) -> list[list[float]]:
    """Heard, placed, median, p90, share inside, and the medians of both methods where both place; per map."""
    config = load_config(overrides=["merging.starts=known"], environment={})
    result = map_walks(simulate(scenario, seed=seed), config)
    world = make_world(SCENARIOS[scenario], seed).transmitters
    truth = dict(zip(world.bssids, world.site_xy[world.radio_site[world.bssid_radio]], strict=True))
    rows = []
    for samples in (surveyed(result), result.radio_map):
        points = access_points(samples)
        placed = [point for point in points if point.position_xy is not None]
        error = {p.transmitter: float(np.hypot(*(p.position_xy - truth[p.transmitter]))) for p in placed}
        inside = np.mean([error[p.transmitter] <= INSIDE_SIGMAS * p.sigma_m for p in placed])
        baseline = {name: float(np.hypot(*(xy - truth[name]))) for name, xy in centroids(samples).items()}
        both = sorted(error.keys() & baseline.keys())
        errors = list(error.values())
        medians = [float(np.median([values[name] for name in both])) for values in (error, baseline)]
        heard = len(points)
        rows.append([heard, len(placed), np.median(errors), np.quantile(errors, 0.9), 100 * inside, *medians])
    return rows


def run() -> None:
    """Print the table, means over the seeds."""
    print("| building | map | heard | placed | median m | p90 m | inside 95 % | both: ours | both: centroid |")
    print("|---|---|---|---|---|---|---|---|---|")
    for scenario in ("office", "tower", "campus"):
        means = np.mean([row(scenario, seed) for seed in SEEDS], axis=0)
        for name, figures in zip(("surveyed", "RadioSLAM's"), means, strict=True):
            heard, placed, median, p90, inside, ours, centroid = figures
            cells = (
                f"{heard:.0f} | {placed:.0f} | {median:.1f} | {p90:.1f} | {inside:.0f} % | {ours:.1f} | {centroid:.1f}"
            )
            print(f"| {scenario} | {name} | {cells} |", flush=True)


if __name__ == "__main__":
    run()
