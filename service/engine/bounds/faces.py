"""Faces: rectangles of patches that are divided as one surface, across their knot lines."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.connectivity.seams import Seams
from service.engine.vectors import Items
from service.surface.lowered import Domain, PatchModel
from service.surface.sides import along_sides

DEPTH = 30
"""A knot span is 2^DEPTH units long; places are integers, so the least length is 1."""

SPAN = 1 << DEPTH
"""Length of a knot span in units of places."""


@dataclass(frozen=True, eq=False, slots=True)
class Faces(Items):
    """F faces. Span (k, l) of face f is patch `first[f] + k stride[f] + l` of the model.

    A place of a face is a pair of whole numbers (u, v), 0 ≤ u ≤ n_u SPAN, 0 ≤ v ≤ n_v SPAN:
    u // SPAN is the span and u % SPAN / SPAN the patch's own parameter. Triangular patches are
    faces of one span, as tensor patches of which the side v = 1 is one point.

    Attributes
    ----------
    first, stride : ndarray of int, shape (F,)
    spans : ndarray of int, shape (2, F)
        n_u and n_v.
    """

    first: Ints
    stride: Ints
    spans: Ints

    def has_single_spans(self, face: Ints) -> bool:
        """Whether each of these faces (m,) is one patch."""
        return int(self.spans.take(face, axis=1).max(initial=1)) == 1

    def find_spans(self, face: Ints, axis: int, low: Ints, high: Ints) -> tuple[Ints, Ints]:
        """The first and the last span (m,) along an axis that intervals [low, high] touch.

        `low` and `high` (m,) are places. A knot belongs to the span after it as `low`, and to the
        span before it as `high`.
        """
        begin = np.minimum(low // SPAN, self.spans[axis].take(face) - 1)
        return begin, np.maximum(-(-high // SPAN) - 1, begin)

    def knots_at(self, face: Ints, axis: int, span: Ints) -> tuple[Ints, Ints]:
        """The knots (m,) at which spans begin and end."""
        del face, axis  # all spans have one length
        begin = span * SPAN
        return begin, begin + SPAN

    def list_sides(self) -> tuple[Ints, Ints, Ints]:
        """First patch, step from patch to patch, and number of patches along each side: (F, 4)."""
        rows, columns = self.spans
        near, far = self.first, self.first + (rows - 1) * self.stride
        begin = np.array([near, far, near, near + columns - 1]).T
        step = np.array(along_sides(self.stride, np.ones_like(rows))).T
        return begin, step, np.array(along_sides(rows, columns)).T


def find_faces(model: PatchModel, seams: Seams) -> Faces:
    """The faces of a model: few large ones for each parametric surface, one for each other patch.

    A face ends at a knot line if an edge on the line is a point, or if patches other than the two
    beside it have this edge too, because the surface touches itself. A face also ends where its
    side changes from a line to a point. So either all edges of a side are points, or none is.
    """
    divided = [domain for domain in model.domains if domain.patch_count > 1]
    is_single = np.ones(model.patch_count, bool)
    for domain in divided:
        is_single[domain.first : domain.first + domain.patch_count] = False
    single = is_single.nonzero()[0]
    ones = np.ones((2, len(single)), dtype=np.intp)
    parts = [Faces(single, ones[0], ones), *(_split_domain(domain, seams) for domain in divided)]
    faces = Faces.join(parts)
    return faces.take(faces.first.argsort())


def _split_domain(domain: Domain, seams: Seams) -> Faces:
    """The faces of one parametric surface."""
    columns = len(domain.v) - 1
    patches = slice(domain.first, domain.first + domain.patch_count)
    edge, backward, collapsed = (
        values[patches].reshape(-1, columns, 4)
        for values in (seams.edge, seams.backward, seams.collapsed)
    )
    # Edges of just two sides that are not points; then, whether patches (k, l) and (k+1, l), or
    # (k, l) and (k, l+1), are joined across the edge between them.
    inner = (seams.sides_per_edge[edge] == 2) & ~collapsed
    joined_u = inner[1:, :, 0] & (edge[:-1, :, 1] == edge[1:, :, 0])
    joined_u &= backward[:-1, :, 1] == backward[1:, :, 0]
    joined_u &= (collapsed[:-1, :, 2:] == collapsed[1:, :, 2:]).all(axis=2)
    joined_v = inner[:, 1:, 2] & (edge[:, :-1, 3] == edge[:, 1:, 2])
    joined_v &= backward[:, :-1, 3] == backward[:, 1:, 2]
    joined_v &= (collapsed[:, :-1, :2] == collapsed[:, 1:, :2]).all(axis=2)
    u, v = _find_ends(joined_u.all(axis=1)), _find_ends(joined_v.all(axis=0))
    first = domain.first + u[:-1, None] * columns + v[:-1]
    spans = np.meshgrid(np.diff(u), np.diff(v), indexing="ij")
    return Faces(
        first.ravel(), np.full(first.size, columns), np.array(spans).reshape(2, first.size)
    )


def _find_ends(is_crossed: Bools) -> Ints:
    """Numbers of the knot lines at which faces begin or end, including both borders.

    `is_crossed` marks the inner knot lines inside a face.
    """
    ends = (~is_crossed).nonzero()[0] + 1
    return np.concatenate([[0], ends, [len(is_crossed) + 1]]).astype(np.intp)
