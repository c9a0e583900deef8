"""Checks of a brep that need geometry, once for a surface: bad faces are refused or left out."""

from collections.abc import Iterable
from math import floor, log10

import numpy as np

from service.bases.row_batches import count_runs, find_begins
from service.engine.brep.borders.settling import LoopFaults
from service.engine.brep.preparation.domains import find_beyond
from service.engine.brep.preparation.parameter_curves import ParameterCurves
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.spline_shapes import find_boxes
from service.engine.trims.splines import Splines
from service.engine.vectors import length
from service.errors import InvalidRequest, Issue
from service.surface.brep_checks import Fault, coedge_pointer, loop_pointer, take_issues
from service.surface.brep_model import BrepModel, SkippedFace

FAR = 0.1
"""An edge is at most this share of the diagonal of its face away from the surface."""

DIGITS = 6
"""Digits of the diagonal of the part with which messages say where a fault is."""


def find_far_edges(model: BrepModel, curves: Splines, found: ParameterCurves) -> list[Fault]:
    """Edges that are further than a tenth of the diagonal of their face from its surface."""
    edge = model.coedge_edges
    rows = (edge >= 0).nonzero()[0]
    rows = rows[model.edge_curves[edge[rows]] >= 0]
    if not len(rows):
        return []
    low, high = (box[model.edge_curves[edge[rows]]] for box in find_boxes(curves))
    first = find_begins(model.coedge_faces[rows])
    extent = np.maximum.reduceat(high, first) - np.minimum.reduceat(low, first)
    diagonals = length(extent, -1)
    allowed = FAR * np.repeat(diagonals, count_runs(first, len(rows)))
    return [
        Fault(
            Issue(
                "edge_not_on_surface",
                "The edges of a face lie on its surface.",
                coedge_pointer(model, rows.item(k), "edges"),
                f"an edge {found.seen[rows[k]]:.6g} from the surface",
                f"at most {allowed[k]:.6g}: a tenth of the diagonal of the face",
            ),
            model.coedge_faces.item(rows.item(k)),
        )
        for k in np.flatnonzero(found.seen[rows] > allowed).tolist()
    ]


def find_outside_pcurves(
    model: BrepModel, surfaces: ClosedSurfaces, found: ParameterCurves
) -> list[Fault]:
    """Given parameter curves that are used and leave the domain of their surface.

    The parameter curve of an edge with a curve is made anew instead.
    """
    face, pcurves = model.coedge_faces, found.pcurves
    used = ((model.coedge_pcurves >= 0) & ~found.is_replaced).nonzero()[0]
    rows, beyond = find_beyond(surfaces, face[used], pcurves.take(used))
    return [
        Fault(
            Issue(
                "pcurve_outside",
                "The parameter curves of a face stay in the domain of its surface.",
                coedge_pointer(model, used.item(row), "pcurves"),
                f"{'uv'[int(apart.argmax())]} beyond the domain by {apart.max():.6g}",
                "parameters inside of the knots of the surface",
            ),
            model.coedge_faces.item(used.item(row)),
        )
        for row, apart in zip(rows.tolist(), beyond, strict=True)
    ]


def find_open_pcurve_loops(
    model: BrepModel, surfaces: ClosedSurfaces, found: ParameterCurves
) -> list[Fault]:
    """Loops of parameter curves alone, one of which begins far from the end of the one before.

    Far is a tenth of the diagonal of the box of all ends of the face.
    """
    rows = (model.coedge_edges < 0).nonzero()[0]
    if not len(rows):
        return []
    face, pcurves = model.coedge_faces[rows], found.pcurves
    loop, starts = model.coedge_loops[rows], model.loop_starts
    ends = np.array([pcurves.start[rows], pcurves.end[rows]])
    is_reversed = model.coedge_reversed[rows]
    ends = np.where(is_reversed, ends[::-1], ends)
    middles = (ends[0] + ends[1]) / 2
    begin, middle, end = (
        surfaces.evaluate(face, pcurves.evaluate(rows, t)) for t in (ends[0], middles, ends[1])
    )
    first = find_begins(face)
    corners = np.array([begin, middle, end])
    high = np.maximum.reduceat(corners.max(axis=0), first)
    diagonals = length(high - np.minimum.reduceat(corners.min(axis=0), first), -1)
    allowed = FAR * np.repeat(diagonals, count_runs(first, len(rows)))
    # Loops have parameter curves alone, or edges alone: the next one is in `rows`, too.
    following = np.where(rows + 1 == starts[loop + 1], starts[loop], rows + 1)
    jumps = length(begin[np.searchsorted(rows, following)] - end, -1)
    far = np.flatnonzero(jumps > allowed)
    faults = []
    for k in far[np.unique(loop[far], return_index=True)[1]].tolist():
        where, number = loop_pointer(model, loop.item(k)), rows.item(k) - starts.item(loop.item(k))
        issue = Issue(
            "loop_open",
            "Each parameter curve of a loop begins where the one before it ends.",
            where,
            f"a jump of {jumps[k]:.6g} behind parameter curve {number}",
            f"at most {allowed[k]:.6g}: a tenth of the diagonal of the face",
        )
        faults.append(Fault(issue, face.item(k)))
    return faults


def word_unbounded(model: BrepModel, loops: Iterable[int]) -> list[Fault]:
    """Faults of loops of the model whose material reaches a border that no loop has."""
    return [
        Fault(
            Issue(
                "loop_reversed",
                "The material of a face is on the left of its loops, seen against du × dv, and its "
                "loops bound it on all sides.",
                loop_pointer(model, loop),
                "material that reaches a border of the surface without a loop",
                "the loop in the other direction, or all loops of the face",
            ),
            model.loop_faces.item(loop),
        )
        for loop in loops
    ]


def word_loop_faults(prepared: PreparedBrep, faults: LoopFaults) -> list[Fault]:
    """Faults of the loops of a prepared brep."""
    if not len(faults.loops):
        return []
    model, sources = prepared.model, prepared.loop_sources
    digits = DIGITS - floor(log10(prepared.diagonal))
    points = prepared.places.evaluate(faults.faces, faults.places.T).round(digits) + 0.0
    worded = []
    for loop, code, other, face, point in zip(
        faults.loops.tolist(),
        faults.codes.tolist(),
        faults.others.tolist(),
        faults.faces.tolist(),
        points.tolist(),
        strict=True,
    ):
        source = sources.item(loop)
        pointer = loop_pointer(model, source) if source >= 0 else f"/faces/{face}"
        other_source = sources.item(other) if other >= 0 else -1
        if other in {loop, -1} or other_source in {source, -1}:
            partner = "itself"
        else:
            partner = "loop " + loop_pointer(model, other_source).rpartition("/")[2]
        near = "near ({:.6g}, {:.6g}, {:.6g})".format(*point)
        worded.append(Fault(_word_loop(code, pointer, partner, near), face))
    return worded


def _word_loop(fault: str, pointer: str, partner: str, near: str) -> Issue:
    """The issue of a loop; `partner` is the loop that it meets, and `near` says where."""
    if fault == "loop_reversed":
        return Issue(
            "loop_reversed",
            "The material of a face is on the left of its loops, seen against du × dv.",
            pointer,
            f"a loop with the material on its right {near}",
            "outer loops counter-clockwise, inner loops clockwise",
        )
    code = "loops_cross" if fault == "loops_cross" else "loops_touch"
    verb = "crosses" if code == "loops_cross" else "touches"
    return Issue(
        code,
        "The loops of a face neither cross nor touch, but at common vertices.",
        pointer,
        f"a loop that {verb} {partner} {near}",
        "loops apart from each other",
    )


def refuse_or_skip(model: BrepModel, faults: list[Fault]) -> tuple[SkippedFace, ...]:
    """The faces that are left out because of faults.

    Raises
    ------
    InvalidRequest
        If the model does not skip invalid faces.
    """
    if faults and not model.skips_invalid:
        raise InvalidRequest(*take_issues(faults))
    return skip_faces(faults)


def skip_faces(faults: Iterable[Fault]) -> tuple[SkippedFace, ...]:
    """The faces with faults, each with its first one."""
    first: dict[int, SkippedFace] = {}
    for fault in faults:
        first.setdefault(fault.face, SkippedFace(fault.face, fault.issue))
    return tuple(first.values())
