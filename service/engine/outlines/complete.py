"""Breps in which every face has loops, and every loop has edges.

Files need both. A face that is its whole surface gets its natural borders, seams and poles as a
loop; a loop that is given by parameter curves alone gets the curves S(c(t)) of space as edges.
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import Bools, Ints
from service.bases.row_batches import expand_runs
from service.engine.brep.preparation.natural_loops import add_natural_loops
from service.engine.brep.preparation.pcurve_edges import add_pcurve_edges
from service.engine.brep.preparation.topology import Topology
from service.engine.trims.closure import find_closure
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.brep_model import BrepModel
from service.surface.spline_tables import (
    CurveTable,
    SingleCurve,
    empty_curves,
    find_starts,
    stack_curves,
)

CLOSED = 1e-7
"""Sides of a surface that are nearer than this share of the diagonal are one curve, or a pole."""

MOST = 8
"""The highest degree of a curve S(c(t)); curves of higher degrees are interpolated. Readers do not
like them: that of Open CASCADE ends at degree 25."""


def complete(model: BrepModel) -> BrepModel:
    """The brep with loops for all faces of its shells, and with edges for all coedges."""
    has_loops = np.zeros(model.face_count, bool)
    has_loops[model.loop_faces] = True
    in_shell = np.zeros(model.face_count, bool)
    in_shell[model.shell_faces] = True
    bare = np.flatnonzero(in_shell & ~has_loops)
    is_free = model.coedge_edges < 0
    if not len(bare) and not is_free.any():
        return model
    surfaces = FaceSurfaces.of(model.surfaces, model.name)
    tolerance = CLOSED * model.diagonal
    closed = find_closure(surfaces, tolerance)
    free_loops = is_free[model.loop_starts[:-1]] if len(model.loop_counts) else np.empty(0, bool)
    topology = add_pcurve_edges(closed, _take_free_loops(model, free_loops), tolerance, MOST)
    if len(bare):
        topology = add_natural_loops(closed, topology, bare, closed.low[bare], tolerance)
    return _join(model, topology, ~free_loops)


def _take_free_loops(model: BrepModel, free_loops: Bools) -> Topology:
    """The loops that are given by their parameter curves, without vertices and edges."""
    loops = np.flatnonzero(free_loops)
    counts = model.loop_counts[loops]
    _, coedges = expand_runs(counts, model.loop_starts[loops])
    count = len(coedges)
    no = np.zeros(count, bool)
    return Topology(
        vertices=np.empty((0, 3)),
        vertex_uncertainties=np.empty(0),
        edge_vertices=np.empty((0, 2), np.intp),
        edge_curves=np.empty(0, np.intp),
        edge_ranges=np.empty((0, 2)),
        edge_uncertainties=np.empty(0),
        is_degenerate=np.empty(0, bool),
        edge_sources=np.empty(0, np.intp),
        curves=Splines.of(empty_curves(3)),
        loop_faces=model.loop_faces[loops],
        loop_counts=counts,
        loop_sources=loops,
        coedge_edges=np.full(count, -1),
        coedge_reversed=model.coedge_reversed[coedges],
        pcurves=Splines.of(model.pcurves.select(model.coedge_pcurves[coedges])),
        is_given=~no,
        is_replaced=no,
        is_open=no,
        gaps=np.full(count, np.nan),
    )


def _join(model: BrepModel, topology: Topology, kept_loops: Bools) -> BrepModel:
    """The brep with its loops that have edges, and with all of a topology."""
    loops = np.flatnonzero(kept_loops)
    _, coedges = expand_runs(model.loop_counts[loops], model.loop_starts[loops])
    loop_faces = np.concatenate([model.loop_faces[loops], topology.loop_faces])
    counts = np.concatenate([model.loop_counts[loops], topology.loop_counts])
    order = np.argsort(loop_faces, kind="stable")
    _, rows = expand_runs(counts[order], find_starts(counts)[order])
    edge_count, curve_count = len(model.edge_curves), len(model.curves)
    pcurve_count = len(model.pcurves)
    new_curves = topology.edge_curves

    def join_rows(old: Ints, new: Ints) -> Ints:
        joined: Ints = np.concatenate([old[coedges], new])[rows]
        return joined

    new_pcurves = pcurve_count + np.arange(len(topology.coedge_edges))
    return replace(
        model,
        vertices=np.concatenate([model.vertices, topology.vertices]),
        vertex_uncertainties=np.concatenate(
            [model.vertex_uncertainties, topology.vertex_uncertainties]
        ),
        edge_vertices=np.concatenate(
            [model.edge_vertices, topology.edge_vertices + len(model.vertices)]
        ),
        edge_curves=np.concatenate(
            [model.edge_curves, np.where(new_curves < 0, -1, new_curves + curve_count)]
        ),
        edge_uncertainties=np.concatenate([model.edge_uncertainties, topology.edge_uncertainties]),
        is_degenerate=np.concatenate([model.is_degenerate, topology.is_degenerate]),
        curves=_append(model.curves, topology.curves),
        loop_faces=loop_faces[order],
        loop_counts=counts[order],
        coedge_edges=join_rows(model.coedge_edges, topology.coedge_edges + edge_count),
        coedge_reversed=np.concatenate([model.coedge_reversed[coedges], topology.coedge_reversed])[
            rows
        ],
        coedge_pcurves=join_rows(model.coedge_pcurves, new_pcurves),
        pcurves=_append(model.pcurves, topology.pcurves),
    )


def _append(table: CurveTable, splines: Splines) -> CurveTable:
    """The curves of a table, and then all splines."""
    added = to_table(splines)
    return CurveTable(
        np.concatenate([table.degrees, added.degrees]),
        np.concatenate([table.counts, added.counts]),
        np.concatenate([table.points, added.points]),
        np.concatenate([table.weights, added.weights]),
        np.concatenate([table.is_rational, added.is_rational]),
        np.concatenate([table.knots, added.knots]),
    )


def to_table(splines: Splines) -> CurveTable:
    """Curves as columns; each break has the multiplicity of the degree."""
    curves: list[SingleCurve] = []
    for curve in range(len(splines)):
        nets = splines.groups[splines.group[curve]]
        degree, spans = nets.degree, splines.span_count.item(curve)
        first = splines.row.item(curve)
        own = nets.nets[first : first + spans]
        # The last control point of a span is the first one of the next.
        net = np.concatenate([own[:, :-1].reshape(-1, own.shape[2]), own[-1, -1:]])
        points = net[:, : splines.dimension]
        weights = net[:, splines.dimension] if nets.is_rational else None
        begin = splines.first_break.item(curve)
        repeats = np.full(spans + 1, degree)
        repeats[[0, -1]] = degree + 1
        knots = np.repeat(splines.breaks[begin : begin + spans + 1], repeats)
        points = points if weights is None else points / weights[:, np.newaxis]
        curves.append((degree, knots, points, weights))
    return stack_curves(curves, splines.dimension)
