"""The same jobs on a Dask cluster; the only file that knows Dask (extra ``radioslam[cluster]``).

Data lie as Parquet in a store that all machines reach; through the scheduler go names and single numbers. Every task
can be done again by another worker with the same outcome, so a worker that dies costs the task it had.
"""

from __future__ import annotations

import functools
import importlib
import tempfile
import threading
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from radioslam.area_arrays import area_arrays, area_of, reduced_arrays, reduced_of
from radioslam.areas import AreaSolver, Reduced, shared_part, split_graph, walks_by_area
from radioslam.config import Config, OptimizerConfig
from radioslam.engine import OneMachine
from radioslam.errors import ConfigError
from radioslam.factors import first_guess
from radioslam.object_store import Arrays, ObjectStore
from radioslam.optimizer import Solution
from radioslam.pose_graph import PoseGraph
from radioslam.reduced_graph import Values, minimize_in_areas
from radioslam.similarity import Gate, Pairs, unit_rows

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

TILE_SCANS = 4096
"""Most scans along one side of a tile of the join."""
FEWEST_SCANS = 256
ANSWER_S = 10
"""A scheduler that does not answer in this time is none."""
AREAS_PER_WORKER = 2
MOST_SHARED = 0.1
"""Of a graph's unknowns: where walks cross everywhere, the reduced graph is no smaller than the whole one."""
_ONE_AT_A_TIME = threading.Lock()
"""Solvers remember their last reduction, and a worker may have several threads."""


@contextmanager
def connect(address: str, workers: int | None = None) -> Iterator[Any]:
    """A client of the scheduler at ``address``; ``local`` starts one, with worker processes, on loopback.

    Raises:
        ConfigError: Dask is not installed, or nobody answers.
    """
    try:
        dask: Any = importlib.import_module("dask.distributed")
    except ImportError:
        raise ConfigError("expected Dask for --cluster; pip install 'radioslam[cluster]'") from None
    if address == "local":
        options = {"threads_per_worker": 1, "dashboard_address": "127.0.0.1:0", "host": "127.0.0.1"}
        with dask.LocalCluster(n_workers=workers, processes=True, **options) as cluster, dask.Client(cluster) as client:
            yield client
        return
    try:
        client = dask.Client(address, timeout=ANSWER_S)
    except (OSError, ValueError) as error:
        raise ConfigError(f"expected a Dask scheduler at {address}, found: {error}") from None
    with client:
        yield client


def map_sites(
    client: Any, sites: Mapping[str, Sequence[Path]], config: Config, store: ObjectStore
) -> dict[str, dict[str, Any]]:
    """Map many sites in parallel; each result folder goes to the store under the site's name.

    Returns:
        The total of every summary by site, or the ``reason`` why it could not be mapped.
    """
    written = store.write(f"config-{uuid.uuid4().hex}", {"toml": np.array([config.to_toml()])})
    paths = {name: [str(path) for path in logs] for name, logs in sites.items()}
    waiting = {name: client.submit(_map_site, store.url, written, name, logs) for name, logs in paths.items()}
    totals = client.gather(waiting)
    store.remove(written)
    return dict(totals)


def _map_site(url: str, config: str, name: str, logs: Sequence[str]) -> dict[str, Any]:
    import tomllib

    from radioslam.errors import RadioSlamError
    from radioslam.formats import read_walks
    from radioslam.slam import map_walks

    store = ObjectStore(url)
    settings = Config.model_validate(tomllib.loads(str(store.read(config)["toml"][0])))
    try:
        result = map_walks(read_walks([Path(log) for log in logs]), settings)
    except RadioSlamError as error:
        return {"reason": str(error)}
    with tempfile.TemporaryDirectory() as folder:
        store.put_folder(result.save(Path(folder) / "result"), name)
    return {"walks": len(result.walks), "scans": len(result.radio_map), "seconds": sum(result.seconds.values())}


class ClusterEngine:
    """Joins tile by tile and optimizes area by area on the workers of a client."""

    def __init__(self, client: Any, store: ObjectStore) -> None:
        self.client, self.store = client, store

    @property
    def workers(self) -> int:
        """How many there are now."""
        return max(1, len(self.client.scheduler_info(n_workers=-1)["workers"]))

    def join(self, strengths: sparse.csr_array, threshold: float, gate: Gate | None = None) -> Iterator[Pairs]:
        """All pairs of rows of similarity ≥ ``threshold`` that the gate lets, a task per pair of blocks of rows."""
        run, rows = uuid.uuid4().hex, unit_rows(strengths)
        size = int(np.clip(rows.shape[0] // (2 * self.workers), FEWEST_SCANS, TILE_SCANS))
        firsts = range(0, rows.shape[0], size)
        blocks = [self._write_rows(f"{run}-rows-{k}", k, rows[k : k + size]) for k in firsts]
        tiles = [(a, b, f"{run}-tile-{k}-{m}") for k, a in enumerate(blocks) for m, b in enumerate(blocks) if k <= m]
        self._do(_join_tile, [(self.store.url, threshold, *tile) for tile in tiles])
        names = [name for _, _, name in tiles]
        for name in names:
            found = self.store.read(name)
            pairs = Pairs(found["i"], found["j"], found["similarity"])
            yield pairs.select(gate.lets(pairs.i, pairs.j)) if gate else pairs
        self.store.remove(*blocks, *names)

    def optimize(self, graph: PoseGraph, config: OptimizerConfig, last: bool) -> Solution:
        """The areas of the graph on the workers, the reduced graph here; all here where areas share too much."""
        areas = list(split_graph(graph, walks_by_area(graph, AREAS_PER_WORKER * self.workers)))
        if shared_part(areas) > MOST_SHARED:
            return OneMachine().optimize(graph, config, last)
        with _AreasThere(self, [area_arrays(area) for area in areas], config) as there:
            return minimize_in_areas(there, first_guess(graph), config, last and config.standard_deviations)

    def _write_rows(self, name: str, first: int, rows: sparse.csr_array) -> str:
        csr = {"data": rows.data, "indices": rows.indices, "indptr": rows.indptr}
        return self.store.write(name, {**csr, "shape": np.array(rows.shape), "first": np.array([first])})

    def _do(self, work: Callable[..., None], tasks: Sequence[tuple[Any, ...]]) -> None:
        self.client.gather([self.client.submit(work, *task, pure=False) for task in tasks])


def _join_tile(url: str, threshold: float, one: str, other: str, name: str) -> None:
    store = ObjectStore(url)
    (rows, first), (columns, second) = (_read_rows(store, block) for block in (one, other))
    products = sparse.coo_array(rows @ columns.T.tocsr())
    i, j = products.row.astype(np.int64) + first, products.col.astype(np.int64) + second
    keep = (i < j) & (products.data >= threshold) & (products.data > 0)
    store.write(name, {"i": i[keep], "j": j[keep], "similarity": np.minimum(products.data[keep], 1.0)})


def _read_rows(store: ObjectStore, name: str) -> tuple[sparse.csr_array, int]:
    parts = store.read(name)
    entries = parts["data"], parts["indices"], parts["indptr"]
    return sparse.csr_array(entries, shape=tuple(parts["shape"].tolist())), int(parts["first"][0])


class _AreasThere:
    """Areas kept in the store, computed by workers."""

    def __init__(self, engine: ClusterEngine, areas: Sequence[dict[str, Any]], config: OptimizerConfig) -> None:
        self.engine, self.store, self.run = engine, engine.store, uuid.uuid4().hex
        self.settings = config.model_dump_json()
        self.names = [self.store.write(f"{self.run}-{k}", area) for k, area in enumerate(areas)]
        self.written, self.points = [*self.names], dict[bytes, str]()

    def __enter__(self) -> _AreasThere:
        return self

    def __exit__(self, *_: object) -> None:
        self.store.remove(*self.written)

    def reduce(self, x: Array, damping: float) -> Sequence[Reduced]:
        """A task per area."""
        return [reduced_of(arrays) for arrays in self._ask("reduce", x, damping)]

    def back(self, x: Array, damping: float, shared_step: Array) -> Sequence[Values]:
        """A task per area."""
        given = self._keep(f"{self.run}-step-{uuid.uuid4().hex}", {"step": shared_step})
        return [(a["variables"], a["values"]) for a in self._ask("back", x, damping, [given] * len(self.names))]

    def variances(self, x: Array, covariances: Sequence[Array]) -> Sequence[Values]:
        """A task per area."""
        given = [
            self._keep(f"{name}-covariance", {"covariance": c}) for name, c in zip(self.names, covariances, strict=True)
        ]
        return [(a["variables"], a["values"]) for a in self._ask("variances", x, 0.0, given)]

    def _ask(self, what: str, x: Array, damping: float, given: Sequence[str] = ()) -> list[dict[str, Any]]:
        """Have every area do something at x, and read the answers."""
        key = x.tobytes()
        if key not in self.points:
            self.points = {key: self._keep(f"{self.run}-x-{uuid.uuid4().hex}", {"x": x})}
        answers = [f"{name}-{what}-{uuid.uuid4().hex}" for name in self.names]
        others = given or [""] * len(self.names)
        same = (self.store.url, self.settings, what, self.points[key], damping)
        self.engine._do(_at_area, [(*same, *task) for task in zip(self.names, others, answers, strict=True)])
        read = [self.store.read(name) for name in answers]
        self.store.remove(*answers)
        return read

    def _keep(self, name: str, arrays: dict[str, Any]) -> str:
        self.written.append(name)
        return self.store.write(name, arrays)


@functools.lru_cache(maxsize=8)
def _solver(url: str, settings: str, name: str) -> AreaSolver:
    return AreaSolver(area_of(ObjectStore(url).read(name)), OptimizerConfig.model_validate_json(settings))


def _at_area(
    url: str, settings: str, what: str, point: str, damping: float, name: str, given: str, answer: str
) -> None:
    """Linearize an area at a point and do what is asked; any worker can, whoever did the step before."""
    store = ObjectStore(url)
    with _ONE_AT_A_TIME:
        solver = _solver(url, settings, name)
        reduced = solver.reduce(store.read(point)["x"], damping)
        if what == "reduce":
            arrays = reduced_arrays(reduced)
        elif what == "back":
            arrays = _values(*solver.back(store.read(given)["step"]))
        else:
            arrays = _values(*solver.variances(store.read(given)["covariance"]))
    store.write(answer, arrays)


def _values(variables: Integers, values: Array) -> Arrays:
    return {"variables": variables, "values": values}
