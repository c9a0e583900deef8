"""Spans of many B-splines whose knots stand one after the other in one column."""

import numpy as np

from service.bases.affine_combination import WeightedPoints, to_homogeneous
from service.bases.arrays import FloatArray, Ints


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
    owner = np.repeat(np.arange(len(degrees)), np.diff(starts))
    row = np.arange(len(knots))
    is_begin = (row >= (starts[:-1] + degrees)[owner]) & (row < (starts[1:] - degrees - 1)[owner])
    is_begin[:-1] &= knots[1:] > knots[:-1]
    position = is_begin.nonzero()[0]
    return position, owner[position]


def list_breaks(knots: FloatArray, position: Ints, owner: Ints, span_count: Ints) -> FloatArray:
    """The knots between spans, with both ends of each domain: Σ (span_count + 1) numbers."""
    breaks = np.empty(len(position) + len(span_count))
    breaks[np.arange(len(position)) + owner] = knots[position]
    last = span_count.cumsum() - 1
    breaks[last + 1 + np.arange(len(span_count))] = knots[position[last] + 1]
    return breaks


def find_knots_around(knots: FloatArray, position: Ints, degree: int) -> FloatArray:
    """The 2p knots U_{s−p+1}, …, U_{s+p} around each span s, shape (m, 2p)."""
    around: FloatArray = knots[position[:, np.newaxis] + np.arange(1 - degree, degree + 1)]
    return around


def find_general_spans(knots_around: FloatArray) -> Ints:
    """The spans whose control points are not their Bézier points, by number."""
    degree = knots_around.shape[1] // 2
    left, right = knots_around[:, :degree], knots_around[:, degree:]
    is_general = (left != left[:, -1:]).any(axis=1) | (right != right[:, :1]).any(axis=1)
    return np.flatnonzero(is_general)


def combine_points(
    points: FloatArray,
    weights: FloatArray | None,
    along_u: FloatArray,
    along_v: FloatArray | None = None,
) -> WeightedPoints:
    """Bézier points and weights of spans from their control points and operators of extraction.

    Means are computed relative to the first control point of each span, so that no digits are lost
    far from the origin. A curve is a net with one column.

    Parameters
    ----------
    points : ndarray of float64, shape (m, p+1, q+1, D)
    weights : ndarray of float64, shape (m, p+1, q+1), or None
    along_u, along_v : ndarray of float64, shapes (m, p+1, p+1) and (m, q+1, q+1)
        As from `service.bases.blossoms.build_span_operators`; `along_v` is None for curves.
    """
    first = points[:, :1, :1]
    nets = to_homogeneous(points - first, weights)
    nets = (along_u @ nets.reshape(*nets.shape[:2], -1)).reshape(nets.shape)
    if along_v is not None:
        lines = np.ascontiguousarray(nets.swapaxes(1, 2))
        lines = (along_v @ lines.reshape(*lines.shape[:2], -1)).reshape(lines.shape)
        nets = lines.swapaxes(1, 2)
    if weights is None:
        return nets + first, None
    combined = nets[..., -1]
    return nets[..., :-1] / combined[..., np.newaxis] + first, combined
