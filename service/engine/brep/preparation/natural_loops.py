"""Faces without loops: their whole surfaces, with natural borders, seams and poles.

The sides of the domain are, in the order of the loop: v least (along +u), u greatest (along +v), v
greatest and u least, both against their edges. A side that is a point is a degenerate edge.
Opposite sides of a closed surface share one edge, a seam.
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.brep.preparation.topology import ADDED, SEAM, Topology
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.composition import compose_curves
from service.engine.trims.piecewise import make_segments

CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
"""The ends of the domain along u and v at the corners; side k runs from corner k to the next."""

BEGINS, ENDS = np.array([0, 1, 3, 0]), np.array([1, 2, 2, 3])
"""The corners at which the edges of the sides begin and end: along +u or +v."""

SIDES = ((1, 0), (0, 1), (1, 1), (0, 0))
"""Axis and end of each side, as in `ClosedSurfaces.is_pole`."""


def add_natural_loops(
    surfaces: ClosedSurfaces, topology: Topology, face: Ints, low: FloatArray, uncertainty: float
) -> Topology:
    """Loops about the whole surfaces of faces (k,), after all others.

    Parameters
    ----------
    low : ndarray of float64, shape (k, 2)
        The least parameters of the loops: those of the domains, or others along closed axes.
    uncertainty : float
        Of the new edges and vertices. Model units.
    """
    count = len(face)
    corners = low[:, np.newaxis] + CORNERS * surfaces.period[face][:, np.newaxis]
    is_closed = surfaces.is_closed[face]
    is_pole = np.stack([surfaces.is_pole[face, a, e] for a, e in SIDES], axis=1)
    # Corners that are one point: at poles, and across closed axes.
    label = np.tile(np.arange(4), (count, 1))
    pairs = [(k, (k + 1) % 4, is_pole[:, k]) for k in range(4)]
    pairs += [(0, 1, is_closed[:, 0]), (3, 2, is_closed[:, 0])]
    pairs += [(0, 3, is_closed[:, 1]), (1, 2, is_closed[:, 1])]
    for _ in range(3):
        for a, b, same in pairs:
            least = np.minimum(label[:, a], label[:, b])
            label[:, a], label[:, b] = (np.where(same, least, label[:, k]) for k in (a, b))
    is_vertex = label == np.arange(4)
    run, corner = is_vertex.nonzero()
    points = surfaces.evaluate(face[run], corners[run, corner])
    topology, numbers = topology.add_vertices(points, uncertainty)
    vertex = np.zeros((count, 4), np.intp)
    vertex[is_vertex] = numbers
    vertex = np.take_along_axis(vertex, label, axis=1)
    # Which sides have an edge of their own: the last of two that share one does not.
    shares = np.zeros((count, 4), bool)
    shares[:, 2], shares[:, 3] = is_closed[:, 1] & ~is_pole[:, 2], is_closed[:, 0] & ~is_pole[:, 3]
    edge = np.full((count, 4), -1)
    starts, stops = corners[:, BEGINS], corners[:, ENDS]
    seam = np.zeros((count, 4), bool)
    seam[:, [0, 2]], seam[:, [1, 3]] = is_closed[:, 1:], is_closed[:, :1]
    for chosen, source in (
        (is_pole, ADDED),
        (~is_pole & ~shares & seam, SEAM),
        (~is_pole & ~shares & ~seam, ADDED),
    ):
        run, side = chosen.nonzero()
        if not len(run):
            continue
        curves = None
        if chosen is not is_pole:
            ranges = np.tile([0.0, 1.0], (len(run), 1))
            lines = make_segments(starts[run, side], stops[run, side], ranges)
            curves = compose_curves(surfaces, face[run], lines, uncertainty)
        ends = np.stack([vertex[run, BEGINS[side]], vertex[run, ENDS[side]]], axis=1)
        topology, edge[run, side] = topology.add_edges(ends, curves, source, uncertainty)
    edge[:, 2] = np.where(shares[:, 2], edge[:, 0], edge[:, 2])
    edge[:, 3] = np.where(shares[:, 3], edge[:, 1], edge[:, 3])
    first = len(topology.coedge_edges)
    is_reversed = np.tile([False, False, True, True], count)
    ranges = np.tile([0.0, 1.0], (4 * count, 1))
    lines = make_segments(starts.reshape(-1, 2), stops.reshape(-1, 2), ranges)
    topology = topology.add_coedges(edge.ravel(), is_reversed, lines)
    coedges = np.concatenate([np.arange(first), first + np.arange(4 * count)])
    loop_faces = np.concatenate([topology.loop_faces, face])
    loop_counts = np.concatenate([topology.loop_counts, np.full(count, 4)])
    sources = np.concatenate([topology.loop_sources, np.full(count, -1)])
    return topology.take_coedges(coedges, loop_faces, loop_counts, sources).sort_loops()
