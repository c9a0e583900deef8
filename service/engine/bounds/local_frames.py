"""Nets and bounds of pieces of a surface, in the frames of their reference triangles.

Each piece has a unit of length: a power of two for which no coordinate of a control point or of a
vertex, relative to the middle of the patch, is above 1. Division by a power of two is exact, and
with this unit squares neither overflow nor underflow.

Proof in docs/proofs.md: "Rounding of the certificate".
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.triangle import degree_of
from service.engine.bounds.degree_reduction import reduce_boxes
from service.engine.bounds.distance import bound_distances, bound_heights
from service.engine.bounds.goal import bound_storage_error, count_roundings
from service.engine.bounds.reference_triangles import ReferenceTriangles, build_reference_triangles
from service.engine.nets.blossoms import build_triangle_nets, list_exponents
from service.engine.nets.nets import Nets
from service.engine.nets.patch_nets import PatchNets
from service.engine.vectors import UNIT, length, project

FAR = 2.0**300
"""Largest coordinate relative to the middle of the patch, in units of the piece. A triangle across
an edge of the reference triangle is ignored if its opposite vertex has a larger one; an eye with a
larger one is moved nearer."""

DOUBTFUL = 1 / 8
"""If more than this share of a bound comes from reducing degrees, the full net is bounded too."""


@dataclass(frozen=True, eq=False, slots=True)
class LocalNets:
    """Nets of m pieces over triangles of parameters, in local frames and units.

    Attributes
    ----------
    net : ndarray of float64, shape (m, D, N)
        Triangular nets of the pieces, or nets of lower degree that are near the pieces: N points of
        D = 3 coordinates, or D = 4 with weights.
    gap : ndarray of float64, shape (m,), or 0
        Bounds of the distances from the surfaces of these nets to the pieces.
    deviation : ndarray of float64, shape (m,)
        Bounds of the distances from the surface to the reference triangles and their neighbours.
    """

    net: FloatArray
    gap: FloatArray | float
    deviation: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class LocalFrames:
    """The frames and units of m pieces over patches of one degree.

    Attributes
    ----------
    triangles : ReferenceTriangles
    middle : ndarray of float64, shape (3, m)
        Middles of the patches, in model coordinates.
    unit : ndarray of float64, shape (m,)
        One local unit, in model units.
    slack : ndarray of float64, shape (m,)
        Bounds of the errors of stored vertices and of lowering (`PatchNets.lowering`), in model
        units.
    rounding : float
        Bound of the rounding of a point, and of distances, in local units.
    ordered : bool
        Whether the corners of each net must be in the order of the corners of its piece, as
        `bound_reverse_distances` needs; otherwise `build_triangle_nets` is faster.
    """

    triangles: ReferenceTriangles
    middle: FloatArray
    unit: FloatArray
    slack: FloatArray
    rounding: float
    ordered: bool

    def build_nets(self, nets: FloatArray, parameters: FloatArray) -> LocalNets:
        """The nets of pieces, with bounds of their deviations.

        `nets` (m, D, p+1, q+1) are those of the patches of the pieces, in model units; `parameters`
        (3, 2, m) are the corners of the pieces, as parameters of the patches.
        """
        framed = self.triangles.to_frames(nets, 1.0 / self.unit)
        net = build_triangle_nets(framed, parameters, ordered=self.ordered)
        return LocalNets(net, 0.0, self._bound_deviation(net))

    def build_reduced_nets(
        self, nets: FloatArray, patch: Ints, sizes: FloatArray, parameters: FloatArray
    ) -> LocalNets:
        """Nets near pieces of patches of high degree, with bounds of the deviations of the pieces.

        Parameters
        ----------
        nets : ndarray of float64, shape (P, D, p+1, q+1)
            Nets of different patches, in model units.
        patch : ndarray of int, shape (m,)
            The row in `nets` of the patch of each piece; pieces are in the order of `sort_by_box`.
        sizes : ndarray of float64, shape (P,)
            The largest absolute coordinate of each net (`PatchNets.sizes`).
        parameters : ndarray of float64, shape (3, 2, m)
            The corners of the pieces, as parameters of the patches.
        """
        units = find_units(sizes)
        scaled = nets.copy()
        scaled[:, :3] /= units[:, np.newaxis, np.newaxis, np.newaxis]
        # The box about each piece; for each box its net, a cubic net near it, and their distance.
        box, box_nets, cubic_nets, gaps = reduce_boxes(scaled, patch, parameters)
        # From the units of patches to those of pieces, which may be larger.
        scale = units[patch] / self.unit
        begin, end = parameters.min(axis=0), parameters.max(axis=0)
        wide = end > begin
        # The corners as parameters of the box.
        inner = np.where(wide, (parameters - begin) / np.where(wide, end - begin, 1.0), 0.0)
        framed = self.triangles.to_frames(cubic_nets[box], scale)
        net = build_triangle_nets(framed, inner, ordered=self.ordered)
        gap = gaps[box] * scale
        bound = self._bound_deviation(net) + gap
        # Where the cubic net is not near the net over the box, the latter may still be near the
        # reference triangle, so its hull is tried too.
        rows = (gap > bound * DOUBTFUL).nonzero()[0]
        if len(rows):
            hulls = _bound_by_hulls(box_nets[box[rows]], self.triangles.take(rows), scale[rows])
            bound[rows] = np.minimum(bound[rows], hulls)
        return LocalNets(net, gap, bound)

    def bound_by_hulls(self, nets: FloatArray) -> FloatArray:
        """Bounds (m,) of the deviations of whole patches (m, D, p+1, q+1), in model units."""
        return self.to_model_units(_bound_by_hulls(nets, self.triangles, 1.0 / self.unit))

    def to_model_units(self, bound: FloatArray) -> FloatArray:
        """Bounds (m,) in local units as bounds in model units, with all rounding added."""
        return (bound + self.triangles.tilt + self.rounding) * self.unit + self.slack

    def bound_distances_to_eye(self, piece: LocalNets, eye: FloatArray) -> FloatArray:
        """Lower bounds (m,) of the distances from pieces to the eye (3,), by boxes about nets."""
        # A distant eye is moved to the nearest point of the cube within `FAR` of the middle. The
        # piece is in this convex cube, so this never increases the distance.
        difference = np.clip(eye[:, np.newaxis] - self.middle, -FAR * self.unit, FAR * self.unit)
        local_eye = self.triangles.to_frames(difference.T[..., np.newaxis], 1.0 / self.unit)[..., 0]
        points = project(piece.net)
        gap = np.maximum(points.min(axis=2) - local_eye, local_eye - points.max(axis=2)).T
        # If the eye is far from the middle, rounding of its coordinates is relative to the length.
        lengths = length(np.maximum(gap, 0.0)) * (1.0 - 2.0**-40)
        lengths = lengths - piece.gap - self.rounding
        return np.maximum(lengths * self.unit - self.slack, 0.0)

    def bound_reverse_distances(self, piece: LocalNets, images: FloatArray) -> FloatArray:
        """Bounds (m,) of |S − A|, for pieces S and their affine maps A to the reference triangles.

        S is X / w (w = 1 without weights). Axis 0 of `images` (3, 3, m) counts the corners e of
        pieces, axis 1 the barycentric coordinates of their images A_e in the reference triangles.
        S − A is (X − w A) / w, where X − w A is a triangular net of one degree more than those of X
        and w. Its point (i_0, i_1, i_2) is a mean over the corners e with i_e > 0, with weights
        i_e: of X − w A_e at the points of the nets of X and w with i_e reduced by 1. The net of w
        is elevated in the same way.
        """
        net = piece.net
        a, b, c = self.triangles.corners
        degree = degree_of(net.shape[2])
        difference = np.zeros((*net.shape[:2], len(list_exponents(degree + 1))))
        for image, raised in zip(images, _build_raising(degree), strict=True):
            # The image of a corner is in the plane of the triangle, at height 0.
            target = (image[0] * a + image[1] * b + image[2] * c).T[..., np.newaxis]
            away = net.copy()
            away[:, :2] -= net[:, 3:] * target if net.shape[1] == 4 else target
            difference += away @ raised
        # Each coordinate of S − A is bounded as heights are.
        rises = bound_heights(difference[:, :3], degree + 1)
        by_coordinates = self._bound_quotients(np.sqrt((rises * rises).sum(axis=1)), net)
        points = project(difference)
        by_hull = np.sqrt(((points * points).sum(axis=1)).max(axis=1))
        bound: FloatArray = np.minimum(by_coordinates, by_hull) + piece.gap
        return bound

    def _bound_deviation(self, net: FloatArray) -> FloatArray:
        """Bounds of the distances from surfaces to the triangles and their neighbours."""
        rise = self._bound_quotients(bound_heights(net[:, 2:3], degree_of(net.shape[2]))[:, 0], net)
        return bound_distances(project(net), self.triangles, rise)

    def _bound_quotients(self, numerator: FloatArray, net: FloatArray) -> FloatArray:
        """Bounds (m,) of heights or lengths, given bounds (m,) of their numerators.

        The error of a point of a numerator is at most `rounding` times its weight, hence times the
        largest weight; the point is divided by the least weight. The factor 2 is for three
        coordinates.
        """
        if net.shape[1] == 3:
            return numerator
        weights = net[:, 3]
        most, least = weights.max(axis=1), weights.min(axis=1)
        quotient: FloatArray = (numerator + 2 * self.rounding * most) / least
        return quotient


@lru_cache(maxsize=64)
def _build_raising(degree: int) -> FloatArray:
    """Matrices (3, N, N+n+2) from a net to its product with each barycentric coordinate."""
    row = {key: number for number, key in enumerate(list_exponents(degree))}
    keys = list_exponents(degree + 1)
    matrices = np.zeros((3, len(row), len(keys)))
    for column, key in enumerate(keys):
        for corner in range(3):
            if key[corner]:
                lower = tuple(n - (k == corner) for k, n in enumerate(key))
                matrices[corner, row[lower], column] = key[corner] / (degree + 1)
    matrices.flags.writeable = False
    return matrices


def _bound_by_hulls(
    nets: FloatArray, triangles: ReferenceTriangles, scale: FloatArray
) -> FloatArray:
    """Bounds (m,) of deviations by the hulls of nets (m, D, …), whose points are scaled first."""
    net = triangles.to_frames(nets.reshape(*nets.shape[:2], -1), scale)
    return bound_distances(project(net), triangles)


def find_units(sizes: FloatArray) -> FloatArray:
    """The least power of two above each size, but at least 2^-1000; 1 for a size of 0."""
    return np.ldexp(1.0, np.maximum(np.frexp(sizes)[1], -1000))


def build_local_frames(
    patch_nets: PatchNets,
    nets: Nets,
    patch: Ints,
    vertices: FloatArray,
    opposite: tuple[FloatArray, Bools],
    *,
    ordered: bool,
) -> LocalFrames:
    """The frames of m pieces in patches of one degree.

    Parameters
    ----------
    nets : Nets
        The nets of the patches of this degree.
    patch : ndarray of int, shape (m,)
        The patch of each piece.
    vertices : ndarray of float64, shape (3, 3, m)
        The vertices of the reference triangles, in model coordinates.
    opposite : ndarrays of shapes (3, 3, m) and (3, m)
        The vertex opposite to each edge of these triangles, in the neighbouring triangle, in model
        coordinates; and whether there is one.
    ordered : bool
        See `LocalFrames`.
    """
    opposite_vertices, joined = opposite
    middle = patch_nets.middles.take(patch, axis=1)
    local_vertices, local_opposite = vertices - middle, opposite_vertices - middle
    unit = find_units(np.maximum(patch_nets.sizes[patch], np.abs(local_vertices).max(axis=(0, 1))))
    joined = joined & (np.abs(local_opposite).max(axis=1) <= FAR * unit)
    # Where no triangle is joined, any finite vertex will do.
    scaled_opposite = np.where(joined[:, np.newaxis], local_opposite, local_vertices) / unit
    slack = bound_storage_error(np.abs(vertices).max(axis=(0, 1))) + patch_nets.lowering
    return LocalFrames(
        build_reference_triangles(local_vertices / unit, scaled_opposite, joined),
        middle,
        unit,
        slack,
        UNIT * count_roundings(*nets.degree),
        ordered,
    )
