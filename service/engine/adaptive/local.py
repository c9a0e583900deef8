"""Pieces of a surface as they look from their hosts: nets in frames, and what is told from them."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.triangle import degree_of
from service.engine.adaptive.blossoms import box_nets, exponents, half_nets, triangle_nets
from service.engine.adaptive.distance import reach
from service.engine.adaptive.ground import Ground, Nets
from service.engine.adaptive.heights import highest
from service.engine.adaptive.hosts import Hosts, hosts_of
from service.engine.adaptive.reduction import near
from service.engine.adaptive.rounding import UNIT, roundings, stored

DIRECT = 8
"""Degree p + q up to which the nets of triangles are computed as such."""


@dataclass(frozen=True, eq=False, slots=True)
class Local:
    """Some pieces over patches of one degree, in the frames of their hosts.

    Units are such that no coordinate about the middle of the patch is above 1: a power of two
    for each piece, 2^exponent. So no digit is lost, and no square.

    Attributes
    ----------
    nets : ndarray of float64, shape (p+1, q+1, D, m)
        Of the patches.
    hosts : Hosts
    middle : ndarray of float64, shape (3, m)
        Of the patches, in model coordinates.
    exponent : ndarray of int, shape (m,)
    slack : ndarray of float64, shape (m,)
        What the roundings of positions and of patches may do. Model units.
    """

    nets: FloatArray
    hosts: Hosts
    middle: FloatArray
    exponent: Ints
    slack: FloatArray

    @property
    def degree(self) -> tuple[int, int]:
        """Degree (p, q) of the patches."""
        return self.nets.shape[0] - 1, self.nets.shape[1] - 1

    def over(self, places: FloatArray, *, halves: bool) -> "Piece":
        """The surface over triangles of parameters (3, 2, m).

        `halves`: they have a right angle at corner 0, and corner 1 is along u from it.
        """
        u, v = places[:, 0], places[:, 1]
        if halves:
            sides = (u[0], u[1]), (v[0], v[2])
        else:
            sides = (u.min(axis=0), u.max(axis=0)), (v.min(axis=0), v.max(axis=0))
        direct = sum(self.degree) <= DIRECT
        if direct and not halves:
            return Piece(triangle_nets(self.nets, [*u], [*v]))
        boxes = box_nets(self.nets, *sides)
        if direct:
            return Piece(half_nets(boxes))
        low, off, heavier = near(boxes)
        hull = boxes.reshape(-1, *boxes.shape[2:])
        if halves:
            return Piece(half_nets(low), hull, off, heavier)
        inner = (
            [np.where(b > a, (t - a) / np.where(b > a, b - a, 1.0), 0.0) for t in axis]
            for axis, (a, b) in zip((u, v), sides, strict=True)
        )
        return Piece(triangle_nets(low, *inner), hull, off, heavier)

    def restored(self, bound: FloatArray) -> FloatArray:
        """A bound in model units, all rounding included."""
        safe = bound + self.hosts.tilt + UNIT * roundings(*self.degree)
        bounds: FloatArray = np.ldexp(safe, self.exponent) + self.slack
        return bounds

    def distances(self, piece: "Piece", eye: FloatArray) -> FloatArray:
        """Lower bounds of the distances between the pieces and the eye, by boxes about nets."""
        seen = self.hosts.framed(np.ldexp(eye[:, np.newaxis] - self.middle, -self.exponent))
        points = projected(piece.net if piece.hull is None else piece.hull)
        gap = np.maximum(points.min(axis=0) - seen, seen - points.max(axis=0))
        gap = np.maximum(gap, 0.0)
        length = np.sqrt(gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2])
        # Far from the middle the eye's own coordinates are rounded.
        length = length * (1.0 - 2.0**-40) - UNIT * roundings(*self.degree)
        least: FloatArray = np.maximum(np.ldexp(length, self.exponent) - self.slack, 0.0)
        return least


@dataclass(frozen=True, eq=False, slots=True)
class Piece:
    """The surface over triangles of parameters, or one near it.

    Attributes
    ----------
    net : ndarray of float64, shape (N, D, m)
        A triangular net.
    hull : ndarray of float64, shape (K, D, m), or None
        Points with the surface in their hull, where the net is another surface's.
    off, heavier : ndarray of float64, shape (m,), or None
        How far that one's points, and weights, are from the surface's, as in `reduction`.
    """

    net: FloatArray
    hull: FloatArray | None = None
    off: FloatArray | None = None
    heavier: FloatArray | None = None

    def deviation(self, hosts: Hosts) -> FloatArray:
        """Bounds of the distances from the surface to hosts and their neighbours."""
        bound = self._near(hosts)
        if self.hull is None:
            return bound
        x, y, h = _columns(projected(self.hull))
        whole = reach(x, y, h, hosts)
        nearest: FloatArray = np.minimum(bound + self.gap(), whole.bound(whole.height))
        return nearest

    def _near(self, hosts: Hosts) -> FloatArray:
        """The same for the surface of the net."""
        x, y, h = _columns(projected(self.net))
        rise = highest(np.ascontiguousarray(self.net[:, 2]), degree_of(len(h)))
        return reach(x, y, h, hosts).bound(rise / _lightest(self.net))

    def gap(self) -> FloatArray | float:
        """How far the surface is from that of the net."""
        if self.hull is None or self.off is None or self.heavier is None:
            return 0.0
        x, y, h = _columns(projected(self.net))
        size = np.sqrt((x * x + y * y + h * h).max(axis=0))
        gap: FloatArray = (self.off + self.heavier * size) / _lightest(self.hull)
        return gap

    def straying(self, images: FloatArray) -> FloatArray:
        """Bounds of |S − A| for A affine with these images (3, 2, m) of the corners, in the plane.

        S − A = (X − w A) / w, where X − w A is a triangular net of one degree more: to point
        (i_0, i_1, i_2) of it every corner e with i_e > 0 gives (X − w A_e), of the point with
        one less of it, in proportion to i_e. The same for w.
        """
        degree = degree_of(len(self.net))
        place = {key: row for row, key in enumerate(exponents(degree))}
        homogeneous = self.net.shape[1] == 4
        made = np.zeros((len(exponents(degree + 1)), *self.net.shape[1:]))
        for corner in range(3):
            gone = self.net.copy()
            for axis in range(2):
                target = images[corner, axis]
                gone[:, axis] -= self.net[:, 3] * target if homogeneous else target
            for number, key in enumerate(exponents(degree + 1)):
                if key[corner]:
                    less = list(key)
                    less[corner] -= 1
                    row = place[less[0], less[1], less[2]]
                    made[number] += key[corner] / (degree + 1) * gone[row]
        columns = _columns(made)
        rises = [highest(column, degree + 1) for column in columns]
        part = np.sqrt(sum(rise * rise for rise in rises)) / _lightest(made)
        x, y, h = _columns(projected(made))
        whole = np.sqrt((x * x + y * y + h * h).max(axis=0))
        bound: FloatArray = np.minimum(part, whole) + self.gap()
        return bound


def projected(net: FloatArray) -> FloatArray:
    """Points (N, 3, m) of nets that may be homogeneous."""
    return net if net.shape[1] == 3 else net[:, :3] / net[:, 3:]


def _columns(points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Coordinates of points (N, 3 or 4, m), (N, m) each."""
    x, y, h = (np.ascontiguousarray(points[:, axis]) for axis in range(3))
    return x, y, h


def _lightest(net: FloatArray) -> FloatArray | float:
    """The least weight of each net."""
    return net[:, 3].min(axis=0) if net.shape[1] == 4 else 1.0


def local(
    ground: Ground, nets: Nets, patch: Ints, vertices: FloatArray, beyond: tuple[FloatArray, Bools]
) -> Local:
    """Pieces over these patches, of one degree.

    Parameters
    ----------
    vertices : ndarray of float64, shape (3, 3, m)
        Of their hosts.
    beyond : ndarrays of shapes (3, 3, m) and (3, m)
        The vertices across their edges, and whether there are any; model coordinates.
    """
    across, joined = beyond
    middle = ground.middles[:, patch]
    own = vertices - middle
    size = np.maximum(ground.sizes[patch], np.abs(own).max(axis=(0, 1)))
    exponent = np.frexp(size)[1]
    hosts = hosts_of(np.ldexp(own, -exponent), np.ldexp(across - middle, -exponent), joined)
    net = nets.take(ground.row[patch])
    net[:, :, :3] = np.ldexp(net[:, :, :3], -exponent)
    slack = stored(np.abs(vertices).max(axis=(0, 1))) + ground.lowering
    return Local(hosts.framed(net), hosts, middle, exponent, slack)
