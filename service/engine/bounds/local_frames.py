"""Pieces of a surface in the frames of their reference triangles: nets, and what they tell.

Units are such that no coordinate about the middle of a patch is above 1, neither of control points
nor of vertices: a power of two for each piece. So no digit is lost, and no square over- or
underflows.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.triangle import degree_of
from service.engine.bounds.blossoms import exponents, triangle_nets
from service.engine.bounds.certificate_rounding import UNIT, roundings, stored
from service.engine.bounds.degree_reduction import reduced_boxes
from service.engine.bounds.distance import distances
from service.engine.bounds.heights import highest
from service.engine.bounds.patch_nets import Nets, PatchNets
from service.engine.bounds.reference_triangles import ReferenceTriangles, reference_triangles

FAR = 2.0**300
"""Distance, in units of a piece, beyond which neighbours and eyes are not reckoned with."""

DOUBTFUL = 1 / 8
"""Share of a bound that may come of reducing degrees before the nets are looked at themselves."""


@dataclass(frozen=True, eq=False, slots=True)
class Piece:
    """The surface over triangles of parameters, or one near it, in local frames and units.

    Attributes
    ----------
    net : ndarray of float64, shape (m, D, N)
        Triangular nets.
    gap : ndarray of float64, shape (m,), or 0
        How far their surface is from the one meant, at the most.
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
        Of the patches, in model coordinates.
    unit : ndarray of float64, shape (m,)
    slack : ndarray of float64, shape (m,)
        What the roundings of positions and of patches may do. Model units.
    rounding : float
        What rounding may do to a point, and to distances, in local units.
    ordered : bool
        Whether the corners of nets have to be in the order of the places.
    """

    triangles: ReferenceTriangles
    middle: FloatArray
    unit: FloatArray
    slack: FloatArray
    rounding: float
    ordered: bool

    def over(self, nets: FloatArray, places: FloatArray) -> Piece:
        """The surface of patches (m, D, p+1, q+1), in model units, over triangles (3, 2, m)."""
        framed = self.triangles.framed(nets, 1.0 / self.unit)
        net = triangle_nets(framed, places, ordered=self.ordered)
        return Piece(net, 0.0, self._deviation(net))

    def near(self, nets: FloatArray, patch: Ints, sizes: FloatArray, places: FloatArray) -> Piece:
        """A surface near that of patches of high degree, over triangles (3, 2, m) in `box_order`.

        Parameters
        ----------
        nets : ndarray of float64, shape (P, D, p+1, q+1)
            Of the patches that there are, each once, in model units.
        patch : ndarray of int, shape (m,)
            Which of these it is, rising.
        sizes : ndarray of float64, shape (P,)
            Those of the patches.
        """
        units = unit_of(sizes)
        own = nets.copy()
        own[:, :3] /= units[:, np.newaxis, np.newaxis, np.newaxis]
        box, whole, low, gaps = reduced_boxes(own, patch, places)
        share = units[patch] / self.unit
        begin, end = places.min(axis=0), places.max(axis=0)
        wide = end > begin
        inner = np.where(wide, (places - begin) / np.where(wide, end - begin, 1.0), 0.0)
        framed = self.triangles.framed(low[box], share)
        net = triangle_nets(framed, inner, ordered=self.ordered)
        gap = gaps[box] * share
        bound = self._deviation(net) + gap
        # What hardly bends has all of its net near the triangle, though not near a cubic one.
        rows = (gap > bound * DOUBTFUL).nonzero()[0]
        if len(rows):
            hulls = _hulls(whole[box[rows]], self.triangles.take(rows), share[rows])
            bound[rows] = np.minimum(bound[rows], hulls)
        return Piece(net, gap, bound)

    def hulls(self, nets: FloatArray) -> FloatArray:
        """Bounds (m,) of the deviations of whole patches (m, D, p+1, q+1), in model units."""
        return self.restore(_hulls(nets, self.triangles, 1.0 / self.unit))

    def restore(self, bound: FloatArray) -> FloatArray:
        """A bound in model units, all rounding included."""
        bounds: FloatArray = (bound + self.triangles.tilt + self.rounding) * self.unit + self.slack
        return bounds

    def distances_to_eye(self, piece: Piece, eye: FloatArray) -> FloatArray:
        """Lower bounds of the distances between pieces and the eye (3,), by boxes about nets."""
        # From the nearest place in a box about the piece it is not further than from the eye.
        away = np.clip(eye[:, np.newaxis] - self.middle, -FAR * self.unit, FAR * self.unit)
        seen = self.triangles.framed(away.T[..., np.newaxis], 1.0 / self.unit)[..., 0]
        points = projected(piece.net)
        gap = np.maximum(points.min(axis=2) - seen, seen - points.max(axis=2)).T
        gap = np.maximum(gap, 0.0)
        length = np.sqrt(gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2])
        # Far from the middle the eye's own coordinates are rounded.
        length = length * (1.0 - 2.0**-40) - piece.gap - self.rounding
        least: FloatArray = np.maximum(length * self.unit - self.slack, 0.0)
        return least

    def reverse_distances(self, piece: Piece, images: FloatArray) -> FloatArray:
        """Bounds of |S − A| for A affine with these images of the corners, shape (3, 3, m).

        Images are barycentric coordinates on the reference triangle, axis 1. S − A is
        (X − w A) / w, where X − w A is a triangular net of one degree more: to point
        (i_0, i_1, i_2) of it every corner e with i_e > 0 gives (X − w A_e), of the point with
        one less of it, in proportion to i_e. The same for w.
        """
        net = piece.net
        a, b, c = self.triangles.corners
        degree = degree_of(net.shape[2])
        made = np.zeros((*net.shape[:2], len(exponents(degree + 1))))
        for image, raised in zip(images, _raising(degree), strict=True):
            target = (image[0] * a + image[1] * b + image[2] * c).T[..., np.newaxis]
            gone = net.copy()
            gone[:, :2] -= net[:, 3:] * target if net.shape[1] == 4 else target
            made += gone @ raised
        rises = highest(made[:, :3], degree + 1)
        part = self._divided(np.sqrt((rises * rises).sum(axis=1)), net)
        seen = projected(made)
        whole = np.sqrt(((seen * seen).sum(axis=1)).max(axis=1))
        bound: FloatArray = np.minimum(part, whole) + piece.gap
        return bound

    def _deviation(self, net: FloatArray) -> FloatArray:
        """Bounds of the distances from surfaces to the triangles and their neighbours."""
        rise = self._divided(highest(net[:, 2:3], degree_of(net.shape[2]))[:, 0], net)
        return distances(projected(net), self.triangles, rise)

    def _divided(self, numerator: FloatArray, net: FloatArray) -> FloatArray:
        """Bounds (m,) of quotients, of bounds of numerators; weights that differ magnify rounding.

        A point of a numerator is right to what its own weight times a point is, hence to the
        heaviest; the least of the weights divides it. Three coordinates make this twice as much.
        """
        if net.shape[1] == 3:
            return numerator
        weights = net[:, 3]
        most, least = weights.max(axis=1), weights.min(axis=1)
        quotient: FloatArray = (numerator + 2 * self.rounding * most) / least
        return quotient


@lru_cache(maxsize=64)
def _raising(degree: int) -> FloatArray:
    """Nets of a corner's coordinate times a net, of one degree more: shape (3, N, N+n+2)."""
    place = {key: row for row, key in enumerate(exponents(degree))}
    keys = exponents(degree + 1)
    shares = np.zeros((3, len(place), len(keys)))
    for at, key in enumerate(keys):
        for corner in range(3):
            if key[corner]:
                less = tuple(n - (k == corner) for k, n in enumerate(key))
                shares[corner, place[less], at] = key[corner] / (degree + 1)
    shares.flags.writeable = False
    return shares


def _hulls(nets: FloatArray, triangles: ReferenceTriangles, scale: FloatArray) -> FloatArray:
    """Bounds (m,) by the hulls of nets (m, D, …), times scales (m,)."""
    net = triangles.framed(nets.reshape(*nets.shape[:2], -1), scale)
    return distances(projected(net), triangles)


def projected(net: FloatArray) -> FloatArray:
    """Points (m, 3, N) of nets that may be homogeneous."""
    return net if net.shape[1] == 3 else net[:, :3] / net[:, 3:]


def unit_of(sizes: FloatArray) -> FloatArray:
    """The least powers of two above sizes; 2^-1000 for what is less."""
    unit: FloatArray = np.ldexp(1.0, np.maximum(np.frexp(sizes)[1], -1000))
    return unit


def local_frames(
    ground: PatchNets,
    nets: Nets,
    patch: Ints,
    vertices: FloatArray,
    beyond: tuple[FloatArray, Bools],
    *,
    ordered: bool,
) -> LocalFrames:
    """The frames of pieces over these patches, of one degree.

    Parameters
    ----------
    vertices : ndarray of float64, shape (3, 3, m)
        Of their reference triangles.
    beyond : ndarrays of shapes (3, 3, m) and (3, m)
        The vertices across their edges, and whether there are any; model coordinates.
    """
    across, joined = beyond
    middle = ground.middles[:, patch]
    own, gone = vertices - middle, across - middle
    unit = unit_of(np.maximum(ground.sizes[patch], np.abs(own).max(axis=(0, 1))))
    joined = joined & (np.abs(gone).max(axis=1) <= FAR * unit)
    across = np.where(joined[:, np.newaxis], gone, own) / unit
    slack = stored(np.abs(vertices).max(axis=(0, 1))) + ground.lowering
    return LocalFrames(
        reference_triangles(own / unit, across, joined),
        middle,
        unit,
        slack,
        UNIT * roundings(*nets.degree),
        ordered,
    )
