"""Spans of many B-splines whose knots stand one after the other in one column."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.affine_combination import WeightedPoints, to_homogeneous
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.blossoms import find_bezier_points
from service.surface.spline_tables import find_starts

STEP = 4.0
"""Distance of the keys of two domains. The keys of the breaks of one domain run from 0 to 1."""

FEW = 4
"""Where no domain has more spans than this, breaks are compared one after the other."""


@dataclass(frozen=True, eq=False)
class Breaks:
    """The distinct knots of n domains, in ascending order for each.

    Attributes
    ----------
    values : ndarray of float64, shape (Σ (count + 1),)
    count : ndarray of int, shape (n,)
        Number of spans of each domain.
    first : ndarray of int, shape (n,)
        The row in `values` of the first break of each domain.
    """

    values: FloatArray
    count: Ints
    first: Ints

    @property
    def start(self) -> FloatArray:
        """The first parameter of each domain, (n,)."""
        return self.values.take(self.first)

    @property
    def end(self) -> FloatArray:
        """The last parameter of each domain, (n,)."""
        return self.values.take(self.first + self.count)

    @cached_property
    def owner(self) -> Ints:
        """The domain of each break."""
        return np.repeat(np.arange(len(self.count)), self.count + 1)

    def find_spans(self, domain: Ints, t: FloatArray, *, before: bool = False) -> Ints:
        """The spans (m,) of domains that contain the parameters t (m,).

        At a break it is the span that begins there, or with `before` the span that ends there.
        Parameters outside of a domain belong to its first or its last span.
        """
        if self._largest == 1:
            return np.zeros(len(domain), np.intp)
        first = self.first.take(domain)
        if self._largest <= FEW:
            return self._count_breaks(domain, first, t, before)
        key = (t - self.values.take(first)) * self._rates.take(domain) + STEP * domain
        after = self._keys.searchsorted(key, side="left" if before else "right")
        span: Ints = np.minimum(np.maximum(after - 1 - first, 0), self._most.take(domain))
        # Keys of many domains have fewer digits than parameters: nearly always, nothing is left.
        low, high = self._limits
        at = first + span
        while True:
            begin, end = low.take(at), high.take(at)
            down, up = (t <= begin, t > end) if before else (t < begin, t >= end)
            if not (down | up).any():
                return at - first
            at += up.astype(np.intp) - down

    def _count_breaks(self, domain: Ints, first: Ints, t: FloatArray, before: bool) -> Ints:
        """The spans, as numbers of inner breaks that are not above t: one after the other."""
        most = self._most.take(domain)
        span = np.zeros(len(domain), np.intp)
        for k in range(1, self._largest):
            inner = self.values.take(first + np.minimum(most, k))
            span += inner < t if before else inner <= t
        return np.minimum(span, most)

    @cached_property
    def _largest(self) -> int:
        """The largest number of spans of a domain."""
        return int(self.count.max(initial=1))

    @cached_property
    def _most(self) -> Ints:
        """The last span of each domain."""
        return self.count - 1

    @cached_property
    def _rates(self) -> FloatArray:
        """The inverse length of each domain."""
        rates: FloatArray = 1.0 / (self.end - self.start)
        return rates

    @cached_property
    def _keys(self) -> FloatArray:
        """For each break: `STEP` times its domain, and its share of the domain; ascending."""
        share = (self.values - self.start[self.owner]) * self._rates[self.owner]
        keys: FloatArray = share + STEP * self.owner
        return keys

    @cached_property
    def _limits(self) -> tuple[FloatArray, FloatArray]:
        """Both ends of the span that begins at each break; first and last spans have no ends."""
        low, high = self.values.copy(), np.append(self.values[1:], np.inf)
        low[self.first] = -np.inf
        high[self.first + self._most] = np.inf
        return low, high


def list_spans(knots: FloatArray, degrees: Ints, starts: Ints) -> tuple[Ints, Ints]:
    """The spans of n splines, one spline after the other.

    Parameters
    ----------
    knots : ndarray of float64, shape (K,)
        Knot vectors, one after the other.
    degrees : ndarray of int, shape (n,)
    starts : ndarray of int, shape (n+1,)
        Where each knot vector begins, and K.

    Returns
    -------
    position, owner : ndarray of int, shape (m,)
        The row in `knots` of the knot at which each span begins, and the number of its spline.
    """
    owner = np.arange(len(degrees)).repeat(starts[1:] - starts[:-1])
    row = np.arange(len(knots))
    is_begin = (row >= (starts[:-1] + degrees)[owner]) & (row < (starts[1:] - degrees - 1)[owner])
    is_begin[:-1] &= knots[1:] > knots[:-1]
    position = is_begin.nonzero()[0]
    return position, owner[position]


def find_breaks(knots: FloatArray, position: Ints, owner: Ints, count: int) -> Breaks:
    """The breaks of `count` splines with the spans that `list_spans` found."""
    span_count = np.bincount(owner, minlength=count)
    values = np.empty(len(position) + count)
    values[np.arange(len(position)) + owner] = knots[position]
    first = find_starts(span_count + 1)[:-1]
    values[first + span_count] = knots[position[span_count.cumsum() - 1] + 1]
    return Breaks(values, span_count, first)


def find_knots_around(knots: FloatArray, position: Ints, degree: int) -> FloatArray:
    """The 2p knots U_{s−p+1}, …, U_{s+p} around each span s, shape (m, 2p)."""
    around: FloatArray = knots[position[:, np.newaxis] + np.arange(1 - degree, degree + 1)]
    return around


def find_general_spans(knots_around: FloatArray) -> Bools:
    """Which spans have control points that are not their Bézier points, (m,)."""
    degree = knots_around.shape[1] // 2
    left, right = knots_around[:, :degree], knots_around[:, degree:]
    is_general: Bools = (left != left[:, -1:]).any(axis=1)
    is_general |= (right != right[:, :1]).any(axis=1)
    return is_general


def extract_points(
    points: FloatArray,
    weights: FloatArray | None,
    around_u: FloatArray,
    around_v: FloatArray | None = None,
) -> WeightedPoints:
    """Bézier points and weights of spans from their control points.

    Means are computed relative to the first control point of each span, so that no digits are lost
    far from the origin. A curve is a net with one column.

    Parameters
    ----------
    points : ndarray of float64, shape (m, p+1, q+1, D)
    weights : ndarray of float64, shape (m, p+1, q+1), or None
    around_u, around_v : ndarray of float64, shapes (m, 2p) and (m, 2q)
        The knots around each span (`find_knots_around`); `around_v` is None for curves.
    """
    first = points[:, :1, :1]
    nets = to_homogeneous(points - first, weights)
    nets = find_bezier_points(nets.reshape(*nets.shape[:2], -1), around_u).reshape(nets.shape)
    if around_v is not None:
        lines = nets.swapaxes(1, 2)
        lines = find_bezier_points(lines.reshape(*lines.shape[:2], -1), around_v).reshape(
            lines.shape
        )
        nets = lines.swapaxes(1, 2)
    if weights is None:
        return nets + first, None
    combined = nets[..., -1]
    return nets[..., :-1] / combined[..., np.newaxis] + first, combined
