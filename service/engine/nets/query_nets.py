"""The patches of a model as tensor-product nets, relative to a local origin and scaled.

Every query works on tensor-product Bézier nets over [0, 1]² whose coordinates are about 1:

    net = (P − origin) / scale,   scale a power of two, so that dividing is exact

A rational net is homogeneous: (w x, w y, w z, w). A triangular patch (up to degree
`MAX_SPLIT_DEGREE`) becomes three nets without a singular point, one for the quadrilateral at each
corner between the middles of two sides and the centroid. A curve is a net of degree (n, 0).

Proof in docs/proofs.md: "Quadrilaterals of a triangle".

References
----------
DeRose, Goldman, Hagen and Mann, Functional composition algorithms via blossoming, ACM Transactions
on Graphics 12 (1993).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from math import frexp, ldexp

import numpy as np

from service.bases import triangle
from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.nets.nets import Nets, build_tensor_nets, group_nets, split_by_group
from service.surface.batches import Patches, TrianglePatches
from service.surface.curve_model import CurvePieces, to_space
from service.surface.placement import Box, join_boxes

_A, _B, _C = np.eye(3)
_CENTROID = (_A + _B + _C) / 3
_QUADRILATERALS = tuple(
    np.stack([corner, (corner + right) / 2, (corner + left) / 2, _CENTROID])
    for corner, right, left in ((_A, _B, _C), (_B, _C, _A), (_C, _A, _B))
)
"""For each quadrilateral, the barycentric coordinates (r, s, t) of its corners at (a, b) = (0, 0),
(1, 0), (0, 1) and (1, 1)."""

_CHOICES = ((0, 0), (1, 0), (0, 1), (1, 1))
"""The values (α, β) of the sum in docs/proofs, "Quadrilaterals of a triangle"."""


MAX_EXPONENT = 200
"""Points farther than 2^MAX_EXPONENT from the origin, in the coordinates of the nets, are moved
towards the origin, because products of three of their coordinates must be finite."""


@dataclass(frozen=True, eq=False, slots=True)
class LocalPoints:
    """Points in the coordinates of the nets; very far points are moved towards the origin.

    Let E be `MAX_EXPONENT`. A very far point 2^k x is moved to x, with k > 0 such that 2^(E - 1) <=
    |x|∞ <= 2^E. All points p of the nets are nearer to the origin than 1. So |x − p| 2^k differs
    from the distance |2^k x − p| by a relative error below 2^(3 - E).

    Attributes
    ----------
    points : ndarray of float64, shape (m, 3)
    shift : ndarray of int, shape (m,)
        The exponents k; 0 for points that were not moved.
    scale : float
        As in `QueryNets`.
    """

    points: FloatArray
    shift: Ints
    scale: float

    def model_lengths(self, distances: FloatArray) -> FloatArray:
        """Convert distances (m,) of these points to model units.

        If a point was moved, its distance is not exact, but nearly so.
        """
        # frexp(scale)[1] − 1 is the exponent of `scale`, a power of two.
        exponent = self.shift + (frexp(self.scale)[1] - 1)
        return np.asarray(np.ldexp(distances, exponent))


@dataclass(frozen=True, eq=False, slots=True)
class QueryNets:
    """The N nets of a model.

    Attributes
    ----------
    groups : tuple of Nets
        Homogeneous nets have the weights of the surface.
    origin : ndarray of float64, shape (3,)
    scale : float
        Model coordinates are origin + scale · (coordinates of the nets).
    patch : ndarray of int, shape (N,)
        For each net, the number of its patch in the model.
    corners : ndarray of float64, shape (N, 4, 2)
        For each net, the parameters (u, v) of its patch at (a, b) = (0, 0), (1, 0), (0, 1), (1, 1).
    diagonal : float
        Diagonal of the box of all control points, in model units.
    errors : ndarray of float64, shape (N,), or None
        How far each net may be from its surface or curve, in the coordinates of the nets; None if
        all are exact.
    """

    groups: tuple[Nets, ...]
    origin: FloatArray
    scale: float
    patch: Ints
    corners: FloatArray
    diagonal: float
    errors: FloatArray | None = None

    @property
    def is_curve(self) -> Bools:
        """Which nets (N,) have the degree (n, 0)."""
        sizes = [len(group.patches) for group in self.groups]
        return np.repeat([group.degree[1] == 0 for group in self.groups], sizes)

    def split(self, net: Ints) -> Iterator[tuple[Nets, Ints]]:
        """The groups that have some of the nets (m,), each with their indices in `net`."""
        firsts = [group.first for group in self.groups]
        return split_by_group(self.groups, np.searchsorted(firsts, net, side="right") - 1)

    def local(self, points: FloatArray) -> FloatArray:
        """Convert points (m, 3) from model coordinates to the coordinates of the nets."""
        return np.asarray((points - self.origin) / self.scale)

    def to_near_points(self, points: FloatArray) -> LocalPoints:
        """Convert points (m, 3) as `local` does; very far points are moved towards the origin."""
        exponent = frexp(self.scale)[1] - 1  # of `scale`, a power of two
        difference = points - self.origin
        shift = np.maximum(np.frexp(np.abs(difference).max(axis=1))[1] - exponent - MAX_EXPONENT, 0)
        moved_points = np.ldexp(difference, -(shift + exponent)[:, np.newaxis])
        return LocalPoints(np.asarray(moved_points), shift, self.scale)

    def parameters(self, net: Ints, net_parameters: FloatArray) -> FloatArray:
        """Convert parameters (m, 2) of nets to parameters (m, 2) of their patches.

        On a tensor-product patch both are equal, bit for bit.
        """
        a, b = net_parameters.T[:, :, np.newaxis]
        # c10 is the corner at a = 1, b = 0, and so on.
        c00, c10, c01, c11 = self.corners[net].transpose(1, 0, 2)
        # Both sums are exact if the corners are those of the unit square.
        at_b_0 = c00 + a * (c10 - c00)
        parameters = at_b_0 + b * (c01 - c00) + a * b * (c11 - c10 - c01 + c00)
        return np.asarray(np.clip(parameters, 0.0, 1.0))


UNIT_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
"""`corners` of a net that is a whole tensor-product patch."""

COLLAPSED_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
"""`corners` of a net that is a whole triangle."""

MAX_SPLIT_DEGREE = 16
"""The highest degree at which triangles become three quadrilaterals, because the time for this
grows with the fifth power of the degree. At higher degrees, a triangle is one net whose side b = 1
is a point."""


def surface_nets(batches: Sequence[Patches], box: Box | None = None) -> QueryNets:
    """The nets of batches of patches; each group has one degree, with or without weights.

    Their frame is that of a box, or of the box about all control points.
    """
    low, high = join_boxes(batch.bounds for batch in batches) if box is None else box
    origin, scale, diagonal = frame(low, high)
    parts: list[tuple[Ints, FloatArray]] = []
    corners_by_shape: dict[tuple[int, ...], list[FloatArray]] = {}
    first = 0
    for batch in batches:
        points = to_homogeneous((batch.points - origin) / scale, batch.weights)
        numbers = np.arange(first, first + batch.count)
        first += batch.count
        corners = np.broadcast_to(UNIT_CORNERS, (batch.count, 4, 2))
        if not isinstance(batch, TrianglePatches):
            values = points.transpose(1, 2, 3, 0)
        elif batch.degree > MAX_SPLIT_DEGREE:
            values = build_tensor_nets(points.transpose(1, 2, 0))
            corners = np.broadcast_to(COLLAPSED_CORNERS, (batch.count, 4, 2))
        else:
            values = _build_quadrilateral_nets(points, batch.degree)
            numbers = np.tile(numbers, 3)
            # The parameters on a triangle are (s, t), without r.
            corners = np.repeat([quad[:, 1:] for quad in _QUADRILATERALS], batch.count, axis=0)
        parts.append((numbers, values))
        corners_by_shape.setdefault(values.shape[:3], []).append(corners)
    groups = group_nets(parts)
    patch = np.concatenate([group.patches for group in groups])
    corners_of_nets = np.concatenate([*chain(*corners_by_shape.values())])
    return QueryNets(groups, origin, scale, patch, corners_of_nets, diagonal)


def curve_nets(pieces: CurvePieces) -> QueryNets:
    """The nets of the pieces of a curve, of degree (n, 0), with the parameters (t, 0)."""
    points = to_space(pieces.points)
    flat = points.reshape(-1, 3)
    origin, scale, diagonal = frame(flat.min(axis=0), flat.max(axis=0))
    nets = to_homogeneous((points - origin) / scale, pieces.weights)
    values = nets.transpose(1, 2, 0)[:, np.newaxis]
    corners = np.broadcast_to(UNIT_CORNERS, (pieces.count, 4, 2))
    groups = group_nets([(np.arange(pieces.count), values)])
    return QueryNets(groups, origin, scale, groups[0].patches, corners, diagonal)


def frame(low: FloatArray, high: FloatArray) -> tuple[FloatArray, float, float]:
    """The middle of a box, the least power of two above its longest side, and its diagonal.

    The power is 1 if the box is a point.
    """
    sides = high - low
    longest = float(sides.max())
    scale = ldexp(1.0, frexp(longest)[1]) if longest > 0 else 1.0
    return low + sides / 2, scale, scale * float(np.linalg.norm(sides / scale))


def _build_quadrilateral_nets(nets: FloatArray, degree: int) -> FloatArray:
    """Tensor-product nets of the three quadrilaterals of each triangle.

    `nets` are triangular nets (K, points, D) of degree n; the result has shape (n+1, n+1, D, 3 K).
    """
    results = []
    for corners in _QUADRILATERALS:
        # G_m: shape (m+1, m+1, K, points of degree n − m, D).
        g = nets[np.newaxis, np.newaxis]
        for m in range(degree):
            # De Casteljau's algorithm combines each point of the net (but the last of a row) with
            # the next point and with the point `above`, in the next row.
            starts = triangle.row_starts(degree - m)
            first_points = np.delete(np.arange(starts[-1]), starts[1:] - 1)
            row = np.searchsorted(starts, first_points, side="right") - 1
            above = first_points + (degree - m + 1) - row
            # c_i1 for i = 1 … m + 1, and c_i0 for i = 0 … m.
            rising = np.arange(1, m + 2) / (m + 1)
            falling = rising[::-1]
            next_g = np.zeros((m + 2, m + 2, len(nets), len(first_points), nets.shape[-1]))
            for (r, s, t), (alpha, beta) in zip(corners, _CHOICES, strict=True):
                value = r * g[:, :, :, first_points] + s * g[:, :, :, first_points + 1]
                value += t * g[:, :, :, above]
                value *= (rising if alpha else falling)[:, None, None, None, None]
                value *= (rising if beta else falling)[:, None, None, None]
                next_g[alpha : alpha + m + 1, beta : beta + m + 1] += value
            g = next_g
        results.append(g[:, :, :, 0].transpose(0, 1, 3, 2))
    return np.concatenate(results, axis=3)
