"""The paper's figures on our data, into docs/images: learned models of two buildings, paths, errors.

``python -m benchmarks.figures``; part of ``make experiments``.
"""

from __future__ import annotations

import os
from pathlib import Path

from radioslam.config import load_config
from radioslam.evaluation import evaluate
from radioslam.formats import read_walks
from radioslam.images import save_error_cdf_png, save_paths_png, save_uncertainty_png
from radioslam.results import SlamResult
from radioslam.simulator import simulate
from radioslam.slam import map_walks

REPOSITORY = Path(__file__).resolve().parent.parent
IMAGES = REPOSITORY / "docs" / "images"
SEED = 200


def mapped(building: str, preset: str) -> SlamResult:
    walks = simulate(building, seed=SEED)
    return map_walks(walks, load_config(preset, overrides=["merging.starts=common"], environment={}))


def museum() -> SlamResult | None:
    data = Path(os.environ.get("RADIOSLAM_DATA", REPOSITORY.parent / "shared" / "data"))
    if not (data / "ipin2023" / "floor0").is_dir():
        print(f"figures: no recordings in {data}; set RADIOSLAM_DATA; the museum's pictures stay as they are")
        return None
    config = load_config("default", overrides=["merging.starts=known"], environment={})
    return map_walks(read_walks([data / "ipin2023" / "floor0"]), config)


def main() -> None:
    campus = {preset: mapped("campus", preset) for preset in ("paper", "default")}
    models = {"campus": campus["paper"].uncertainty, "tower": mapped("tower", "paper").uncertainty}
    save_uncertainty_png(models, IMAGES / "two-buildings-uncertainty.png")
    save_paths_png(campus["default"], IMAGES / "campus-paths.png")
    errors = {f"preset {preset}": evaluate(result).errors["estimate"] for preset, result in campus.items()}
    odometry = evaluate(campus["paper"]).errors["odometry"]
    save_error_cdf_png({"odometry alone": odometry, **errors}, IMAGES / "campus-error-cdf.png")
    real = museum()
    if real is not None:
        save_paths_png(real, IMAGES / "museum-paths.png")
        save_uncertainty_png({"museum": real.uncertainty}, IMAGES / "museum-uncertainty.png")


if __name__ == "__main__":
    main()
