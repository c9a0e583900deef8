"""Segments of places, cut at the knot lines of their faces; triangles: `bounds.clip.clip_parts`.

Proof in docs/proofs.md: "Pieces cover their parts".
"""

import numpy as np

from service.bases.arrays import Ints
from service.bases.row_batches import expand_runs
from service.engine.bounds.clip import KnotLines, PatchPieces, cross_edge, locate_pieces


def clip_segments(faces: KnotLines, face: Ints, ends: Ints) -> PatchPieces:
    """Pieces of segments of places, as triangles whose last two corners are equal.

    A piece of a segment from A to B is a triangle a b b, where b is nearer to B, or to A if that
    has the greater coordinates.

    Parameters
    ----------
    face : ndarray of int, shape (m,)
    ends : ndarray of int, shape (2, 2, m)
        A and B; a segment with A = B is one piece.
    """
    part = np.arange(len(face))
    spans = np.zeros((2, len(face)), dtype=np.intp)
    if not faces.has_single_spans(face):
        for axis in range(2):
            source, ends, span = _cut_at_knots(faces, face[part], ends, axis)
            part, spans = part[source], spans.take(source, axis=1)
            spans[axis] = span
    return locate_pieces(faces, face, part, ends.take([0, 1, 1], axis=0), spans)


def _cut_at_knots(faces: KnotLines, face: Ints, ends: Ints, axis: int) -> tuple[Ints, Ints, Ints]:
    """Segments (2, 2, m) of faces (m,) cut at the knot lines of one direction.

    Returns
    -------
    source : ndarray of int, shape (M,)
        The segment that each piece was cut from, in ascending order.
    pieces : ndarray of int, shape (2, 2, M)
    span : ndarray of int, shape (M,)
        Number of the span of each piece, in that direction.
    """
    along = ends[:, axis]
    begin, last = faces.find_spans(face, axis, along.min(axis=0), along.max(axis=0))
    source, span = expand_runs(last - begin + 1, begin)
    if len(source) == len(begin):
        return source, ends, begin
    low, high = faces.knots_at(face[source], axis, span)
    if (low == high).any():
        has_places = (low < high).nonzero()[0]
        source, span, low, high = (values[has_places] for values in (source, span, low, high))
    # A and B: the ends (coordinate along the axis, other coordinate), sorted by the first.
    along, across = ends[:, axis].take(source, axis=1), ends[:, 1 - axis].take(source, axis=1)
    order = np.argsort(along, axis=0, kind="stable")
    along, across = (np.take_along_axis(values, order, axis=0) for values in (along, across))
    a, b = ((along[k], across[k]) for k in range(2))
    low, high = np.maximum(low, a[0]), np.minimum(high, b[0])
    pieces = np.empty((2, 2, len(source)), dtype=ends.dtype)
    pieces[:, axis] = low, high
    pieces[:, 1 - axis] = cross_edge(a, b, low), cross_edge(a, b, high)
    # A segment along a knot line stays as it is: both its ends have one coordinate along the axis.
    is_along = (along[0] == along[1]).nonzero()[0]
    pieces[:, :, is_along] = ends[:, :, source[is_along]]
    return source, pieces, span
