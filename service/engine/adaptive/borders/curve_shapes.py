"""Shapes of pieces of curves: distances of nets and curves from chords, and angles.

Every number depends on its piece alone, bit for bit.

Proofs in docs/proofs.md: "Curves and chords" and "Curves at equal parameters".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.bounds.chords import (
    bound_from_distances,
    find_row_maxima,
    measure_distances,
)
from service.engine.bounds.faces import DEPTH
from service.engine.nets.subdivision import elevate
from service.engine.vectors import UNIT, dot, length, project


@dataclass(frozen=True, eq=False, slots=True)
class Shapes:
    """Shapes of M pieces of curves.

    Attributes
    ----------
    net, curve : ndarray of float64, shape (M,)
        Bounds of distances to the chord: `net` for the net, elevated by one degree, and `curve` for
        the curve. Nets are elevated because a net over a triangle at a side has a higher degree
        than the side: the degrees along and across it are added, and that across is at least 1.
    apart : ndarray of float64, shape (M,)
        Bounds of the distances between curve and chord at equal parameters; 0 if not measured.
    chord : ndarray of float64, shape (M,)
        Lengths of the chords.
    cosine : ndarray of float64, shape (M,)
        Least cosines between the legs of the net (from each control point to the next) and the
        tangents at both ends.
    low, high : ndarray of float64, shape (M, 3)
        Boxes about the nets.
    """

    net: FloatArray
    curve: FloatArray
    apart: FloatArray
    chord: FloatArray
    cosine: FloatArray
    low: FloatArray
    high: FloatArray

    def combine_runs(self, begin: Ints) -> "Shapes":
        """Shapes (R,) of runs of consecutive pieces, as if each run were one piece.

        `begin` (R,) has the first piece of each run; all pieces of a run have the same chord.
        """
        greatest, least = np.maximum.reduceat, np.minimum.reduceat
        return Shapes(
            greatest(self.net, begin),
            greatest(self.curve, begin),
            greatest(self.apart, begin),
            self.chord[begin],
            least(self.cosine, begin),
            least(self.low, begin),
            greatest(self.high, begin),
        )


def measure_shapes(
    nets: FloatArray,
    chords: FloatArray,
    *,
    chord_parts: FloatArray | None = None,
    tangents: tuple[FloatArray, FloatArray] | None = None,
) -> Shapes:
    """Measure the shapes of pieces.

    Parameters
    ----------
    nets : ndarray of float64, shape (M, n+1, 3), or (M, n+1, 4) if homogeneous
    chords : ndarray of float64, shape (M, 2, 3)
    chord_parts : ndarray of float64, shape (M, 2, 3), or None
        Both ends of the part of the chord that has the same parameters as the piece. If None,
        `apart` is 0.
    tangents : two arrays, or None
        The result of `find_tangents`; None to leave `cosine` 1.
    """
    points = project(nets, -1)
    weights = nets[..., 3] if nets.shape[2] == 4 else None
    curve = bound_from_distances(measure_distances(points, chords), weights)
    # Without weights the elevated net is within 4/3 of the bound of the curve, at every degree.
    net = curve * (4 / 3)
    if weights is not None:
        rational = (weights != 1.0).any(axis=1)
        elevated = project(elevate(nets[rational].swapaxes(0, 1)).swapaxes(0, 1), -1)
        net[rational] = find_row_maxima(measure_distances(elevated, chords[rational]))
    cosine = np.ones(len(nets)) if tangents is None else _find_least_cosine(points, tangents)
    apart = (
        np.zeros(len(nets)) if chord_parts is None else _bound_apart(points, weights, chord_parts)
    )
    chord = measure_lengths(chords[:, 1] - chords[:, 0])
    return Shapes(net, curve, apart, chord, cosine, points.min(axis=1), points.max(axis=1))


def find_tangents(nets: FloatArray, slack: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (M, 3) along curves (M, n+1, …) at their first and last points.

    They have the directions of the first and the last leg of the net that is longer than `slack`
    (M,), the rounding of the net; they are 0 if the net has no such leg.
    """
    legs, lengths = _find_legs(project(nets, -1))
    is_long = lengths > slack[:, None]
    rows = np.arange(len(nets))
    tangents = []
    for at in (is_long.argmax(axis=1), is_long.shape[1] - 1 - is_long[:, ::-1].argmax(axis=1)):
        has_length = is_long[rows, at]
        unit = np.where(has_length, lengths[rows, at], 1.0)
        tangents.append(np.where(has_length[:, None], legs[rows, at] / unit[:, None], 0.0))
    return tangents[0], tangents[1]


def bound_net_rounding(size: FloatArray, far: FloatArray, degree: int) -> FloatArray:
    """Bounds (M,) of the rounding of nets by halving and by subtracting their first points.

    A net results from at most `DEPTH` halvings. The errors of weights, quotients, distances and of
    storing the ends of a chord are included.
    `size` and `far` (M,) are the largest coordinates of nets about their first points, and about
    the origin of the model.
    """
    return 2 * UNIT * (size * (2.0 * DEPTH * degree + 16.0) + 2.0 * far)


def _bound_apart(
    points: FloatArray, weights: FloatArray | None, chord_parts: FloatArray
) -> FloatArray:
    """Bounds (M,) of ‖C(t) − L(t)‖, where L(t) = (1 − t) a + t b is the part of the chord.

    They are max_k |N_k| / min w, N_k = (1 − k/(n+1)) w_k (P_k − a) + k/(n+1) w_{k−1} (P_{k−1} − b).
    """
    degree = points.shape[1] - 1
    share = (np.arange(degree + 2) / (degree + 1))[:, None]
    from_ends = np.zeros((2, len(points), degree + 2, 3))
    from_ends[0, :, :-1], from_ends[1, :, 1:] = (
        points - chord_parts[:, :1],
        points - chord_parts[:, 1:],
    )
    least = np.ones(len(points))
    if weights is not None:
        from_ends[0, :, :-1] *= weights[..., None]
        from_ends[1, :, 1:] *= weights[..., None]
        least = -find_row_maxima(-weights)
    net = (1.0 - share) * from_ends[0] + share * from_ends[1]
    return find_row_maxima(measure_lengths(net)) / least


def _find_least_cosine(points: FloatArray, tangents: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Least cosines (M,) between legs of nets and tangents; vectors of length 0 do not count."""
    legs, lengths = _find_legs(points)
    least = np.ones(len(points))
    for tangent in tangents:
        along = dot(legs, tangent[:, None], -1)
        counts = (lengths > 0) & (tangent != 0).any(axis=1)[:, None]
        cosine = np.where(counts, along, 1.0) / np.where(counts, lengths, 1.0)
        least = np.minimum(least, -find_row_maxima(-cosine))
    return least


def _find_legs(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Differences of neighbours in nets, (M, n, 3), and their lengths."""
    legs = points[:, 1:] - points[:, :-1]
    return legs, measure_lengths(legs)


def measure_lengths(vectors: FloatArray) -> FloatArray:
    """Lengths of vectors (…, 3), also if their squares would underflow or overflow."""
    x, y, z = np.abs(np.moveaxis(vectors, -1, 0))
    size = np.maximum(np.maximum(x, y), z)
    unit = np.where(size > 0, size, 1.0)
    return unit * length(vectors / unit[..., None], -1)
