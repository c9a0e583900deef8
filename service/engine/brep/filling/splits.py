"""Edges of failing triangles are halved, in the triangles on both sides.

An edge is cut at the middle one of the knot lines that it crosses, where the surface is the least
smooth, else in its middle. A triangle with one, two or three cut edges becomes two, three or four
triangles; a failing triangle with no edge that can be cut gets a corner in its middle.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.borders.predicates import orient
from service.engine.brep.filling.corners import FaceCorners
from service.engine.brep.filling.triangles import Mates, Triangles
from service.engine.trims.places import Places
from service.engine.vectors import NEXT, length

END = 1 / 16
"""A knot line nearer to an end of an edge than this share of its length is no place for a cut."""

ATTEMPTS = 6
"""How often cuts are given up that would turn a triangle over."""


def find_cuts(surface: Places, faces: Ints, begins: Ints, ends: Ints) -> tuple[Ints, FloatArray]:
    """Where edges between places (m, 2) are cut: places (m, 2), and the shares (m,) of the edges.

    The result does not depend on the triangle if `begins` has the lesser corner of each edge.
    """
    cuts, shares = (begins + ends) // 2, np.full(len(faces), 0.5)
    if int(surface.faces.spans.max(initial=1)) == 1:
        return cuts, shares
    most = np.zeros(len(faces), np.intp)
    low, high = np.minimum(begins, ends), np.maximum(begins, ends)
    for axis in (0, 1):
        first, last = surface.find_spans(faces, axis, low[:, axis], high[:, axis])
        rows = (last - first > most).nonzero()[0]
        if not len(rows):
            continue
        knots = surface.knots_at(faces[rows], axis, (first + last)[rows] // 2)[1]
        begin, along = begins[rows], (ends - begins)[rows]
        share = (knots - begin[:, axis]) / along[:, axis]
        good = (share > END) & (share < 1 - END)
        rows, knots, share = rows[good], knots[good], share[good]
        begin, along = begin[good], along[good]
        most[rows], shares[rows], cuts[rows, axis] = (last - first)[rows], share, knots
        across = np.rint(share * along[:, 1 - axis]).astype(np.intp)
        cuts[rows, 1 - axis] = begin[:, 1 - axis] + across
    return cuts, shares


def measure_edges(corners: FaceCorners, triangles: Ints) -> tuple[Ints, FloatArray]:
    """Cuts (3, m, 2) of the edges of triangles (3, m), and sampled deviations (3, m) of edges.

    The deviation is that of the surface at ¼, ¾ and the cut from the points of the edge there.
    """
    low = np.minimum(triangles, triangles[NEXT]).ravel()
    high = np.maximum(triangles, triangles[NEXT]).ravel()
    faces = corners.faces[low]
    begins, ends = corners.places[low], corners.places[high]
    cuts, shares = find_cuts(corners.surface, faces, begins, ends)
    places = np.concatenate([cuts, (3 * begins + ends) // 4, (begins + 3 * ends) // 4])
    ways = np.array([shares, np.full(len(shares), 0.25), np.full(len(shares), 0.75)])
    begin = corners.positions[corners.points[low]]
    along = corners.positions[corners.points[high]] - begin
    surface = corners.surface.evaluate(np.tile(faces, 3), places).reshape(3, -1, 3)
    deviations = length(surface - begin - ways[..., np.newaxis] * along, -1).max(axis=0)
    return cuts.reshape(3, -1, 2), deviations.reshape(3, -1)


def choose_edges(
    corners: FaceCorners, triangles: Triangles, mates: Mates, rows: Ints
) -> tuple[Ints, Ints]:
    """The edges to be cut of failing triangles; and the triangles that have no such edge.

    All edges are cut that are further from the surface than allowed, or else the furthest one; if
    none is off the surface, the longest one.
    """
    own = triangles.corners.take(rows, axis=1)
    cuts, deviations = measure_edges(corners, own)
    vertices, places = corners.positions[corners.points[own]], corners.places[own]
    lengths = length(vertices[NEXT] - vertices, -1)
    can: Bools = ~corners.find_fixed(own)
    can &= (cuts != places).any(axis=2) & (cuts != places[NEXT]).any(axis=2)
    deviations = np.where(can, deviations, -1.0)
    furthest, longest = deviations.argmax(axis=0), np.where(can, lengths, -1.0).argmax(axis=0)
    chosen: Bools = can & (deviations > triangles.allowed[rows])
    has_choice = np.any(can, axis=0)
    columns = has_choice.nonzero()[0]
    first = np.where(deviations.max(axis=0) > 0, furthest, longest)[columns]
    chosen[first, columns] = True
    edge, column = chosen.nonzero()
    edges = edge * len(triangles) + rows[column]
    return join_mates(mates, edges), rows[~has_choice]


def join_mates(mates: Mates, edges: Ints) -> Ints:
    """Edges, each once, by the lesser of its two numbers; ascending."""
    other = mates.edges[edges]
    lesser: Ints = np.unique(np.where(other >= 0, np.minimum(edges, other), edges))
    return lesser


def cut_edges(
    corners: FaceCorners, triangles: Triangles, mates: Mates, edges: Ints
) -> tuple[Bools, Ints]:
    """Cut edges (`join_mates`) in their triangles, and add corners at the cuts.

    Edges whose cut would turn a triangle over stay as they are.

    Returns
    -------
    removed : ndarray of bool, shape (T,)
        The triangles that have been divided.
    added : ndarray of int, shape (3, n)
        The corners of the triangles in place of them.
    """
    count = len(triangles)
    removed = np.zeros(count, bool)
    for _ in range(ATTEMPTS):
        if not len(edges):
            break
        triangle, edge = edges % count, edges // count
        ends = triangles.corners[edge, triangle], triangles.corners[NEXT[edge], triangle]
        low, high = np.minimum(*ends), np.maximum(*ends)
        faces = corners.faces[low]
        cuts, _ = find_cuts(corners.surface, faces, corners.places[low], corners.places[high])
        # For each edge of a triangle the number of its cut, or −1.
        numbers = np.full(3 * count, -1)
        numbers[edges] = np.arange(len(edges))
        other = mates.edges[edges]
        numbers[other[other >= 0]] = (other >= 0).nonzero()[0]
        cut = numbers.reshape(3, count)
        divided = np.any(cut >= 0, axis=0).nonzero()[0]
        places = np.concatenate([corners.places, cuts])
        added, source = _divide(
            triangles.corners.take(divided, axis=1),
            cut.take(divided, axis=1),
            places,
            corners.scales[corners.faces[triangles.corners[0, divided]]],
        )
        new = places[added]
        turned = orient(new[0], new[1], new[2]) <= 0
        if not turned.any():
            removed[divided] = True
            corners.add(faces, cuts)
            return removed, added
        drop = cut[:, divided[source[turned]]].ravel()
        edges = np.delete(edges, np.unique(drop[drop >= 0]))
    return removed, np.empty((3, 0), np.intp)


def add_middles(corners: FaceCorners, triangles: Triangles, rows: Ints) -> tuple[Bools, Ints]:
    """Divide triangles (m,) at their middles; `removed` and `added` are those of `cut_edges`."""
    own = triangles.corners.take(rows, axis=1)
    places = corners.places[own]
    middles = places.sum(axis=0) // 3
    good = (orient(places, places[NEXT], middles) > 0).all(axis=0)
    rows, own, middles = rows[good], own[:, good], middles[good]
    number = len(corners.places) + np.arange(len(rows))
    corners.add(corners.faces[own[0]], middles)
    removed = np.zeros(len(triangles), bool)
    removed[rows] = True
    parts = [np.array([own[k], own[NEXT[k]], number]) for k in range(3)]
    return removed, np.concatenate(parts, axis=1)


def _divide(own: Ints, cut: Ints, places: Ints, scales: FloatArray) -> tuple[Ints, Ints]:
    """Triangles (3, m) divided at the cuts of their edges: new ones (3, n) and their sources (n,).

    `cut` (3, m) are numbers of cuts or −1; cut i is corner `len(places) − cuts + i`.
    """
    has = cut >= 0
    number = has.sum(axis=0)
    # The first corner: that of the only cut edge; or that after the only edge that is not cut.
    first = np.where(
        number == 1, has.argmax(axis=0), np.where(number == 2, (~has).argmax(axis=0) + 1, 0)
    )
    order = (first + np.arange(3)[:, np.newaxis]) % 3
    a, b, c = np.take_along_axis(own, order, axis=0)
    base = len(places) - int(cut.max(initial=-1)) - 1
    ab, bc, ca = base + np.take_along_axis(cut, order, axis=0)
    added: list[Ints] = []
    sources: list[Ints] = []

    def put(rows: Ints, *corners: Ints) -> None:
        added.append(np.stack(corners)[:, rows])
        sources.append(rows)

    one, two, three = ((number == k).nonzero()[0] for k in (1, 2, 3))
    put(one, a, ab, c)
    put(one, ab, b, c)
    if len(two):
        put(two, ab, b, bc)
        # The quadrangle a, ab, bc, c is divided by its shorter diagonal.
        stretch = np.stack([np.ones(len(two)), scales[two]], axis=1)
        across = (places[bc[two]] - places[a[two]]) * stretch
        other = (places[c[two]] - places[ab[two]]) * stretch
        from_a = np.square(across).sum(axis=1) < np.square(other).sum(axis=1)
        put(two[from_a], a, ab, bc)
        put(two[from_a], a, bc, c)
        put(two[~from_a], a, ab, c)
        put(two[~from_a], ab, bc, c)
    if len(three):
        put(three, a, ab, ca)
        put(three, ab, b, bc)
        put(three, ca, bc, c)
        put(three, ab, bc, ca)
    return np.concatenate(added, axis=1), np.concatenate(sources)
