"""Sections of a surface by planes, in four steps: cells, segments, arcs, polylines.

The arrays of one step are computed for several planes at once. The section by one plane does not
depend on the other planes.
"""

from collections.abc import Callable, Iterator

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.connectivity.incidence import triangular_patches
from service.engine.connectivity.seams import Seams
from service.engine.curves.polyline import Polyline
from service.engine.nets.query_nets import surface_nets
from service.engine.sections.arc_search import ArcNodes, ArcSearch
from service.engine.sections.borders import find_border_lines
from service.engine.sections.cells import LocalPlanes, find_boxes, find_pairs
from service.engine.sections.flatness import bound_rounding
from service.engine.sections.sides import is_change
from service.engine.sections.trace import join_arcs
from service.engine.sections.values import Planes, Section, Sections
from service.engine.vectors import dot
from service.surface.lowered import PatchModel

CHUNK_NUMBERS = 1 << 16
"""How many coefficients of the polynomials f (`cells`) one chunk of pairs of a plane and a net
has, before halving; more only if one plane alone has more."""

MIN_TOLERANCE = 2.0**-38
"""The least tolerance in the coordinates of the nets, for a surface that is one point."""

MAX_DISTANCE = 2.0**-14
"""Touching points nearer than this to each other, in the coordinates of the nets, count as one
point, because several cells around one point may touch the plane."""

CHUNK_PAIRS = 1 << 20
"""How many pairs of a plane and a net have their boxes compared at once."""

TOLERANCE_FACTOR = 0.999
"""Sections are refined to this multiple of the tolerance. Formats round the bound up to four
digits, and the rounded bound must still be within the tolerance."""


def cut_surface(
    model: PatchModel,
    seams: Seams,
    planes: Planes,
    tolerance: float,
    allow: Callable[[int], None],
) -> Sections:
    """Cut a model with these seams by planes.

    Parameters
    ----------
    tolerance : float
        Model units.
    allow : callable
        Is called with lower bounds of the number of pieces, which are the cells that a section
        meets; raises an error if the number is too large. It is also called with estimates that the
        number will probably exceed, so that a refusal comes before the work.
    """
    nets = surface_nets(model.batches)
    borders = find_border_lines(nets, seams, triangular_patches(model.batches))
    local = LocalPlanes.of(planes, nets)
    local_tolerance = max(TOLERANCE_FACTOR * tolerance / nets.scale, MIN_TOLERANCE)
    search = ArcSearch(nets, borders, local, local_tolerance, allow)
    sections: list[Section] = []
    for numbers, plane, net in list_chunks(search):
        sections += _cut(search, planes, numbers, plane, net)
    slack = max(bound_rounding(group.nets) for group in nets.groups)
    bound = (search.deviation + slack) * nets.scale
    return Sections(model.name, model.up, planes, tuple(sections), bound)


def list_chunks(search: ArcSearch) -> Iterator[tuple[range, Ints, Ints]]:
    """Planes in runs that are cut at once: their numbers, and the pairs (plane, net) that may meet.

    The planes are those of the search.
    """
    nets, local = search.nets, search.local
    boxes = find_boxes(nets)
    planes_at_once = max(1, CHUNK_PAIRS // len(nets.patch))
    max_coefficients = max(group.nets[0, ..., 0].size for group in nets.groups)
    for first in range(0, len(local.offsets), planes_at_once):
        last = min(first + planes_at_once, len(local.offsets))
        plane, net = find_pairs(boxes, local, first, last)
        counts = np.bincount(plane - first, minlength=last - first)
        search.begin(len(plane))
        for low, high in _split_planes(counts, CHUNK_NUMBERS // max_coefficients):
            checkpoint()
            rows = slice(*np.searchsorted(plane, [first + low, first + high]))
            yield range(first + low, first + high), plane[rows], net[rows]


def _split_planes(counts: Ints, max_pairs: int) -> Iterator[tuple[int, int]]:
    """Split planes into runs [first, last) that have together at most `max_pairs` pairs.

    `counts` has the number of pairs of each plane. A run has at least one plane.
    """
    first, totals = 0, np.cumsum(counts)
    while first < len(counts):
        most = totals[first] - counts[first] + max_pairs
        last = max(first + 1, int(np.searchsorted(totals, most, side="right")))
        yield first, last
        first = last


def _cut(
    search: ArcSearch, planes: Planes, numbers: range, plane: Ints, net: Ints
) -> list[Section]:
    """The sections by planes `numbers`; `plane` and `net` are all pairs that may meet."""
    cells, coplanar = search.find_cells(plane, net)
    coplanar[:, 1] = search.nets.patch[coplanar[:, 1]]
    coplanar_patches = np.unique(coplanar, axis=0)
    polylines: list[list[Polyline]] = [[] for _ in numbers]
    touching = np.zeros((0, 3))
    plane_of_point = np.zeros(0, np.intp)
    if cells is not None:
        found = search.find_nodes(cells)
        touching, plane_of_point = _draw(search, planes, found, numbers.start, polylines)
    return [
        Section(
            tuple(polylines[k - numbers.start]),
            touching[plane_of_point == k],
            coplanar_patches[coplanar_patches[:, 0] == k, 1],
        )
        for k in numbers
    ]


def _draw(
    search: ArcSearch,
    planes: Planes,
    found: ArcNodes,
    first: int,
    polylines: list[list[Polyline]],
) -> tuple[FloatArray, Ints]:
    """Add polylines to those of each plane; return touching points, and their planes.

    `polylines[k]` belongs to the plane with the number `first` + k.
    """
    points, plane, arcs = found.points, found.plane, found.arcs
    x, y = (axes[plane] for axes in planes.axes)
    positions_in_plane = np.stack([dot(points, x, -1), dot(points, y, -1)], axis=1)
    model_points = search.nets.origin + points * search.nets.scale
    checkpoint()
    touching = [arcs.touching]
    for nodes in join_arcs(arcs.ends, arcs.sense, positions_in_plane, search.tolerance):
        rows = model_points[nodes]
        rows = rows[is_change(*rows.T)]
        if len(rows) > 1:
            is_closed = bool(nodes[0] == nodes[-1])
            polylines[plane[nodes[0]] - first].append(Polyline(rows, is_closed))
        else:
            # All points are equal: a patch that is only a curve passes through the plane.
            touching.append(nodes[:1])
    arc_counts = np.bincount(arcs.ends.ravel(), minlength=len(points))
    crossings = np.flatnonzero(arc_counts > 2)
    separate = keep_separate(points, np.concatenate(touching), crossings)
    return model_points[separate], plane[separate]


def keep_separate(points: FloatArray, nodes: Ints, crossings: Ints) -> Ints:
    """The `nodes` that are not near a crossing, and not near an earlier node."""
    separate: list[int] = []
    crossing_points = points[crossings]
    for k in nodes.tolist():
        checkpoint()
        is_near = (
            np.abs(np.concatenate([crossing_points, points[separate]]) - points[k]).max(axis=1)
            <= MAX_DISTANCE
        )
        if not is_near.any():
            separate.append(k)
    return np.array(separate, np.intp)
