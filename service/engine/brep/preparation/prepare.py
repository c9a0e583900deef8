"""Makes breps ready for meshing: all that does not depend on a tolerance, once for a surface.

Proof in docs/proofs.md: "Regions given by the input" and "Gaps of edges".
"""

from dataclasses import replace
from functools import partial
from math import dist

import numpy as np

from service.bases.arrays import Ints
from service.bases.kept import keep
from service.bases.row_batches import find_begins
from service.engine.brep.borders.settling import check_loops
from service.engine.brep.preparation.input_checks import (
    find_far_edges,
    find_open_pcurve_loops,
    find_outside_pcurves,
    refuse_or_skip,
    skip_faces,
    word_loop_faults,
    word_unbounded,
)
from service.engine.brep.preparation.parameter_curves import ParameterCurves, find_parameter_curves
from service.engine.brep.preparation.pcurve_edges import add_pcurve_edges
from service.engine.brep.preparation.pole_splits import find_passes, split_at_poles
from service.engine.brep.preparation.regions import make_regions
from service.engine.brep.preparation.topology import Topology
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.boxes import find_part_box
from service.engine.trims.closure import ClosedSurfaces, find_closure
from service.engine.trims.places import SIZE, Places
from service.engine.trims.spline_shapes import find_face_boxes
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.engine.trims.unrolling import unroll
from service.surface.brep_model import BrepModel, SkippedFace
from service.surface.content_key import content_key
from service.surface.placement import find_box

CLOSED = 1e-7
"""Sides of a surface that are nearer than this share of the diagonal are one curve, or a pole."""


def prepare(model: BrepModel) -> PreparedBrep:
    """Make a brep ready for meshing, whatever the tolerance; or the one kept of an equal model.

    Raises
    ------
    InvalidRequest
        If a face is invalid and the model does not skip invalid faces: `edge_not_on_surface`,
        `pcurve_outside`, `loop_reversed`, `loops_cross`, `loops_touch`. A face whose edges are
        further from its surface than the uncertainty is never refused for its loops; it is left
        out, and its gap is reported.
    """
    return keep(("prepared", content_key(model)), partial(prepare_anew, model))


def prepare_anew(model: BrepModel) -> PreparedBrep:
    """The prepared brep, whatever is kept; see `prepare`."""
    diagonal = _measure_model(model)
    surfaces = FaceSurfaces.of(model.surfaces, model.name)
    closed = find_closure(surfaces, CLOSED * diagonal)
    curves = Splines.of(model.curves)
    found = find_parameter_curves(model, closed, curves, diagonal)
    tolerance = CLOSED * diagonal
    # Edges through poles get their parameter curves later, in parts.
    curve = np.append(model.edge_curves, -1)[model.coedge_edges]
    passes = find_passes(closed, model.coedge_faces, curves, curve, tolerance)[0]
    found.seen[passes] = 0.0
    faults = find_far_edges(model, curves, found) + find_outside_pcurves(model, closed, found)
    faults += find_open_pcurve_loops(model, closed, found)
    skipped = refuse_or_skip(model, faults)
    topology = _begin(model, curves, found).drop_faces(_list_faces(skipped))
    topology = add_pcurve_edges(closed, topology, tolerance)
    if len(passes):
        topology = split_at_poles(closed, topology, tolerance, diagonal)
    bare = _find_bare(model)
    topology, unbounded = make_regions(closed, topology, bare, tolerance)
    skipped += refuse_or_skip(model, word_unbounded(model, unbounded))
    topology = topology.drop_faces(_list_faces(skipped))
    prepared = _finish(model, closed, topology, skipped)
    loop_faults = check_loops(prepared)
    if not len(loop_faults.loops):
        return prepared
    worded = word_loop_faults(prepared, loop_faults)
    gaps = np.zeros(len(surfaces))
    np.maximum.at(gaps, prepared.coedge_faces, prepared.gaps)
    # Where edges are off the surface, loops may lie anyhow: a gap is reported, and refuses nothing.
    is_gap = gaps > model.uncertainty
    crossed = skip_faces(fault for fault in worded if is_gap[fault.face])
    crossed += refuse_or_skip(model, [fault for fault in worded if not is_gap[fault.face]])
    left_out = _list_faces(crossed)
    topology = topology.drop_faces(left_out)
    prepared = _finish(model, closed, topology, skipped + crossed)
    return replace(prepared, left_out_gap=float(gaps[left_out].max(initial=0.0)))


def _find_bare(model: BrepModel) -> Ints:
    """The faces without loops that are their whole surfaces."""
    is_bare = np.ones(model.face_count, bool)
    is_bare[model.loop_faces] = False
    is_bare[_list_faces(model.skipped)] = False
    return is_bare.nonzero()[0]


def _list_faces(skipped: tuple[SkippedFace, ...]) -> Ints:
    """The numbers of skipped faces."""
    return np.array([each.face for each in skipped], np.intp)


def _measure_model(model: BrepModel) -> float:
    """A diagonal of the part from its vertices and edges, or from whole nets if it has none."""
    points = np.concatenate([model.vertices, model.curves.points])
    count = len(find_begins(model.loop_faces))
    if not len(points) or count + len(model.skipped) < model.face_count:
        points = np.concatenate([points, model.surfaces.points])
    return dist(*find_box(points))


def _begin(model: BrepModel, curves: Splines, found: ParameterCurves) -> Topology:
    """The topology of a model, with its parameter curves."""
    edge_count = len(model.edge_curves)
    ranges = np.tile([0.0, 1.0], (edge_count, 1))
    curved = model.edge_curves >= 0
    number = model.edge_curves[curved]
    ranges[curved] = np.stack([curves.start[number], curves.end[number]], axis=1)
    # Poles have the parameters of their parameter curves.
    edge = model.coedge_edges
    poles = ((edge >= 0) & ~found.is_open).nonzero()[0]
    poles = poles[model.edge_curves[edge[poles]] < 0]
    start, end = found.pcurves.start, found.pcurves.end
    ranges[edge[poles]] = np.stack([start[poles], end[poles]], axis=1)
    start, end = start.copy(), end.copy()
    start[poles], end[poles] = ranges[edge[poles]].T
    return Topology(
        model.vertices,
        model.vertex_uncertainties,
        model.edge_vertices,
        model.edge_curves,
        ranges,
        model.edge_uncertainties,
        model.is_degenerate,
        np.arange(edge_count),
        curves,
        model.loop_faces,
        model.loop_counts,
        np.arange(len(model.loop_counts)),
        edge,
        model.coedge_reversed,
        found.pcurves.move_ranges(start, end),
        found.is_guided,
        found.is_replaced,
        found.is_open | np.append(model.is_degenerate, False)[edge],
        found.gaps,
    )


def _finish(
    model: BrepModel,
    closed: ClosedSurfaces,
    topology: Topology,
    skipped: tuple[SkippedFace, ...],
) -> PreparedBrep:
    """Places over the boxes of the parameter curves of faces, and these in places."""
    face = topology.coedge_faces
    low, high = find_face_boxes(topology.pcurves, face, len(closed.surfaces))
    surfaces = unroll(closed, low, high).move_planes(low, high)
    places = Places.of(surfaces, low, high)
    pcurves = topology.pcurves.map_points(places.origin[face], SIZE / places.extent[face])
    points = [nets.points.transpose(2, 0, 1).reshape(-1, 3) for nets in topology.curves.groups]
    if not len(topology.vertices):  # all faces are skipped, and there are no edges
        points.append(np.stack(model.bounds))
    # Gaps were proved at points that may be on the other side of a surface that closes nearly.
    apart = closed.apart[face]
    gaps = np.where(np.isfinite(apart), topology.gaps + apart, np.nan)
    every = np.arange(len(surfaces))
    low, high = places.to_places(every, low), places.to_places(every, high)
    box = np.stack(find_part_box(places, low, high, topology.vertices, *points))
    return PreparedBrep(
        model=replace(model, prepared_box=(box[0], box[1])),
        surfaces=surfaces,
        places=places,
        curves=topology.curves,
        pcurves=pcurves,
        vertices=topology.vertices,
        vertex_uncertainties=topology.vertex_uncertainties,
        edge_vertices=topology.edge_vertices,
        edge_curves=topology.edge_curves,
        edge_ranges=topology.edge_ranges,
        edge_uncertainties=topology.edge_uncertainties,
        is_degenerate=topology.is_degenerate,
        loop_faces=topology.loop_faces,
        loop_counts=topology.loop_counts,
        loop_sources=topology.loop_sources,
        coedge_edges=topology.coedge_edges,
        coedge_faces=face,
        coedge_loops=topology.coedge_loops,
        coedge_reversed=topology.coedge_reversed,
        is_replaced=topology.is_replaced,
        is_reversed=model.is_reversed,
        edge_sources=topology.edge_sources,
        model_vertices=len(model.vertices),
        skipped_faces=tuple(sorted(model.skipped + skipped, key=lambda each: each.face)),
        box=box,
        known_gaps=gaps,
        periods=closed.period * closed.is_closed,
    )
