"""What does the heavy work of a mapping run: the similarity join and the optimization."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from scipy import sparse

from radioslam.config import OptimizerConfig
from radioslam.factors import first_guess, graph_blocks
from radioslam.optimizer import Solution, minimize
from radioslam.pose_graph import PoseGraph
from radioslam.similarity import Gate, Pairs, stream_similar_pairs


class Engine(Protocol):
    """Somewhere to join and to optimize."""

    def join(self, strengths: sparse.csr_array, threshold: float, gate: Gate | None = None) -> Iterator[Pairs]:
        """All pairs of rows (n, m) of similarity ≥ ``threshold``, in parts; see ``similarity.stream_similar_pairs``."""
        ...

    def optimize(self, graph: PoseGraph, config: OptimizerConfig, last: bool) -> Solution:
        """Equation (1) with the unknowns of whole walks; of the last graph the marginal variances too."""
        ...


class OneMachine:
    """This process."""

    def join(self, strengths: sparse.csr_array, threshold: float, gate: Gate | None = None) -> Iterator[Pairs]:
        """All pairs, tile by tile."""
        return stream_similar_pairs(strengths, threshold, gate)

    def optimize(self, graph: PoseGraph, config: OptimizerConfig, last: bool) -> Solution:
        """The whole graph at once."""
        blocks = graph_blocks(graph, config)
        return minimize(blocks, first_guess(graph), config, variances=last and config.standard_deviations)
