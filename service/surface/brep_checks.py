"""Checks of a brep on its creation: indices, chains of vertices, and ends of curves.

Each check returns faults. A `Fault` is one issue, with the face that is left out if the brep skips
invalid faces. On valid breps no loop runs over faces, edges or coedges; only faults are worded one
by one. `service.surface.shell_checks` has the checks of shells.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.row_batches import count_runs, find_begins
from service.errors import MAX_ISSUES, Issue
from service.surface.brep_model import BrepModel
from service.surface.spline_checks import find_end_points
from service.surface.spline_tables import CurveTable

GAP_SHARE = 0.1
"""The most by which the end of an edge's curve may be away from its vertex, as a share of the
diagonal of each face with this edge."""


@dataclass(frozen=True, slots=True)
class Fault:
    """An issue, and the face whose fault it is; −1 if no face can be left out for it."""

    issue: Issue
    face: int = -1


def find_index_faults(model: BrepModel) -> list[Fault]:
    """Numbers of vertices and edges that do not exist.

    An edge with an unknown vertex is a fault of each face that has this edge, and of the brep if no
    face has it.
    """
    vertex_count, edge_count = len(model.vertices), len(model.edge_vertices)
    is_unknown = (model.edge_vertices < 0) | (model.edge_vertices >= vertex_count)
    is_wrong_edge = np.any(is_unknown, axis=1)
    edges = model.coedge_edges
    is_wrong = (edges < -1) | (edges >= edge_count)
    if not (is_wrong_edge.any() or is_wrong.any()):
        return []

    def word_edge(edge: int) -> Issue:
        vertex = int(model.edge_vertices[edge][is_unknown[edge]][0])
        return Issue(
            "unknown_vertex",
            "An edge lies between two vertices, which it names by their numbers, from 0.",
            f"/edges/{edge}/vertices",
            f"vertex {vertex}",
            range_text(vertex_count, "vertices"),
        )

    def word_coedge(coedge: int) -> Issue:
        return Issue(
            "unknown_edge",
            "A loop lists edges by their numbers, from 0.",
            coedge_pointer(model, coedge, "edges"),
            f"edge {edges[coedge]}",
            range_text(edge_count, "edges"),
        )

    faces = model.coedge_faces
    faults = [Fault(word_coedge(c), faces.item(c)) for c in np.flatnonzero(is_wrong).tolist()]
    has_wrong_edge = ~is_wrong & (edges >= 0)
    has_wrong_edge[has_wrong_edge] = is_wrong_edge[edges[has_wrong_edge]]
    users = np.flatnonzero(has_wrong_edge)
    pairs = zip(edges[users].tolist(), faces[users].tolist(), strict=True)
    edge_faults = [Fault(word_edge(edge), face) for edge, face in sorted(set(pairs))]
    unused = np.setdiff1d(np.flatnonzero(is_wrong_edge), edges[users]).tolist()
    return [*(Fault(word_edge(edge)) for edge in unused), *edge_faults, *faults]


def find_edge_faults(model: BrepModel) -> list[Fault]:
    """Ends of curves that are far from their vertices, and lines without a length."""
    coedges = np.flatnonzero(model.coedge_edges >= 0)
    coedges = coedges[model.edge_curves[model.coedge_edges[coedges]] >= 0]
    if not len(coedges):
        return []
    edges, faces = model.coedge_edges[coedges], model.coedge_faces[coedges]
    curves = model.edge_curves[edges]
    low, high = _curve_boxes(model.curves)
    first = find_begins(faces)  # the first coedge of each face
    face_low = np.minimum.reduceat(low[curves], first, axis=0)
    face_high = np.maximum.reduceat(high[curves], first, axis=0)
    diagonals = np.repeat(length(face_high - face_low), count_runs(first, len(faces)))
    distances = length(
        find_end_points(model.curves)[curves] - model.vertices[model.edge_vertices[edges]]
    )
    allowed = GAP_SHARE * diagonals
    is_far = ~(distances <= allowed[:, np.newaxis])
    # A curve with equal control points is refused, so this is a line.
    is_short = (low[curves] == high[curves]).all(axis=1)
    faults = []
    for row in np.flatnonzero(is_far.any(axis=1) | is_short).tolist():
        edge, face = edges.item(row), faces.item(row)
        if is_short[row]:
            faults.append(Fault(_word_short_line(edge), face))
            continue
        side = int(distances[row].argmax())
        faults.append(
            Fault(
                Issue(
                    "edge_not_at_vertex",
                    "The curve of an edge begins at its first vertex and ends at its second.",
                    f"/edges/{edge}/vertices",
                    f"the {('start', 'end')[side]} of the curve {distances[row, side]:.6g} from "
                    f"vertex {model.edge_vertices[edge, side]}",
                    f"at most {allowed[row]:.6g}: a tenth of the diagonal of face {face}",
                ),
                face,
            )
        )
    return faults


def find_open_loops(model: BrepModel) -> list[Fault]:
    """Loops in which an edge does not begin at the vertex where the edge before it ends."""
    edges, rows = model.coedge_edges, np.arange(len(model.coedge_edges))
    starts = model.loop_starts
    following = rows + 1
    following[starts[1:] - 1] = starts[:-1]
    reverse = model.coedge_reversed.astype(np.intp)
    vertices = model.edge_vertices[edges] if len(model.edge_vertices) else np.zeros((len(rows), 2))
    last, first = vertices[rows, 1 - reverse], vertices[rows, reverse]
    is_open = np.flatnonzero((edges >= 0) & (last != first[following]))
    loops, position = np.unique(model.coedge_loops[is_open], return_index=True)
    faults = []
    for loop, coedge in zip(loops.tolist(), is_open[position].tolist(), strict=True):
        after = following.item(coedge)
        faults.append(
            Fault(
                Issue(
                    "loop_open",
                    "The edges of a loop follow each other from vertex to vertex, and the last "
                    "ends where the first begins.",
                    loop_pointer(model, loop),
                    f"edge {edges[coedge]} ends at vertex {last[coedge]}, and edge {edges[after]} "
                    f"begins at vertex {first[after]}",
                    "the same vertex; see `reversed`",
                ),
                model.coedge_faces.item(coedge),
            )
        )
    return faults


def take_issues(faults: Iterable[Fault]) -> list[Issue]:
    """The first issues of faults, each once."""
    return list(islice(_distinct(fault.issue for fault in faults), MAX_ISSUES))


def loop_pointer(model: BrepModel, loop: int) -> str:
    """The JSON pointer of a loop, relative to the brep."""
    face = model.loop_faces.item(loop)
    first = int(np.searchsorted(model.loop_faces, face))
    return f"/faces/{face}/loops/{loop - first}"


def coedge_pointer(model: BrepModel, coedge: int, field: str) -> str:
    """The JSON pointer of the edge or the pcurve of a coedge, relative to the brep."""
    loop = model.coedge_loops.item(coedge)
    return f"{loop_pointer(model, loop)}/{field}/{coedge - model.loop_starts.item(loop)}"


def length(vectors: FloatArray) -> FloatArray:
    """Lengths of vectors (…, 3)."""
    lengths: FloatArray = np.sqrt(np.square(vectors).sum(axis=-1))
    return lengths


def _distinct(issues: Iterable[Issue]) -> Iterator[Issue]:
    seen: set[Issue] = set()
    for issue in issues:
        if issue not in seen:
            seen.add(issue)
            yield issue


def _curve_boxes(table: CurveTable) -> tuple[FloatArray, FloatArray]:
    """Least and greatest coordinates of the control points of each curve, (n, 3) each."""
    starts = table.point_starts[:-1]
    low = np.minimum.reduceat(table.points, starts, axis=0)
    return low, np.maximum.reduceat(table.points, starts, axis=0)


def _word_short_line(edge: int) -> Issue:
    return Issue(
        "degenerate_curve",
        "An edge without a curve is a line between its vertices, which has a length.",
        f"/edges/{edge}",
        "a line from a point to itself",
        'a curve; or `"degenerate": true` and one vertex',
    )


def range_text(count: int, nouns: str) -> str:
    """The numbers from 0 of `count` things, as a text for clients."""
    return f"0 to {count - 1}" if count else f"no number, because there are no {nouns}"
