"""Loops as lists of arcs of coedges, while they are cut; and the edges that are split by this."""

from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.row_batches import expand_runs
from service.engine.brep.topology import Topology
from service.engine.trims.piecewise import restrict_curves

SAME = 1e-9
"""Splits of an edge that are nearer than this share of its range are one."""


@dataclass(frozen=True, eq=False, slots=True)
class Arc:
    """A part of a coedge, as a loop runs along it, moved by (2,) in the parameters.

    `begin` and `end` are parameters of the edge; `begin` is greater where the coedge is reversed.
    """

    coedge: int
    begin: float
    end: float
    shift: FloatArray

    def move(self, shift: FloatArray) -> "Arc":
        """The arc, moved further."""
        return replace(self, shift=self.shift + shift)


ArcLoop: TypeAlias = list[Arc]


@dataclass(eq=False)
class CutLoops:
    """A topology, the loops of faces that are cut, and the splits of edges.

    Attributes
    ----------
    topology : Topology
    loops : dict
        The loops of each face that was cut, with the loops of the model from which they came.
    splits : dict
        For each edge, parameters at which it is split, with the vertices there.
    """

    topology: Topology
    loops: dict[int, list[tuple[int, ArcLoop]]] = field(default_factory=dict)
    splits: dict[int, list[tuple[float, int]]] = field(default_factory=dict)

    def list_arcs(self, loop: int) -> ArcLoop:
        """The whole coedges of a loop of the topology."""
        first = int(self.topology.loop_starts[loop])
        return [
            self.make_arc(coedge)
            for coedge in range(first, first + int(self.topology.loop_counts[loop]))
        ]

    def make_arc(self, coedge: int) -> Arc:
        """A whole coedge."""
        start, end = self.topology.edge_ranges[self.topology.coedge_edges[coedge]].tolist()
        if self.topology.coedge_reversed[coedge]:
            start, end = end, start
        return Arc(coedge, start, end, np.zeros(2))

    def split(self, coedge: int, t: float) -> int:
        """The vertex at which the edge of a coedge is split at a parameter."""
        topology = self.topology
        edge = int(topology.coedge_edges[coedge])
        start, end = topology.edge_ranges[edge].tolist()
        for other, vertex in self.splits.get(edge, []):
            if abs(other - t) <= SAME * (end - start):
                return vertex
        if topology.is_degenerate[edge]:
            vertex = int(topology.edge_vertices[edge, 0])
        else:
            curve = topology.edge_curves[[edge]]
            point = topology.curves.evaluate(curve, np.array([t]))
            uncertainty = float(topology.edge_uncertainties[edge])
            self.topology, numbers = topology.add_vertices(point, uncertainty)
            vertex = int(numbers[0])
        self.splits.setdefault(edge, []).append((t, vertex))
        return vertex

    def finish(self) -> Topology:
        """The topology with the new loops, and with pieces in place of edges that are split."""
        cuts = self._split_edges()
        topology = self.topology
        is_split = np.isin(topology.coedge_edges, list(cuts))
        is_cut = np.isin(topology.loop_faces, list(self.loops))
        is_changed = is_cut | np.logical_or.reduceat(is_split, topology.loop_starts)
        kept = (~is_changed).nonzero()[0]
        # The loops that change: face, source, and arcs.
        changed = [
            (face, source, arcs) for face, loops in self.loops.items() for source, arcs in loops
        ]
        for loop in (is_changed & ~is_cut).nonzero()[0].tolist():
            face, source = int(topology.loop_faces[loop]), int(topology.loop_sources[loop])
            changed.append((face, source, self.list_arcs(loop)))
        pieces = [
            [piece for arc in arcs for piece in self._divide(arc, cuts)] for *_, arcs in changed
        ]
        first = len(topology.coedge_edges)
        topology = _add_pieces(topology, [piece for row in pieces for piece in row])
        _, rows = expand_runs(topology.loop_counts[kept], topology.loop_starts[kept])
        counts = [len(row) for row in pieces]
        return topology.take_coedges(
            np.concatenate([rows, first + np.arange(sum(counts))]),
            np.concatenate([topology.loop_faces[kept], [face for face, _, _ in changed]]),
            np.concatenate([topology.loop_counts[kept], counts]),
            np.concatenate([topology.loop_sources[kept], [source for _, source, _ in changed]]),
        ).sort_loops()

    def _split_edges(self) -> dict[int, list[tuple[float, float, int]]]:
        """For each edge that is split, its pieces: ends, and the number of the new edge."""
        cuts = {}
        for edge, splits in self.splits.items():
            topology = self.topology
            start, end = topology.edge_ranges[edge].tolist()
            first, last = topology.edge_vertices[edge].tolist()
            ends = [(start, first), *sorted(splits), (end, last)]
            low, high = np.array([t for t, _ in ends[:-1]]), np.array([t for t, _ in ends[1:]])
            vertices = np.array([[a, b] for (_, a), (_, b) in pairwise(ends)])
            curves = None
            if not topology.is_degenerate[edge]:
                curve = np.full(len(low), topology.edge_curves[edge])
                curves = restrict_curves(topology.curves, curve, low, high)
            self.topology, numbers = topology.add_edges(
                vertices,
                curves,
                int(topology.edge_sources[edge]),
                float(topology.edge_uncertainties[edge]),
            )
            ranges = self.topology.edge_ranges.copy()
            ranges[numbers] = np.stack([low, high], axis=1)
            self.topology = replace(self.topology, edge_ranges=ranges)
            cuts[edge] = list(zip(low.tolist(), high.tolist(), numbers.tolist(), strict=True))
        return cuts

    def _divide(
        self, arc: Arc, cuts: dict[int, list[tuple[float, float, int]]]
    ) -> list[tuple[Arc, int]]:
        """The parts of an arc over pieces of its edge, along the loop; and the piece of each."""
        edge = int(self.topology.coedge_edges[arc.coedge])
        if edge not in cuts:
            return [(arc, edge)]
        low, high = min(arc.begin, arc.end), max(arc.begin, arc.end)
        start, end = self.topology.edge_ranges[edge].tolist()
        margin = SAME * (end - start)
        # Ends of arcs at splits are those of the pieces.
        pieces = [(a, b, n) for a, b, n in cuts[edge] if a > low - margin and b < high + margin]
        if arc.begin > arc.end:
            return [(replace(arc, begin=b, end=a), n) for a, b, n in reversed(pieces)]
        return [(replace(arc, begin=a, end=b), n) for a, b, n in pieces]


def _add_pieces(topology: Topology, pieces: list[tuple[Arc, int]]) -> Topology:
    """The topology with a coedge for each of the arcs, which are whole edges."""
    coedges = np.array([arc.coedge for arc, _ in pieces])
    ends = np.array([[arc.begin, arc.end] for arc, _ in pieces])
    shift = np.array([arc.shift for arc, _ in pieces])
    pcurves = restrict_curves(topology.pcurves, coedges, ends.min(axis=1), ends.max(axis=1))
    return topology.add_coedges(
        np.array([edge for _, edge in pieces]),
        topology.coedge_reversed[coedges],
        pcurves.map_points(-shift, np.ones_like(shift)),
        topology.is_replaced[coedges],
        topology.gaps[coedges],
    )
