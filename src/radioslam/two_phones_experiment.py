"""Another phone than those of the map: each phone's scans in the surveyed map of the others, its offset on and off.

The map is the survey (true positions), so that nothing but the phone differs.
"""

from __future__ import annotations

import itertools

from radioslam.config import load_config
from radioslam.errors import ConfigError
from radioslam.experiments import Experiment, Outcome, Runs, Source, Variant, walks_of_seed
from radioslam.positioning import Positioner
from radioslam.positioning_experiment import COLUMNS, figures_of, locate_walk, surveyed
from radioslam.slam import map_walks

WAYS = {
    "knn": ("knn", ()),
    "locate without offset": ("locate", ("positioning.offset_sigma_db=0",)),
    "locate": ("locate", ()),
}
"""Label -> method and settings."""


def two_phones(source: Source, seed: int = 0, walks: int | None = None) -> Experiment:
    """The experiment with a variant for each phone of the source and each way to locate it.

    Raises:
        ConfigError: walks of fewer than two phones.
    """
    phones = sorted({walk.device for walk in walks_of_seed(source, seed, walks)})
    if len(phones) < 2:
        raise ConfigError(f"expected walks of two or more phones, found {', '.join(phones) or 'none'}")
    variants = tuple(Variant(f"{phone}: {way}") for phone in phones for way in WAYS)
    columns = tuple(name for name in COLUMNS if name != "a/b")
    return Experiment("two-phones", "Scans of one phone in the surveyed map of the others", variants, columns)


def run_two_phones(experiment: Experiment, runs: Runs) -> list[Outcome]:
    """The variants of ``two_phones`` or some of them, by preset and seed."""
    labels = [variant.label for variant in experiment.variants]
    asked = itertools.product(runs.presets, labels, runs.seeds)
    return runs.in_parallel(_locate_phone, [(runs.source, *one, runs.walks, runs.overrides) for one in asked])


def _locate_phone(
    source: Source, preset: str, label: str, seed: int, walks: int | None, overrides: tuple[str, ...]
) -> Outcome:
    phone, _, way = label.rpartition(": ")
    method, settings = WAYS[way]
    always = [f"merging.starts={source.starts}", "optimizer.standard_deviations=false"]
    config = load_config(preset, overrides=[*always, *overrides, *settings], environment={})
    made = walks_of_seed(source, seed, walks)
    others = map_walks([walk for walk in made if walk.device != phone], config)
    positioner = Positioner.of(surveyed(others), config)
    held = [walk for walk in made if walk.device == phone and walk.reference is not None]
    trials = [locate_walk(positioner, walk, config, seed, (method,)) for walk in held]
    return Outcome(preset, label, seed, figures_of(trials, method))
