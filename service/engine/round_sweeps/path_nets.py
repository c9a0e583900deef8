"""Nets of the path of a sweep on cells: its direction, its velocity, its weights and its spread.

The direction of a piece C of degree n with weights w is that of the polynomial

    V = n (a B − b A),   a_i = w_i,   b_i = w_{i+1},
    A_i = w_i (P_i − P_0),   B_i = w_{i+1} (P_{i+1} − P_0)

of degree 2n − 2, and C′ = V / w². Without weights V = C′, of degree n − 1. Where V has zeros at an
end of the piece because control points repeat, V = tᵏ (1 − t)ˡ D with another polynomial D, which
has the direction of the path there too.

Source of the products: Farouki and Rajan, Algorithms for polynomials in Bernstein form, CAGD 5
(1988). Proof in docs/proofs.md: "Turns of a path".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import binomials, elevation_matrix, multiply
from service.bases.polynomials import restrict, restriction_matrices
from service.engine.curves.evaluation import CurveSamples, evaluate_tangents
from service.engine.nets.subdivision import halve
from service.engine.sweeps.profiles import MIN_SINE
from service.engine.vectors import UNIT, Items, cross, dot, length, normalize
from service.surface.curve_model import CurvePieces, Ribbon, SweepModel, to_space

STRAIGHT = 2.0**-40
"""A piece is straight if no control point of its velocity is further from the direction of its
chord than this angle."""


@dataclass(frozen=True, eq=False, slots=True)
class PathNets(Items):
    """Cells of the path: intervals of pieces, with the nets over them.

    Attributes
    ----------
    piece : ndarray of int, shape (M,)
    first, width : ndarray of float64, shape (M,)
        The cell is the interval [first, first + width] of the piece's parameter t.
    directions, velocities : ndarray of float64, shape (m+1, 3, M)
        The nets of D, in units of the piece, and of V, in units of the model (`find_unit`).
    weights : ndarray of float64, shape (n+1, M), or (1, M) without weights
    spread : ndarray of float64, shape (k+1, M)
        The net of the radius, or of half the width, in units of the model.
    crossbars : ndarray of float64, shape (j+1, 3, M)
        Nets with the directions of the crossbars of ribbons; (1, 3, M) zeros for tubes.
    error, crossbar_error : ndarray of float64, shape (M,)
        Bounds of the rounding in each point of `directions` and of `crossbars`.
    """

    piece: Ints
    first: FloatArray
    width: FloatArray
    directions: FloatArray
    velocities: FloatArray
    weights: FloatArray
    spread: FloatArray
    crossbars: FloatArray
    error: FloatArray
    crossbar_error: FloatArray

    def halve(self) -> "PathNets":
        """The halves of all cells: first those at the begin of each cell, then those at its end."""
        count = len(self.piece)

        def split(nets: FloatArray) -> FloatArray:
            halves = np.empty((*nets.shape[:-1], 2, count))
            halve(nets, 0, halves)
            return halves.reshape(*nets.shape[:-1], 2 * count)

        half = self.width / 2
        return PathNets(
            np.tile(self.piece, 2),
            np.concatenate([self.first, self.first + half]),
            np.tile(half, 2),
            split(self.directions),
            split(self.velocities),
            split(self.weights),
            split(self.spread),
            split(self.crossbars),
            np.tile(self.error + 4 * UNIT * len(self.directions), 2),
            np.tile(self.crossbar_error + 4 * UNIT * len(self.crossbars), 2),
        )


@dataclass(frozen=True, eq=False, slots=True)
class Lines:
    """Which pieces of a path are straight, and which of them have ruled sweeps.

    Attributes
    ----------
    chords : ndarray of float64, shape (S, 3)
        Unit vectors from the begins of the pieces to their ends.
    is_straight, is_ruled : ndarray of bool, shape (S,)
        A sweep is ruled if its path is straight, and its spread linear along it.
    slope : ndarray of float64, shape (S,)
        The largest sine of the angle between a straight piece and its chord.
    error : ndarray of float64, shape (S,)
        How far a point of the sweep of a straight piece is from the sweep of its chord at most.
    """

    chords: FloatArray
    is_straight: Bools
    is_ruled: Bools
    slope: FloatArray
    error: FloatArray


def find_unit(model: SweepModel) -> float:
    """A power of two, the unit of `velocities` and `spread`: no square of a size underflows."""
    points = model.pieces.points.reshape(-1, model.pieces.dimension)
    size = max(float(np.ptp(points, axis=0).max()), float(model.profile.spread.max()))
    return float(2.0 ** np.clip(np.frexp(size)[1], -1000, 1000))


def bound_lowering(pieces: CurvePieces) -> float:
    """How far control points of pieces are from those of the curve that was lowered, model units.

    A single piece is the curve itself.
    """
    if pieces.count == 1:
        return 0.0
    return 8 * (pieces.degree + 1) * UNIT * float(np.abs(pieces.points).max())


def find_lines(model: SweepModel) -> Lines:
    """The straight pieces of a path."""
    pieces = model.pieces
    local, _ = _find_local(pieces)
    chords = normalize(local[:, -1], -1)
    steps = np.diff(local, axis=1)
    along = dot(steps, chords[:, None], -1)
    across = length(steps - along[..., None] * chords[:, None], -1)
    # The direction of V is a positive mean of differences P_j − P_i with i < j, so of steps.
    slope = (across / np.where(along > 0, along, 1.0)).max(axis=1)
    is_forwards = ((along > 0) | (length(steps, -1) == 0)).all(axis=1) & ~pieces.is_single
    is_straight = is_forwards & (slope <= STRAIGHT)
    spread = model.profile.spread
    is_linear = pieces.degree == 1 and pieces.weights is None and len(spread) <= 2
    is_constant = bool((spread == spread[0]).all())
    lengths = length(np.diff(to_space(pieces.points), axis=1), -1).sum(axis=1)
    error = 2 * slope * (lengths + model.profile.reach)
    is_ruled = is_straight if is_linear or is_constant else np.zeros_like(is_straight)
    slope, error = (np.where(is_straight, each, 0.0) for each in (slope, error))
    return Lines(chords, is_straight, is_ruled, slope, error)


def build_path_nets(model: SweepModel, lines: Lines, chosen: slice) -> PathNets:
    """The nets of the chosen pieces, each piece one cell.

    The direction of a ruled piece is that of its chord, and of a single point that of the path
    there.
    """
    pieces, unit = model.pieces, find_unit(model)
    piece = np.arange(pieces.count)[chosen]
    local, scale = _find_local(pieces, chosen)
    weights = np.ones((len(piece), 1))
    if pieces.weights is None:
        velocity = pieces.degree * np.diff(local, axis=1)
    else:
        weights = pieces.weights[chosen] / pieces.weights[chosen].max(axis=1, keepdims=True)
        velocity = _multiply_out(local, weights)
    error = _bound_error(pieces, scale)
    direction = _divide_zeros(velocity)
    size = np.abs(direction).max(axis=(1, 2))
    exponent = np.where(size > 0, np.frexp(size)[1], 0)
    direction = direction * 2.0 ** -exponent[:, None, None]
    error = np.where(size > 0, error * 2.0 ** -exponent.astype(np.float64), 0.0)
    for kind, known in ((lines.is_ruled[chosen], lines.chords[chosen]),
                        (pieces.is_single[chosen], None)):  # fmt: skip
        rows = np.flatnonzero(kind)
        if len(rows):
            at_begin = CurveSamples(piece[rows], np.zeros(len(rows)))
            vectors = (
                to_space(evaluate_tangents(pieces, at_begin)) if known is None else known[rows]
            )
            direction[rows] = vectors[:, None]
            error[rows] = 8 * UNIT + lines.slope[chosen][rows]
    spread = np.tile(model.profile.spread, (len(piece), 1))
    if spread.shape[1] > 1 and pieces.count > 1:
        spread = _restrict_spread(model.profile.spread, pieces.breaks, piece)
    crossbars, crossbar_error = np.zeros((len(piece), 1, 3)), np.zeros(len(piece))
    if isinstance(model.profile, Ribbon):
        spread = spread / 2
        crossbars, crossbar_error = _find_crossbars(
            model, chosen, (local, scale, weights), direction, error
        )
    return PathNets(
        piece,
        np.zeros(len(piece)),
        np.ones(len(piece)),
        np.ascontiguousarray(np.moveaxis(direction, 0, -1)),
        np.ascontiguousarray(np.moveaxis(velocity * (scale / unit)[:, None, None], 0, -1)),
        np.ascontiguousarray(weights.T),
        np.ascontiguousarray(spread.T) / unit,
        np.ascontiguousarray(np.moveaxis(crossbars, 0, -1)),
        error,
        crossbar_error,
    )


def _find_crossbars(
    model: SweepModel,
    chosen: slice,
    local: tuple[FloatArray, FloatArray, FloatArray],
    direction: FloatArray,
    error: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Nets (K, j+1, 3) of F × D, the crossbars of a ribbon that faces F, and bounds of their error.

    A ribbon that faces a point X has w F = w X − w C. Nets are in units of their own, and divided
    by their zeros at ends. If F × D vanishes on a piece, its net is 0.
    """
    ribbon = model.profile
    assert isinstance(ribbon, Ribbon)
    points, scale, weights = local
    if ribbon.camera is None:
        assert ribbon.facing is not None
        facing = ribbon.facing / np.abs(ribbon.facing).max()
        nets, error = cross(facing, direction, -1), 2 * error + 8 * UNIT
    else:
        begins = to_space(model.pieces.points[chosen, 0])
        offset = (ribbon.camera - begins) / scale[:, None]
        if model.pieces.weights is None:
            weights = np.ones(points.shape[:2])
        facing = weights[..., None] * (offset[:, None] - points)
        far = np.abs(facing).max(axis=(1, 2))
        lost = (np.abs(begins).max(axis=1) + np.abs(ribbon.camera).max()) / scale
        facing = facing / np.where(far > 0, far, 1.0)[:, None, None]
        nets = _cross_nets(facing, direction)
        lost = 8 * UNIT * lost / np.where(far > 0, far, 1.0)
        error = 4 * error + 4 * (lost + UNIT * 8 * nets.shape[1])
    size = np.abs(nets).max(axis=(1, 2))
    is_zero = size <= np.maximum(MIN_SINE, 4 * error)
    nets[is_zero] = 0.0
    nets = _divide_zeros(nets)
    size = np.where(is_zero, 1.0, np.abs(nets).max(axis=(1, 2)))
    return nets / size[:, None, None], np.where(is_zero, 0.0, error / size)


def _cross_nets(first: FloatArray, second: FloatArray) -> FloatArray:
    """The nets (K, n+m+1, 3) of products of vectors, from nets (K, n+1, 3) and (K, m+1, 3)."""

    def product(i: int, j: int) -> FloatArray:
        return multiply(first[..., i][:, None], second[..., j][:, None])[:, 0]

    axes = ((1, 2), (2, 0), (0, 1))
    return np.stack([product(i, j) - product(j, i) for i, j in axes], axis=-1)


def _restrict_spread(spread: FloatArray, breaks: FloatArray, piece: Ints) -> FloatArray:
    """The nets (K, k+1) of a function over the domain, on K consecutive pieces."""
    ends = (breaks[[piece[0], piece[-1] + 1]] - breaks[0]) / (breaks[-1] - breaks[0])
    part, _ = restrict((spread[:, None], None), *ends.tolist())
    matrices = restriction_matrices(len(spread) - 1, breaks[piece[0] : piece[-1] + 2])
    nets: FloatArray = matrices @ part[:, 0]
    return nets


def _find_local(pieces: CurvePieces, chosen: slice = slice(None)) -> tuple[FloatArray, FloatArray]:
    """Control points (K, n+1, 3) relative to the first of each piece, and their units (K,).

    The units are powers of two, such that no coordinate is above 1.
    """
    points = to_space(pieces.points[chosen])
    local = points - points[:, :1]
    exponent = np.frexp(np.abs(local).max(axis=(1, 2)))[1]
    scale = 2.0 ** np.maximum(exponent, -1000).astype(np.float64)
    return local / scale[:, None, None], scale


def _multiply_out(local: FloatArray, weights: FloatArray) -> FloatArray:
    """The nets (K, 2n−1, 3) of V, of rational pieces."""
    degree = weights.shape[1] - 1
    weighted = weights[..., None] * local
    a, b = weights[:, None, :-1, None], weights[:, None, 1:, None]
    low, high = (
        np.moveaxis(each, -1, 1)[..., None] for each in (weighted[:, :-1], weighted[:, 1:])
    )
    product = degree * (multiply(a, high) - multiply(b, low))[..., 0]
    return np.ascontiguousarray(np.moveaxis(product, 1, -1))


def _bound_error(pieces: CurvePieces, scale: FloatArray) -> FloatArray:
    """Bounds (K,) of the rounding in the nets of V, in units of the pieces.

    A point is a sum of up to 2n products, each of differences of coordinates that are at most 1;
    lowering moves control points.
    """
    count = 2 * pieces.degree + 8
    lowering = bound_lowering(pieces) / scale
    return pieces.degree * (4 * count * UNIT + 4 * lowering)


def _divide_zeros(nets: FloatArray) -> FloatArray:
    """The nets (K, m+1, 3) divided by tᵏ (1 − t)ˡ, the zeros at their ends, in their old degree."""
    is_zero: Bools = (nets == 0).all(axis=2)
    rows = np.flatnonzero((is_zero[:, 0] | is_zero[:, -1]) & ~is_zero.all(axis=1))
    if not len(rows):
        return nets
    nets, degree = nets.copy(), nets.shape[1] - 1
    first, last = (~is_zero[rows]).argmax(axis=1), (~is_zero[rows, ::-1]).argmax(axis=1)
    for k, ending in sorted({*zip(first.tolist(), last.tolist(), strict=True)}):
        same = rows[(first == k) & (last == ending)]
        low, kept = degree - k - ending, slice(k, degree + 1 - ending)
        rest = nets[same, kept] * (binomials(degree)[kept] / binomials(low))[:, None]
        nets[same] = elevation_matrix(low, degree) @ rest
    return nets
