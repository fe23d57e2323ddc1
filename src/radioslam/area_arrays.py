"""Areas of a pose graph as named arrays, for the way between machines."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from radioslam.areas import Area, Reduced
from radioslam.object_store import Arrays
from radioslam.pose_graph import Edges, Legs, PoseGraph, Priors

EDGES = ("odometry", "loops", "links")
OPTIONAL = ("walk", "log_scale_sigma", "loop_velocity")


def area_arrays(area: Area) -> Arrays:
    """All that an area is made of; what it lacks is left out."""
    graph = area.graph
    arrays = {"poses": graph.poses, "variables": area.variables, "shared": area.shared}
    arrays["lag_sigma_s"] = np.array([graph.lag_sigma_s])
    for name in (*EDGES, "priors"):
        arrays |= _parts(name, getattr(graph, name))
    arrays |= {name: getattr(graph, name) for name in OPTIONAL if getattr(graph, name) is not None}
    if graph.legs is not None:
        arrays |= _parts("legs", graph.legs) | {"legs.axis_rad": np.array([graph.legs.axis_rad])}
    return arrays


def area_of(arrays: Arrays) -> Area:
    """The area that ``area_arrays`` wrote."""
    odometry, loops, links = (Edges(**_of(name, Edges, arrays)) for name in EDGES)
    legs = None
    if "legs.begin" in arrays:
        parts = _of("legs", Legs, arrays)
        legs = Legs(**{**parts, "axis_rad": float(parts["axis_rad"][0])})
    graph = PoseGraph(
        poses=arrays["poses"],
        odometry=odometry,
        loops=loops,
        links=links,
        priors=Priors(**_of("priors", Priors, arrays)),
        walk=arrays.get("walk"),
        log_scale_sigma=arrays.get("log_scale_sigma"),
        loop_velocity=arrays.get("loop_velocity"),
        lag_sigma_s=float(arrays["lag_sigma_s"][0]),
        legs=legs,
    )
    return Area(graph, arrays["variables"], arrays["shared"])


def reduced_arrays(reduced: Reduced) -> Arrays:
    """An area's share of the reduced graph."""
    return {**_parts("share", reduced), "share.cost": np.array([reduced.cost])}


def reduced_of(arrays: Arrays) -> Reduced:
    """The share that ``reduced_arrays`` wrote."""
    parts = _of("share", Reduced, arrays)
    return Reduced(**{**parts, "cost": float(parts["cost"][0])})


def _parts(name: str, whole: Any) -> Arrays:
    return {f"{name}.{part.name}": np.asarray(getattr(whole, part.name)) for part in fields(whole)}


def _of(name: str, kind: Any, arrays: Arrays) -> dict[str, Any]:
    return {part.name: arrays[f"{name}.{part.name}"] for part in fields(kind)}
