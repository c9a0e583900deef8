"""Proved bounds of the distance of a curve from the chords between its samples, by convex hulls.

Halving ends for every tolerance that is larger than the rounding errors; the service refuses
smaller tolerances.

Proof in docs/proofs.md: "Curves and chords".
"""

import numpy as np

from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import FloatArray, RealArray
from service.bases.row_batches import row_slices
from service.engine.bounds.chords import bound_chord_deviations
from service.engine.curves.evaluation import CurveSamples
from service.engine.nets.blossoms import build_blossoms
from service.engine.nets.subdivision import halve
from service.engine.vectors import UNIT, project
from service.errors import InvalidRequest, Issue, TooLarge, count_nouns
from service.surface.curve_model import CurvePieces

MAX_HALVINGS = 48
"""The most halvings of a piece: up to 48, parameters remain exact in float64. By the bound above,
every accepted tolerance needs fewer halvings, also if the ratio of weights is 1e8."""

CHUNK = 1 << 18
"""The most numbers in the nets, or in the matrices that restrict them, of one chunk."""

FLOAT32 = np.finfo(np.float32)


def least_tolerance(pieces: CurvePieces, *, is_float32: bool, origin: FloatArray) -> float:
    """The smallest tolerance, in model units, that the rounding of vertices and nets allows."""
    max_coordinate = float(np.abs(np.stack(pieces.bounds)).max())
    max_stored_coordinate = float(np.abs(np.stack(pieces.bounds) - origin).max())
    coordinate_error = 2 * UNIT * max_coordinate * (pieces.degree + 2)
    if is_float32:
        step = float(FLOAT32.eps) * max_stored_coordinate + float(FLOAT32.smallest_subnormal)
        coordinate_error += step
    # A vertex of up to 3 coordinates is off by less than 2 coordinate errors. `halve_chords` keeps
    # half of this tolerance for rounding: twice the sum of the errors of vertices and nets.
    return 4 * (2 * coordinate_error + _bound_rounding(pieces, MAX_HALVINGS))


def halve_chords(
    pieces: CurvePieces, tolerance: float, max_samples: int, *, is_float32: bool, origin: FloatArray
) -> CurveSamples:
    """Samples at dyadic parameters whose chords are within the tolerance of the curve.

    Parameters
    ----------
    tolerance : float
        Model units.
    max_samples : int
        The most samples that are allowed.
    is_float32, origin
        How the samples will be stored: float32 about an origin, or float64.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small` if it is below `least_tolerance`.
    TooLarge
        As soon as more than `max_samples` samples are needed.
    """
    min_tolerance = least_tolerance(pieces, is_float32=is_float32, origin=origin)
    _check_tolerance(tolerance, min_tolerance)
    # Half of the least tolerance is reserved for rounding, of the chord's ends and of the nets.
    allowed = tolerance - min_tolerance / 2
    net = local_nets(pieces)
    block = max(1, CHUNK // net[0].size)
    # (piece, t) of the samples: the end of the curve, and the beginning of every accepted chord.
    samples = [np.array([[pieces.count - 1, 1.0]])]
    count = 1
    stack = [
        (rows, np.zeros(len(rows)), 0, net[rows])
        for rows in np.array_split(np.arange(pieces.count), -(-pieces.count // block))
    ]
    while stack:
        piece, t, depth, nets = stack.pop()
        is_near = (
            bound_chord_deviations(nets, project(nets[:, [0, -1]], -1, pieces.dimension)) <= allowed
        )
        if depth == MAX_HALVINGS:
            is_near[:] = True  # accepted without a proof: `certify_chords` bounds all chords later
        samples.append(np.stack([piece[is_near], t[is_near]], axis=1))
        count += int(is_near.sum())
        remaining = np.flatnonzero(~is_near)
        _check_count(count + 2 * len(remaining), max_samples)
        step = 0.5 ** (depth + 1)
        for rows in (
            np.array_split(remaining, -(-2 * len(remaining) // block)) if len(remaining) else ()
        ):
            halves = np.empty((2, len(rows), *nets.shape[1:]))
            halve(nets[rows].transpose(1, 2, 0), 0, halves.transpose(2, 3, 0, 1))
            half_parameters = np.concatenate([t[rows], t[rows] + step])
            half_pieces = np.concatenate([piece[rows], piece[rows]])
            stack.append((half_pieces, half_parameters, depth + 1, np.concatenate(halves)))
    piece, t = np.concatenate(samples).T
    order = np.lexsort((t, piece))
    return CurveSamples(piece[order].astype(np.intp), t[order])


def _check_tolerance(tolerance: float, min_tolerance: float) -> None:
    """Refuses a tolerance that is not larger than the rounding errors."""
    if tolerance < min_tolerance:
        raise InvalidRequest(
            Issue(
                "tolerance_too_small",
                "The tolerance is below the precision of the numbers in the response.",
                "/tolerance",
                f"{tolerance:.6g}",
                f"at least {min_tolerance:.3g} for this curve in this format",
            )
        )


def _check_count(count: int, max_samples: int) -> None:
    """Refuses a tolerance that needs more samples than are allowed."""
    if count > max_samples:
        raise TooLarge(
            Issue(
                "too_many_vertices",
                "A polyline with this tolerance would have too many points.",
                "/tolerance",
                f"more than {count_nouns(max_samples, 'points')}",
                f"at most {max_samples}",
            )
        )


def certify_chords(
    pieces: CurvePieces, samples: CurveSamples, stored: RealArray, origin: FloatArray
) -> float:
    """Bound of the distance, in model units, from any point of the curve to its stored polyline.

    Parameters
    ----------
    samples : CurveSamples
        In order along the curve.
    stored : ndarray, shape (N, d)
        The samples in the precision of the file, relative to `origin`; the bound includes their
        rounding.
    """
    net = local_nets(pieces)
    vertices = stored.astype(np.float64) + (origin - pieces.middle)
    max_deviation = 0.0
    for rows in row_slices(len(samples) - 1, (pieces.degree + 1) ** 2, CHUNK):
        piece, begin = samples.piece[rows], samples.t[rows]
        following = slice(rows.start + 1, rows.stop + 1)
        end = np.where(samples.piece[following] == piece, samples.t[following], 1.0)
        # Term by term, so that the bound has the same bits on every processor.
        blossoms = build_blossoms(pieces.degree, np.stack([begin, end]))
        nets = np.add.reduce(blossoms[..., np.newaxis] * net[piece][:, np.newaxis], axis=2)
        chords = np.stack([vertices[rows], vertices[following]], axis=1)
        max_deviation = max(max_deviation, float(bound_chord_deviations(nets, chords).max()))
    max_coordinate = float(
        np.abs(vertices).max() + np.abs(pieces.middle).max() + np.abs(origin).max()
    )
    return max_deviation + _bound_rounding(pieces, 2) + 8 * UNIT * max_coordinate


def local_nets(pieces: CurvePieces) -> FloatArray:
    """Control points relative to the middle of the curve, (S, n+1, d).

    For a rational curve they are homogeneous: (w x, …, w), shape (S, n+1, d+1).
    """
    return to_homogeneous(pieces.points - pieces.middle, pieces.weights)


def _bound_rounding(pieces: CurvePieces, cuts: int) -> float:
    """Bound of the rounding error of control points after `cuts` halvings.

    One restriction counts as two halvings.
    """
    low, high = pieces.bounds
    size = float(np.sqrt(((high - low) ** 2).sum()))
    return 2 * UNIT * size * (2 * pieces.degree * cuts + 4)
