"""A surface of patches as breps: natural borders, seams and poles become edges and vertices.

Borders that are equal become one edge. Each closed shell is a brep of its own, a solid whose faces
point outwards; all open shells are one brep.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.affine_combination import combine
from service.bases.arrays import FloatArray, Ints
from service.bases.blossoms import find_refinement, raise_knots
from service.cancellation import checkpoint
from service.engine.connectivity.connect import connect
from service.engine.connectivity.seams import Seams
from service.engine.outlines.faces import OutlineFaces, Spline, find_faces
from service.engine.outlines.runs import IS_AGAINST, Runs, find_runs
from service.engine.outlines.shells import OutlineShells, find_shells
from service.surface.brep_model import BrepModel
from service.surface.lowered import PatchModel
from service.surface.spline_tables import SingleCurve, stack_curves

UNCERTAINTY_SHARE = 1e-9
"""The uncertainty of an outline, as a share of the model's diagonal: more than rounding adds."""

EVEN = 1e-14
"""Breaks that differ from evenly mapped ones by at most this share of their range are even."""

CHECKED_EDGES = 1 << 12
"""How many edges are made between two checks whether the request is cancelled."""


def outline(model: PatchModel) -> tuple[BrepModel, ...]:
    """The breps of a surface: its closed shells one by one, then all open shells together.

    A face has the name of its part if the surface has several. Faces have the parameters of their
    splines; every coedge has a parameter curve, a straight line.
    """
    seams = connect(model)
    faces = find_faces(model)
    runs = find_runs(faces, seams)
    shells = find_shells(faces, runs, model.batches, _find_middle(model))
    found = _Found(model, seams, faces, runs, shells, _name_faces(model, faces))
    groups = [np.array([shell]) for shell in np.flatnonzero(shells.is_closed)]
    open_shells = np.flatnonzero(~shells.is_closed)
    groups += [open_shells] if len(open_shells) else []
    return tuple(_build(found, group) for group in groups)


@dataclass(frozen=True, eq=False, slots=True)
class _Found:
    """The model of a surface, and its faces with their names, runs and shells."""

    model: PatchModel
    seams: Seams
    faces: OutlineFaces
    runs: Runs
    shells: OutlineShells
    names: tuple[str, ...]


def _find_middle(model: PatchModel) -> FloatArray:
    low, high = model.bounds
    return low + (high - low) / 2


def _name_faces(model: PatchModel, faces: OutlineFaces) -> tuple[str, ...]:
    """The part of each face; no names if the surface is one part."""
    if len(model.parts) == 1:
        return ("",) * len(faces.first)
    numbers = model.part_numbers[faces.first]
    return tuple(model.parts[number].name for number in numbers.tolist())


def _build(found: _Found, group: Ints) -> BrepModel:
    """The brep of some shells."""
    model, faces, runs, shells = found.model, found.faces, found.runs, found.shells
    chosen = np.flatnonzero(np.isin(shells.shell, group))
    rows = np.flatnonzero(np.isin(shells.shell[runs.face], group))
    count = len(rows)
    # Runs that share no edge are edges of their own.
    own = int(runs.edge.max()) + 1 + np.arange(len(runs.edge))
    key = np.where(shells.is_shared, runs.edge, own)[rows]
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    # Edges in the order of the first runs that have them.
    order = np.argsort(first)
    owners = rows[first[order]]
    rank = np.empty(len(order), np.intp)
    rank[order] = np.arange(len(order))
    edge = rank[number]
    is_against = IS_AGAINST[runs.side]
    owner = owners[edge]
    is_reversed = is_against[owner] ^ (runs.is_backward[rows] != runs.is_backward[owner])
    ends = runs.corners[owners]
    ends = np.where(is_against[owners][:, np.newaxis], ends[:, ::-1], ends)
    corners, vertices = np.unique(ends, return_inverse=True)
    is_pole = runs.is_pole[owners]
    edge_curves = np.where(is_pole, -1, np.cumsum(~is_pole) - 1)
    curves = [_take_border(faces, runs, row) for row in owners[~is_pole].tolist()]
    pcurves = [
        _draw_line(faces, runs, row, own_row, is_turned)
        for row, own_row, is_turned in zip(
            rows.tolist(), owner.tolist(), (is_reversed != is_against[rows]).tolist(), strict=True
        )
    ]
    faces_of_group = np.full(len(shells.shell), -1)
    faces_of_group[chosen] = np.arange(len(chosen))
    loop_counts = np.bincount(faces_of_group[runs.face[rows]], minlength=len(chosen))
    in_shells = shells.shell[chosen]
    uncertainty = UNCERTAINTY_SHARE * model.diagonal
    return BrepModel(
        name=model.name,
        up=model.up,
        vertices=found.seams.corner_points[corners],
        vertex_uncertainties=np.full(len(corners), uncertainty),
        edge_vertices=vertices.reshape(-1, 2),
        edge_curves=edge_curves,
        edge_uncertainties=np.full(len(owners), uncertainty),
        is_degenerate=is_pole,
        curves=stack_curves(curves, 3),
        surfaces=faces.table().select(chosen),
        face_names=tuple(found.names[face] for face in chosen.tolist()),
        palette=np.empty((0, 4)),
        face_colors=np.full(len(chosen), -1),
        is_reversed=shells.is_flipped[chosen],
        loop_faces=np.arange(len(chosen)),
        loop_counts=loop_counts,
        coedge_edges=edge,
        coedge_reversed=is_reversed,
        coedge_pcurves=np.arange(count),
        pcurves=stack_curves(pcurves, 2),
        shell_counts=np.bincount(in_shells, minlength=1)[group],
        shell_faces=np.argsort(in_shells, kind="stable"),
        is_closed=shells.is_closed[group],
        uncertainty=uncertainty,
    )


def _take_border(faces: OutlineFaces, runs: Runs, row: int) -> SingleCurve:
    """The border of a face along a run, in the direction of the increasing parameter."""
    if row % CHECKED_EDGES == 0:
        checkpoint()
    face, side = runs.face.item(row), runs.side.item(row)
    spline, axis = faces.splines[face], side % 2
    line = _take_line(spline, side)
    degree, knots = spline.degree[axis], spline.knots[axis]
    breaks, begin, end = faces.breaks[face][axis], runs.begin.item(row), runs.end.item(row)
    if end - begin == len(breaks) - 1:
        return degree, knots, *line
    target = raise_knots(knots, degree, degree, breaks.item(begin), breaks.item(end))
    return degree, target, *combine(*line, *find_refinement(knots, degree, target, degree))


def _take_line(spline: Spline, side: int) -> tuple[FloatArray, FloatArray | None]:
    """The control points and weights on one side of a spline, in the order of `runs.side`."""
    index = ((slice(None), 0), (-1,), (slice(None), -1), (0,))[side]
    return spline.points[index], None if spline.weights is None else spline.weights[index]


def _draw_line(
    faces: OutlineFaces, runs: Runs, row: int, owner: int, is_turned: bool
) -> SingleCurve:
    """The parameter curve of a run: along its side, at the parameters of the owner of the edge.

    `is_turned` says whether the edge runs against the increasing parameter of the side.
    """
    face, side = runs.face.item(row), runs.side.item(row)
    axis = side % 2
    values = faces.breaks[face][axis][runs.begin.item(row) : runs.end.item(row) + 1]
    values = values[::-1] if is_turned else values
    own_axis = runs.side.item(owner) % 2
    own_breaks = faces.breaks[runs.face.item(owner)][own_axis]
    t = own_breaks[runs.begin.item(owner) : runs.end.item(owner) + 1]
    if len(t) > 2:
        low, high = values[0], values[-1]
        even = low + (high - low) * ((t - t[0]) / (t[-1] - t[0]))
        if np.abs(values - even).max() <= EVEN * abs(high - low):
            values, t = values[[0, -1]], t[[0, -1]]
    across = faces.breaks[face][1 - axis]
    points = np.empty((len(values), 2))
    points[:, axis] = values
    points[:, 1 - axis] = across[-1] if side in (1, 2) else across[0]
    return 1, np.concatenate([t[:1], t, t[-1:]]), points, None
