"""Pieces of a surface as they look from their hosts: nets in frames, and what is told from them."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.triangle import degree_of
from service.engine.bounds.blossoms import exponents, half_nets, triangle_nets
from service.engine.bounds.certificate_rounding import UNIT, roundings, stored
from service.engine.bounds.degree_reduction import order_of, over_boxes
from service.engine.bounds.distance import reach
from service.engine.bounds.heights import highest
from service.engine.bounds.patch_nets import Nets, PatchNets
from service.engine.bounds.reference_triangles import ReferenceTriangles, hosts_of

FAR = 2.0**300
"""Distance, in units of a piece, beyond which neighbours and eyes are not reckoned with."""

DOUBTFUL = 1 / 8
"""Share of a bound that may come of reducing degrees before the nets are looked at themselves."""


@dataclass(frozen=True, eq=False, slots=True)
class Local:
    """Some pieces over patches of one degree, in the frames of their hosts.

    Units are such that no coordinate about the middle of the patch is above 1: a power of two
    for each piece. So no digit is lost, and no square.

    Attributes
    ----------
    degree : (int, int)
    hosts : ReferenceTriangles
    middle : ndarray of float64, shape (3, m)
        Of the patches, in model coordinates.
    unit : ndarray of float64, shape (m,)
    slack : ndarray of float64, shape (m,)
        What the roundings of positions and of patches may do. Model units.
    """

    degree: tuple[int, int]
    hosts: ReferenceTriangles
    middle: FloatArray
    unit: FloatArray
    slack: FloatArray

    @property
    def rounding(self) -> float:
        """What rounding may do to a point, and to distances, in these units."""
        return UNIT * roundings(*self.degree)

    def over(self, nets: FloatArray, places: FloatArray, right: Bools) -> "Piece":
        """The surface over triangles of parameters.

        Parameters
        ----------
        nets : ndarray of float64, shape (m, D, p+1, q+1)
            The patches, in model units.
        places : ndarray of float64, shape (3, 2, m)
        right : ndarray of bool, shape (m,)
            Whether they have a right angle at corner 0, and corner 1 is along u from it.
        """
        framed = self.hosts.framed(scaled(nets, 1.0 / self.unit))
        halves, others = right.nonzero()[0], (~right).nonzero()[0]
        if not len(others):
            return Piece(half_nets(framed, places[:2, 0], places[::2, 1]), self.rounding)
        if not len(halves):
            return Piece(triangle_nets(framed, places[:, 0], places[:, 1]), self.rounding)
        made = np.empty((len(nets), nets.shape[1], len(exponents(sum(self.degree)))))
        u, v = places[:2, 0, halves], places[::2, 1, halves]
        made[halves] = half_nets(framed[halves], u, v)
        u, v = places[:, 0, others], places[:, 1, others]
        made[others] = triangle_nets(framed[others], u, v)
        return Piece(made, self.rounding)

    def near(self, nets: FloatArray, patch: Ints, sizes: FloatArray, places: FloatArray) -> "Piece":
        """The surface of patches of high degree, of such sizes, over triangles in `box_order`.

        The nets are those of the patches that there are, each once, in units of their own sizes.
        """
        own = unit_of(sizes)
        low, high = places.min(axis=0), places.max(axis=0)
        found = over_boxes(nets, patch, np.array([low[0], high[0]]), np.array([low[1], high[1]]))
        box = found.box
        share = own / self.unit
        framed = self.hosts.framed(scaled(found.low[box], share))
        wide = high > low
        inner = np.where(wide, (places - low) / np.where(wide, high - low, 1.0), 0.0)
        gap = found.gap[box] * share
        piece = Piece(triangle_nets(framed, inner[:, 0], inner[:, 1]), self.rounding)
        bound = piece.deviation(self.hosts) + gap
        # What hardly bends has all of its net near the host, though not near a cubic one.
        rows = (gap > bound * DOUBTFUL).nonzero()[0]
        if len(rows):
            hosts = self.hosts.take(rows)
            hull = hosts.framed(scaled(found.whole[box[rows]], share[rows]))
            furthest = reach(projected(hull.reshape(*hull.shape[:2], -1)), hosts)
            bound[rows] = np.minimum(bound[rows], furthest.bound(furthest.height))
        return Piece(piece.net, self.rounding, gap, bound)

    def restored(self, bound: FloatArray) -> FloatArray:
        """A bound in model units, all rounding included."""
        safe = bound + self.hosts.tilt + self.rounding
        bounds: FloatArray = safe * self.unit + self.slack
        return bounds

    def distances(self, piece: "Piece", eye: FloatArray) -> FloatArray:
        """Lower bounds of the distances between the pieces and the eye, by boxes about nets."""
        # From the nearest place in a box about the piece it is not further than from the eye.
        away = np.clip(eye[:, np.newaxis] - self.middle, -FAR * self.unit, FAR * self.unit)
        seen = self.hosts.framed((away / self.unit).T[..., np.newaxis])[..., 0]
        points = projected(piece.net)
        gap = np.maximum(points.min(axis=2) - seen, seen - points.max(axis=2)).T
        gap = np.maximum(gap, 0.0)
        length = np.sqrt(gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2])
        # Far from the middle the eye's own coordinates are rounded.
        length = length * (1.0 - 2.0**-40) - piece.gap - self.rounding
        least: FloatArray = np.maximum(length * self.unit - self.slack, 0.0)
        return least


@dataclass(frozen=True, eq=False, slots=True)
class Piece:
    """The surface over triangles of parameters, or one near it.

    Attributes
    ----------
    net : ndarray of float64, shape (m, D, N)
        Triangular nets.
    rounding : float
        What its points may be off by.
    gap : ndarray of float64, shape (m,), or 0
        How far its surface is from the one meant.
    known : ndarray of float64, shape (m,), or None
        Bounds of the distances to the hosts, if they are known already.
    """

    net: FloatArray
    rounding: float
    gap: FloatArray | float = 0.0
    known: FloatArray | None = None

    def deviation(self, hosts: ReferenceTriangles) -> FloatArray:
        """Bounds of the distances from the surface to hosts and their neighbours."""
        if self.known is not None:
            return self.known
        rise = self._divided(highest(self.net[:, 2:3], degree_of(self.net.shape[2])))[:, 0]
        bound: FloatArray = reach(projected(self.net), hosts).bound(rise) + self.gap
        return bound

    def _divided(self, numerator: FloatArray) -> FloatArray:
        """Bounds of quotients, of bounds of numerators; weights that differ magnify rounding.

        A point of a numerator is right to what its own weight times a point is, hence to the
        heaviest; the least of the weights divides it. Three coordinates make this twice as much.
        """
        if self.net.shape[1] == 3:
            return numerator
        weights = self.net[:, 3:]
        quotient: FloatArray = (numerator + 2 * self.rounding * weights.max(axis=2)) / weights.min(
            axis=2
        )
        return quotient

    def straying(self, images: FloatArray) -> FloatArray:
        """Bounds of |S − A| for A affine with these images (3, 2, m) of the corners, in the plane.

        S − A = (X − w A) / w, where X − w A is a triangular net of one degree more: to point
        (i_0, i_1, i_2) of it every corner e with i_e > 0 gives (X − w A_e), of the point with
        one less of it, in proportion to i_e. The same for w.
        """
        degree = degree_of(self.net.shape[2])
        made = np.zeros((*self.net.shape[:2], len(exponents(degree + 1))))
        for image, raised in zip(images, _raising(degree), strict=True):
            gone = self.net.copy()
            target = image.T[..., np.newaxis]
            gone[:, :2] -= self.net[:, 3:] * target if self.net.shape[1] == 4 else target
            made += gone @ raised
        rises = highest(made[:, :3], degree + 1)
        part = self._divided(np.sqrt((rises * rises).sum(axis=1))[:, np.newaxis])[:, 0]
        seen = projected(made)
        whole = np.sqrt(((seen * seen).sum(axis=1)).max(axis=1))
        bound: FloatArray = np.minimum(part, whole) + self.gap
        return bound


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


def box_order(patch: Ints, places: FloatArray) -> Ints:
    """The order in which `Local.near` wants triangles (3, 2, m)."""
    return order_of(
        patch, *(np.array([t.min(axis=0), t.max(axis=0)]) for t in (places[:, 0], places[:, 1]))
    )


def projected(net: FloatArray) -> FloatArray:
    """Points (m, 3, N) of nets that may be homogeneous."""
    return net if net.shape[1] == 3 else net[:, :3] / net[:, 3:]


def unit_of(sizes: FloatArray) -> FloatArray:
    """The least powers of two above sizes; 2^-1000 for what is less."""
    unit: FloatArray = np.ldexp(1.0, np.maximum(np.frexp(sizes)[1], -1000))
    return unit


def scaled(nets: FloatArray, scale: FloatArray) -> FloatArray:
    """Nets (m, D, …) times powers of two (m,); their weights remain."""
    scale = scale.reshape(-1, *[1] * (nets.ndim - 1))
    if nets.shape[1] == 3:
        return nets * scale
    return np.concatenate([nets[:, :3] * scale, nets[:, 3:]], axis=1)


def local(
    ground: PatchNets,
    nets: Nets,
    patch: Ints,
    vertices: FloatArray,
    beyond: tuple[FloatArray, Bools],
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
    unit = unit_of(size)
    gone = across - middle
    joined = joined & (np.abs(gone).max(axis=1) <= FAR * unit)
    hosts = hosts_of(own / unit, np.where(joined[:, np.newaxis], gone, own) / unit, joined)
    slack = stored(np.abs(vertices).max(axis=(0, 1))) + ground.lowering
    return Local(nets.degree, hosts, middle, unit, slack)
