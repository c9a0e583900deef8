"""Takes faces out of a brep: the surface of one face, or a brep of some faces."""

from dataclasses import replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.errors import InvalidRequest, Issue
from service.surface.bezier import BezierSurface
from service.surface.brep import BrepSurface
from service.surface.bspline import BsplineSurface
from service.surface.convert.members import find_member
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import Select, Untrim
from service.surface.group import GroupSurface
from service.surface.spline_tables import expand_rows, find_starts


def untrim(
    brep: BrepSurface, operation: Untrim, _allowed: SizeLimits
) -> BezierSurface | BsplineSurface:
    """The whole surface of one face, with the face's name and the brep's vertical axis.

    Raises
    ------
    InvalidRequest
        `unknown_face`, or `unknown_field` if the operation names a member.
    """
    _refuse_member(operation)
    face, where = operation.face, "/face"
    if face is None:
        assert operation.patch is not None  # `Untrim` refuses an operation without both
        face, where = operation.patch, "/patch"
    _require_face(brep, face, where)
    name = brep.face_names[face] or brep.name
    one = brep.surfaces.select(np.array([face]))
    (p, q), counts = one.degrees[0].tolist(), one.counts[0].tolist()
    net = one.points.reshape(*counts, 3)
    weights = one.weights.reshape(counts) if one.is_rational[0] else None
    u, v = np.split(one.knots, [one.knot_starts[1]])
    if _is_unit(u, p) and _is_unit(v, q):
        return BezierSurface(net, weights, brep.up, name)
    return BsplineSurface(net, (p, q), (u, v), weights, brep.up, name)


def select(brep: BrepSurface, operation: Select, _allowed: SizeLimits) -> BrepSurface:
    """A brep of some faces, in the order of the operation, with their edges and vertices.

    A shell stays closed only if all its faces are chosen.

    Raises
    ------
    InvalidRequest
        `unknown_face`, `repeated_face`, or `unknown_field` if the operation names a member.
    """
    _refuse_member(operation)
    for position, face in enumerate(operation.faces):
        _require_face(brep, face, f"/faces/{position}")
    faces = np.array(operation.faces, np.intp)
    loop_starts = np.searchsorted(brep.loop_faces, np.arange(len(brep.surfaces) + 1))
    loops = expand_rows(loop_starts, faces)
    coedges = expand_rows(find_starts(brep.loop_counts), loops)
    edge_count, vertex_count = len(brep.edge_vertices), len(brep.vertices)
    # Numbers that the brep does not have stay unknown; loops without edges have −1.
    old_edges = brep.coedge_edges[coedges]
    is_known = (old_edges >= 0) & (old_edges < edge_count)
    edges = np.unique(old_edges[is_known])
    ends = brep.edge_vertices[edges]
    is_vertex = (ends >= 0) & (ends < vertex_count)
    vertices = np.unique(ends[is_vertex])
    pcurves, curves = brep.coedge_pcurves[coedges], brep.edge_curves[edges]
    palette, face_colors = _select_colors(brep, faces)
    shell_counts, shell_faces, is_closed = _select_shells(brep, faces)
    assert brep.vertex_uncertainties is not None
    assert brep.edge_uncertainties is not None
    return replace(
        brep,
        vertices=brep.vertices[vertices],
        edge_vertices=np.where(is_vertex, np.searchsorted(vertices, ends), len(vertices)),
        edge_curves=_renumber(curves),
        is_degenerate=brep.is_degenerate[edges],
        curves=brep.curves.select(curves[curves >= 0]),
        surfaces=brep.surfaces.select(faces),
        face_names=tuple(brep.face_names[face] for face in operation.faces),
        palette=palette,
        face_colors=face_colors,
        is_reversed=brep.is_reversed[faces],
        loop_faces=np.repeat(np.arange(len(faces)), np.diff(loop_starts)[faces]),
        loop_counts=brep.loop_counts[loops],
        coedge_edges=np.where(
            is_known, np.searchsorted(edges, old_edges), np.where(old_edges < 0, -1, len(edges))
        ),
        coedge_reversed=brep.coedge_reversed[coedges],
        coedge_pcurves=_renumber(pcurves),
        pcurves=brep.pcurves.select(pcurves[pcurves >= 0]),
        shell_counts=shell_counts,
        shell_faces=shell_faces,
        is_closed=is_closed,
        vertex_uncertainties=brep.vertex_uncertainties[vertices],
        edge_uncertainties=brep.edge_uncertainties[edges],
    )


def untrim_member(
    group: GroupSurface, operation: Untrim, allowed: SizeLimits
) -> BezierSurface | BsplineSurface:
    """`untrim` of a member of a group, without its placement."""
    if operation.patch is not None:
        member, face = find_member(group, operation.patch)
        if not isinstance(group.members[member].surface, BrepSurface):
            raise InvalidRequest(_not_a_brep("/patch"))
        operation = Untrim(face, member)
    return untrim(_take_member(group, operation), replace(operation, member=None), allowed)


def select_of_member(group: GroupSurface, operation: Select, allowed: SizeLimits) -> BrepSurface:
    """`select` of a member of a group, without its placement."""
    return select(_take_member(group, operation), replace(operation, member=None), allowed)


def _take_member(group: GroupSurface, operation: Untrim | Select) -> BrepSurface:
    """The member of the group that the operation names, which must be a brep."""
    count, member = len(group.members), operation.member
    if member is None:
        message = "In a group, an operation on faces names the brep by the number of its member."
        needed = f"0 to {count - 1}"
        raise InvalidRequest(Issue("missing_field", message, "/member", "nothing", needed))
    if member >= count:
        message = "Members have numbers from 0."
        issue = Issue("index_out_of_range", message, "/member", str(member), f"0 to {count - 1}")
        raise InvalidRequest(issue)
    surface = group.members[member].surface
    if not isinstance(surface, BrepSurface):
        raise InvalidRequest(_not_a_brep("/member"))
    if surface.metres_per_unit == group.metres_per_unit:
        return surface
    return replace(surface, metres_per_unit=group.metres_per_unit)  # its own has no effect


def _not_a_brep(where: str) -> Issue:
    message = "Only breps have faces with trims."
    return Issue("unsupported_operation", message, where, "another kind", "a brep")


def _refuse_member(operation: Untrim | Select) -> None:
    """Refuse an operation on a brep that names a member."""
    if operation.member is not None:
        message = "Only groups have members."
        issue = Issue("unknown_field", message, "/member", "a number", "nothing, for a brep")
        raise InvalidRequest(issue)


def _require_face(brep: BrepSurface, face: int, where: str) -> None:
    """Refuse the number of a face that the brep does not have."""
    count = len(brep.surfaces)
    if face >= count:
        message = "Faces have numbers from 0."
        issue = Issue("unknown_face", message, where, f"face {face}", f"0 to {count - 1}")
        raise InvalidRequest(issue)


def _renumber(numbers: Ints) -> Ints:
    """0, 1, 2, … in place of the numbers that are not negative."""
    renumbered: Ints = np.where(numbers >= 0, np.cumsum(numbers >= 0) - 1, -1)
    return renumbered


def _select_colors(brep: BrepSurface, faces: Ints) -> tuple[FloatArray, Ints]:
    """The colours of some faces in the order of their first faces, and the colour of each face."""
    colors = brep.face_colors[faces]
    used, first = np.unique(colors[colors >= 0], return_index=True)
    order = used[np.argsort(first)]
    numbers = np.full(len(brep.palette) + 1, -1)
    numbers[order] = np.arange(len(order))
    return brep.palette[order], numbers[colors]


def _select_shells(brep: BrepSurface, faces: Ints) -> tuple[Ints, Ints, Bools]:
    """The shells of some faces: the numbers of their faces, their new faces, which are closed."""
    shell_of = np.empty(len(brep.surfaces), np.intp)
    shell_of[brep.shell_faces] = np.repeat(np.arange(len(brep.shell_counts)), brep.shell_counts)
    shells, counts = np.unique(shell_of[faces], return_counts=True)
    order = np.argsort(shell_of[faces], kind="stable")
    is_closed = brep.is_closed[shells] & (counts == brep.shell_counts[shells])
    return counts, order, is_closed


def _is_unit(knots: FloatArray, degree: int) -> bool:
    """Whether the knots are those of one Bézier span over [0, 1]."""
    return bool(np.array_equal(knots, np.repeat([0.0, 1.0], degree + 1)))
