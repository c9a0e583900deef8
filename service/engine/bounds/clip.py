"""Parts of faces, cut at knot lines: pieces, each over one patch, that together cover each part.

Where an edge of a part crosses a knot line, it is cut at the nearest place; the coordinates of
places are integers (`service.engine.bounds.faces`, `service.engine.trims.places`). That place is
computed from the two ends of the edge, sorted by their coordinates, so it is the same for the two
parts that share the edge.

Proof in docs/proofs.md: "Pieces cover their parts".
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.vectors import Items

ON_EDGE = 2.0**-16
"""A place counts as on an edge of a part if it is nearer to this edge than this share of the height
of the part over the edge."""

THIN = 2.0**17
"""If a part is at least this high, in units of places, rounding is below the share `ON_EDGE`."""


@dataclass(frozen=True, eq=False, slots=True)
class Parts(Items):
    """m triangles of places, and the triangles of the mesh from which distances are measured.

    Attributes
    ----------
    face : ndarray of int, shape (m,)
    corners : ndarray of int, shape (3, 2, m)
        Places of the face. Neighbouring parts share complete edges.
    reference : ndarray of int, shape (3, m)
        The vertices of the reference triangle of each part: the triangle of the mesh from which
        distances are measured. If `is_own`, vertex k is the image of corner k.
    across : ndarray of int, shape (3, m)
        For edge (k, k + 1) of the reference triangle, the opposite vertex of the triangle beyond
        the edge; -1 if that triangle does not exist or is unknown.
    is_own : ndarray of bool, shape (m,)
        Whether the reference triangle is the image of the part, not another triangle.
    """

    face: Ints
    corners: Ints
    reference: Ints
    across: Ints
    is_own: Bools


class KnotLines(Protocol):
    """Faces with their knot lines among places: `Faces`, and `Places` of trimmed faces.

    Span (k, l) of face f is patch `first[f] + k stride[f] + l`.
    """

    @property
    def first(self) -> Ints:
        """The first patch (F,) of each face."""

    @property
    def stride(self) -> Ints:
        """The step (F,) from a patch to the next one along u."""

    def has_single_spans(self, face: Ints) -> bool:
        """Whether each of these faces (m,) is one patch."""

    def find_spans(self, face: Ints, axis: int, low: Ints, high: Ints) -> tuple[Ints, Ints]:
        """The first and the last span (m,) along an axis that intervals [low, high] touch."""

    def knots_at(self, face: Ints, axis: int, span: Ints) -> tuple[Ints, Ints]:
        """The knots (m,) at which spans begin and end; equal for a span that has no places."""


@dataclass(frozen=True, eq=False, slots=True)
class PatchPieces:
    """M triangles of parameters, each over one patch.

    Attributes
    ----------
    part : ndarray of int, shape (M,)
        The part of each piece, in ascending order.
    patch : ndarray of int, shape (M,)
    parameters : ndarray of float64, shape (3, 2, M)
        The corners, as parameters t of the patch, for which 1 − t is exact, too. Of `Faces` they
        are multiples of 1 / SPAN, exactly; else they are rounded to multiples of 2^-53.
    corners : ndarray of int, shape (3, 2, M)
        The corners as places of the face.
    """

    part: Ints
    patch: Ints
    parameters: FloatArray
    corners: Ints


def clip_parts(faces: KnotLines, face: Ints, corners: Ints) -> PatchPieces:
    """Cut parts, triangles of places, at the knot lines of their faces.

    Parameters
    ----------
    face : ndarray of int, shape (m,)
    corners : ndarray of int, shape (3, 2, m)
        Places of the faces.
    """
    part, pieces = np.arange(len(face)), corners
    spans = np.zeros((2, len(face)), dtype=np.intp)
    if not faces.has_single_spans(face):
        for axis in range(2):
            source, pieces, span = _cut_at_knots(faces, face[part], pieces, axis)
            part, spans = part[source], spans.take(source, axis=1)
            spans[axis] = span
        order = np.argsort(part, kind="stable")
        part, pieces, spans = part[order], pieces.take(order, axis=2), spans.take(order, axis=1)
    return locate_pieces(faces, face, part, pieces, spans)


def locate_pieces(
    faces: KnotLines, face: Ints, part: Ints, corners: Ints, spans: Ints
) -> PatchPieces:
    """Pieces with these corners (3, 2, M), each in one span (2, M) of the face of its part (M,)."""
    owner = face[part]
    patch = faces.first[owner] + spans[0] * faces.stride[owner] + spans[1]
    parameters = np.empty(corners.shape)
    for axis in range(2):
        begin, end = faces.knots_at(owner, axis, spans[axis])
        np.divide(corners[:, axis] - begin, end - begin, out=parameters[:, axis])
    # After this, 1 − t is exact; nothing changes for multiples of 2^-53.
    np.subtract(1.0, parameters, out=parameters)
    np.subtract(1.0, parameters, out=parameters)
    return PatchPieces(part, patch, parameters, corners)


def find_images(pieces: PatchPieces, corners: Ints) -> FloatArray:
    """Barycentric coordinates (3, 3, M) of the corners of pieces in their parts (3, 2, m).

    Axis 0 counts the corners of a piece, axis 1 the coordinates of a corner.

    A corner that was cut out of an edge lies on the edge, except for the rounding of its place. The
    images of the pieces must fill the image of the part. So each coordinate below `ON_EDGE` is set
    to 0. If a part is so thin that rounding may exceed this share, the coordinates are NaN; then
    the bound of the distance from the mesh is NaN too, and the part does not meet the goal.
    """
    images = np.repeat(np.eye(3)[..., np.newaxis], len(pieces.part), axis=2)
    if len(pieces.part) == corners.shape[2]:
        return images
    # The pieces of parts that were cut.
    cut = (np.bincount(pieces.part)[pieces.part] > 1).nonzero()[0]
    triangle = corners[..., pieces.part[cut]].astype(np.float64)
    # Coordinate k of a point is its height over the edge opposite corner k, divided by that of
    # corner k. Differences of places are exact, products nearly so.
    for k in range(3):
        begin, end = triangle[(k + 1) % 3], triangle[(k + 2) % 3]
        edge, to_corner = end - begin, triangle[k] - begin
        difference = pieces.corners[..., cut] - begin
        twice_area = edge[0] * to_corner[1] - edge[1] * to_corner[0]
        thin = np.abs(twice_area) < THIN * np.hypot(edge[0], edge[1])
        share = (edge[0] * difference[:, 1] - edge[1] * difference[:, 0]) / np.where(
            thin, np.nan, twice_area
        )
        images[:, k, cut] = np.where(share < ON_EDGE, 0.0, share)
    images[..., cut] /= images[:, :1, cut] + images[:, 1:2, cut] + images[:, 2:, cut]
    return images


def _cut_at_knots(
    faces: KnotLines, face: Ints, corners: Ints, axis: int
) -> tuple[Ints, Ints, Ints]:
    """Triangles (3, 2, m) of faces (m,) cut at the knot lines of one direction.

    Returns
    -------
    source : ndarray of int, shape (M,)
        The triangle that each piece was cut from.
    pieces : ndarray of int, shape (3, 2, M)
    span : ndarray of int, shape (M,)
        Number of the span of each piece, in that direction.
    """
    along = corners[:, axis]
    begin, last = faces.find_spans(face, axis, along.min(axis=0), along.max(axis=0))
    unsplit = (last == begin).nonzero()[0]
    several = (last > begin).nonzero()[0]
    if not len(several):
        return unsplit, corners.take(unsplit, axis=2), begin[unsplit]
    run, span = expand_runs((last - begin)[several] + 1, begin[several])
    low, high = faces.knots_at(face[several[run]], axis, span)
    if (low == high).any():
        has_places = (low < high).nonzero()[0]
        run, span, low, high = (values[has_places] for values in (run, span, low, high))
    source = several[run]
    rings = _slice_triangles(corners.take(several, axis=2), run, (low, high), axis)
    sources, pieces, spans = [unsplit], [corners.take(unsplit, axis=2)], [begin[unsplit]]
    # A polygon of five corners as three triangles at its corner 0.
    for k in (1, 2, 3):
        triangles = rings[[0, k, k + 1]]
        steps = triangles - triangles[[1, 2, 0]]
        # Only triangles with three different corners are kept.
        differs = steps != 0
        proper = (differs[:, 0] | differs[:, 1]).all(axis=0).nonzero()[0]
        sources.append(source[proper])
        pieces.append(triangles.take(proper, axis=2))
        spans.append(span[proper])
    return np.concatenate(sources), np.concatenate(pieces, axis=2), np.concatenate(spans)


def _slice_triangles(corners: Ints, source: Ints, knots: tuple[Ints, Ints], axis: int) -> Ints:
    """The intersections of triangles with spans: convex polygons (5, 2, M); corners may repeat.

    Polygon i is the triangle `source[i]`, where its coordinate `axis` is between the two `knots`,
    shape (M,) each.
    """
    # A, B, C: the corners (coordinate along the axis, other coordinate), sorted by the first, then
    # by the second.
    along, across = corners[:, axis], corners[:, 1 - axis]
    order = np.lexsort((across, along), axis=0)
    along = np.take_along_axis(along, order, axis=0).take(source, axis=1)
    across = np.take_along_axis(across, order, axis=0).take(source, axis=1)
    a, b, c = ((along[k], across[k]) for k in range(3))
    low, high = np.maximum(knots[0], a[0]), np.minimum(knots[1], c[0])
    # Where B is not inside the span, the third corner repeats the second.
    has_b = (low < b[0]) & (b[0] < high)
    at_low, at_high = _cross_chain(a, b, c, low), _cross_chain(a, b, c, high)
    ring = np.empty((5, 2, len(source)), dtype=corners.dtype)
    ring[:, axis] = low, low, np.where(has_b, b[0], low), high, high
    ring[:, 1 - axis] = (
        cross_edge(a, c, low),
        at_low,
        np.where(has_b, b[1], at_low),
        at_high,
        cross_edge(a, c, high),
    )
    return ring


def _cross_chain(
    a: tuple[Ints, Ints], b: tuple[Ints, Ints], c: tuple[Ints, Ints], at: Ints
) -> Ints:
    """The second coordinate where the line from A over B to C has the first coordinate `at`."""
    return np.where(at <= b[0], cross_edge(a, b, at), cross_edge(b, c, at))


def cross_edge(a: tuple[Ints, Ints], b: tuple[Ints, Ints], at: Ints) -> Ints:
    """The second coordinate, rounded, where an edge has the first coordinate `at`."""
    run = np.maximum(b[0] - a[0], 1)
    share = np.clip((at - a[0]) / run, 0.0, 1.0)
    between = a[1] + np.rint((b[1] - a[1]) * share).astype(a[1].dtype)
    return np.where(at == b[0], b[1], np.where(at == a[0], a[1], between))
