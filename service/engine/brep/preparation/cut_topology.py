"""The topology after faces were cut: new edges and coedges, and pieces of edges that are split."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools
from service.bases.row_batches import expand_runs
from service.engine.brep.preparation.arcs import SAME, Arc, CutLoops
from service.engine.brep.preparation.topology import Topology
from service.engine.trims.composition import compose_curves
from service.engine.trims.piecewise import make_segments, restrict_curves


def finish_cuts(work: CutLoops, tolerance: float) -> Topology:
    """The topology with the new loops, and with pieces in place of edges that are split.

    `tolerance` is the uncertainty of new edges and vertices, in model units.
    """
    topology = _add_new(work, tolerance)
    topology, cuts = _split_edges(work, topology)
    is_split = np.isin(topology.coedge_edges[: work.old_coedges], list(cuts))
    is_cut = np.isin(topology.loop_faces, list(work.loops))
    is_changed = is_cut | np.logical_or.reduceat(is_split, topology.loop_starts)
    kept = (~is_changed).nonzero()[0]
    # The loops that change: face, source, and arcs.
    changed = [(face, source, arcs) for face in work.loops for source, arcs in work.loops[face]]
    for loop in (is_changed & ~is_cut).nonzero()[0].tolist():
        face, source = int(topology.loop_faces[loop]), int(topology.loop_sources[loop])
        changed.append((face, source, work.list_arcs(loop)))
    pieces = [
        [piece for arc in arcs for piece in _divide(topology, arc, cuts)] for *_, arcs in changed
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


def _add_new(work: CutLoops, tolerance: float) -> Topology:
    """The topology with all new vertices, edges and coedges; no loop has the coedges yet."""
    topology = work.topology
    if work.vertices:
        topology, _ = topology.add_vertices(np.array(work.vertices), tolerance)
    number = np.arange(work.old_edges + len(work.edges))
    is_pole: Bools = np.array([edge.is_pole for edge in work.edges], bool)
    sources = np.array([edge.source for edge in work.edges], np.intp)
    for source, pole in sorted({(edge.source, edge.is_pole) for edge in work.edges}):
        rows = ((sources == source) & (is_pole == pole)).nonzero()[0]
        edges = [work.edges[k] for k in rows.tolist()]
        vertices = np.array([edge.vertices for edge in edges])
        curves = None
        if not pole:
            begin, end = np.array([[e.begin, e.end] for e in edges]).swapaxes(0, 1)
            lines = make_segments(begin, end, np.tile([0.0, 1.0], (len(edges), 1)))
            face = np.array([edge.face for edge in edges])
            curves = compose_curves(work.surfaces, face, lines, tolerance)
        topology, number[work.old_edges + rows] = topology.add_edges(
            vertices, curves, source, tolerance
        )
    if not work.coedges:
        return topology
    begin, end = np.array([[c.begin, c.end] for c in work.coedges]).swapaxes(0, 1)
    topology = topology.add_coedges(
        number[[coedge.edge for coedge in work.coedges]],
        np.array([coedge.is_reversed for coedge in work.coedges]),
        make_segments(begin, end, np.tile([0.0, 1.0], (len(begin), 1))),
    )
    work.splits = {int(number[edge]): splits for edge, splits in work.splits.items()}
    return topology


def _split_edges(
    work: CutLoops, topology: Topology
) -> tuple[Topology, dict[int, list[tuple[float, float, int]]]]:
    """With the pieces of all edges that are split; for each edge, their ends and numbers."""
    pieces: list[tuple[int, float, float, int, int]] = []
    for edge, splits in work.splits.items():
        start, end = topology.edge_ranges[edge].tolist()
        first, last = topology.edge_vertices[edge].tolist()
        stops = [(start, first), *sorted(splits), (end, last)]
        pieces += [(edge, a, b, v, w) for (a, v), (b, w) in pairwise(stops)]
    cuts: dict[int, list[tuple[float, float, int]]] = {edge: [] for edge in work.splits}
    if not pieces:
        return topology, cuts
    edges = np.array([piece[0] for piece in pieces])
    ends = np.array([piece[1:3] for piece in pieces])
    vertices = np.array([piece[3:] for piece in pieces])
    numbers = np.zeros(len(pieces), np.intp)
    for is_pole in (False, True):
        rows = (topology.is_degenerate[edges] == is_pole).nonzero()[0]
        if not len(rows):
            continue
        curves = None
        if not is_pole:
            curve = topology.edge_curves[edges[rows]]
            curves = restrict_curves(topology.curves, curve, *ends[rows].T)
        topology, numbers[rows] = topology.add_edges(vertices[rows], curves, 0, 0.0)
    # Pieces have the source and the uncertainty of their edge.
    ranges, sources = topology.edge_ranges.copy(), topology.edge_sources.copy()
    uncertainties = topology.edge_uncertainties.copy()
    ranges[numbers] = ends
    sources[numbers], uncertainties[numbers] = sources[edges], uncertainties[edges]
    for (edge, low, high, *_), number in zip(pieces, numbers.tolist(), strict=True):
        cuts[edge].append((low, high, number))
    topology = replace(
        topology, edge_ranges=ranges, edge_sources=sources, edge_uncertainties=uncertainties
    )
    return topology, cuts


def _divide(
    topology: Topology, arc: Arc, cuts: dict[int, list[tuple[float, float, int]]]
) -> list[tuple[Arc, int]]:
    """The parts of an arc over pieces of its edge, along the loop; and the piece of each."""
    edge = int(topology.coedge_edges[arc.coedge])
    if edge not in cuts:
        return [(arc, edge)]
    low, high = min(arc.begin, arc.end), max(arc.begin, arc.end)
    start, end = topology.edge_ranges[edge].tolist()
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
