"""From the columns of a request to the lowered brep: checks, faces left out, lines as curves."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from service.errors import MAX_ISSUES, InvalidRequest
from service.surface.brep_checks import (
    Fault,
    find_edge_faults,
    find_index_faults,
    find_open_loops,
    take_issues,
)
from service.surface.brep_model import BrepModel, SkippedFace
from service.surface.shell_checks import (
    count_uses,
    find_direction_faults,
    find_open_shells,
    find_shell_faults,
    word_open_shell,
)
from service.surface.spline_tables import CurveTable


def lower_columns(model: BrepModel) -> BrepModel:
    """The lowered brep of columns in which lines have no curves yet, and nothing is checked.

    Raises
    ------
    InvalidRequest
        The faults of all faces, with pointers relative to the brep. If the model skips invalid
        faces, these are left out; unknown, repeated and missing faces of shells are always raised.
    """
    _raise(find_shell_faults(model))
    model = _leave_out(model, find_index_faults(model))
    model = _add_lines(model)
    model = _leave_out(model, [*find_edge_faults(model), *find_open_loops(model)])
    uses = count_uses(model)
    faults = find_direction_faults(model, uses)
    if faults:
        model = _leave_out(model, faults)
        uses = count_uses(model)
    shells = find_open_shells(model, uses)
    if not len(shells):
        return model
    if not model.skips_invalid:
        first_shells = shells[:MAX_ISSUES].tolist()
        raise InvalidRequest(*(word_open_shell(uses, shell) for shell in first_shells))
    is_closed = model.is_closed.copy()
    is_closed[shells] = False
    return replace(model, is_closed=is_closed)


def _raise(faults: Iterable[Fault]) -> None:
    """Raise the issues of these faults, if there are any."""
    issues = take_issues(faults)
    if issues:
        raise InvalidRequest(*issues)


def _leave_out(model: BrepModel, faults: list[Fault]) -> BrepModel:
    """The model without the faces of these faults; raises them unless invalid faces are skipped."""
    if not faults:
        return model
    if not model.skips_invalid:
        _raise(faults)
    issues = {skipped.face: skipped.issue for skipped in model.skipped}
    for fault in faults:
        if fault.face >= 0:
            issues.setdefault(fault.face, fault.issue)
    is_kept = np.ones(model.face_count, bool)
    is_kept[list(issues)] = False
    loops, coedges = is_kept[model.loop_faces], is_kept[model.coedge_faces]
    shells = np.repeat(np.arange(len(model.shell_counts)), model.shell_counts)
    in_shell = is_kept[model.shell_faces]
    shell_counts = np.bincount(shells[in_shell], minlength=len(model.shell_counts))
    vertices = model.edge_vertices
    is_unknown = np.any((vertices < 0) | (vertices >= len(model.vertices)), axis=1)
    # Without vertices, all edges are unknown, and none is needed.
    edges = slice(None if len(model.vertices) else 0)
    return replace(
        model,
        # No face that is left has an edge with an unknown vertex: these edges become points.
        edge_vertices=np.where(is_unknown[:, np.newaxis], 0, vertices)[edges],
        edge_curves=np.where(is_unknown, -1, model.edge_curves)[edges],
        edge_uncertainties=model.edge_uncertainties[edges],
        is_degenerate=(model.is_degenerate | is_unknown)[edges],
        loop_faces=model.loop_faces[loops],
        loop_counts=model.loop_counts[loops],
        coedge_edges=model.coedge_edges[coedges],
        coedge_reversed=model.coedge_reversed[coedges],
        coedge_pcurves=model.coedge_pcurves[coedges],
        shell_counts=shell_counts,
        shell_faces=model.shell_faces[in_shell],
        is_closed=model.is_closed & (shell_counts == model.shell_counts),
        skipped=tuple(SkippedFace(face, issues[face]) for face in sorted(issues)),
    )


def _add_lines(model: BrepModel) -> BrepModel:
    """The model in which edges that are lines have curves of degree 1 over [0, 1]."""
    lines = np.flatnonzero((model.edge_curves < 0) & ~model.is_degenerate)
    count, curves = len(lines), model.curves
    if not count:
        return model
    ends = model.vertices[model.edge_vertices[lines]]
    edge_curves = model.edge_curves.copy()
    edge_curves[lines] = len(curves) + np.arange(count)
    return replace(
        model,
        edge_curves=edge_curves,
        curves=CurveTable(
            np.append(curves.degrees, np.ones(count, np.intp)),
            np.append(curves.counts, np.full(count, 2)),
            np.concatenate([curves.points, ends.reshape(-1, 3)]),
            np.append(curves.weights, np.ones(2 * count)),
            np.append(curves.is_rational, np.zeros(count, bool)),
            np.append(curves.knots, np.tile([0.0, 0.0, 1.0, 1.0], count)),
        ),
    )
