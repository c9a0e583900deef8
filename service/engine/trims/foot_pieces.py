"""Pieces of curves of foot points: nodes, feet at the nodes, and the continuation to poles."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.foot_passes import PoleCuts
from service.engine.trims.foot_tables import FirstGuesses
from service.engine.trims.inversion import find_feet, measure_errors
from service.engine.trims.splines import Splines
from service.engine.vectors import Items

DEGREE = 7
"""n of the pieces."""

ALLOWED = 0.01
"""Interpolated feet may be off by this share of their distance from the curve."""


@dataclass(frozen=True, eq=False)
class CurvesOnFaces:
    """n curves of space, each with the surface of the face near which it runs.

    Attributes
    ----------
    surfaces : ClosedSurfaces
    face : ndarray of int, shape (n,)
    curves : Splines
    pole_axes : ndarray of int, shape (2, n)
        The axis of the side with the pole at which each curve begins, and ends; −1 if there is
        none.
    pole_sides : ndarray of float64, shape (2, n)
        The parameter of that side along this axis.
    """

    surfaces: ClosedSurfaces
    face: Ints
    curves: Splines
    pole_axes: Ints
    pole_sides: FloatArray

    def find_feet(self, curve: Ints, t: FloatArray, guess: FloatArray) -> FloatArray:
        """Foot points (m, 2) of points of curves (m,) at t (m,)."""
        face = self.face[curve]
        feet = find_feet(self.surfaces, face, self.curves.evaluate(curve, t), guess)[0]
        if not self.surfaces.is_pole[face].any():
            return feet
        # Near a pole a step of Newton's method may be several periods long.
        period = self.surfaces.period[face]
        turns = np.where(self.surfaces.is_closed[face], np.rint((guess - feet) / period), 0.0)
        return feet + turns * period

    def measure(self, curve: Ints, t: FloatArray, feet: FloatArray) -> FloatArray:
        """How far parameters (m, 2) are from the feet of curves (m,) at t (m,), in space.

        A hundredth of the distance from the curve is subtracted: where that is far from the
        surface, feet need not be closer.
        """
        points = self.curves.evaluate(curve, t)
        error, distance = measure_errors(self.surfaces, self.face[curve], points, feet)
        return error - ALLOWED * distance


@dataclass(frozen=True, eq=False, slots=True)
class Pieces(Items):
    """m pieces of curves that are to be interpolated.

    Attributes
    ----------
    curve : ndarray of int, shape (m,)
    low, high : ndarray of float64, shape (m,)
        Their ends.
    size : ndarray of float64, shape (m,)
        The length with which that of a piece is compared: that of its curve's domain, and for
        curves that are cut for a pole, that of the first piece of which it is a part.
    excess : ndarray of float64, shape (m,)
        The `excess` of the piece of which each is a part, as `measure_excess` tells it.
    first, last : ndarray of float64, shape (2, m)
        The feet at the ends.
    inner : ndarray of float64, shape (n − 1, 2, m)
        Guesses at the inner nodes.
    """

    curve: Ints
    low: FloatArray
    high: FloatArray
    size: FloatArray
    excess: FloatArray
    first: FloatArray
    last: FloatArray
    inner: FloatArray

    def list_parameters(self, shares: FloatArray) -> FloatArray:
        """Parameters (r, m) at shares (r,) of the pieces."""
        return self.low + (self.high - self.low) * shares[:, np.newaxis]


@cache
def list_nodes() -> FloatArray:
    """The n + 1 nodes, from 0 to 1."""
    return (1.0 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)) / 2


@cache
def list_checks() -> FloatArray:
    """A parameter between any two neighbouring nodes, (n,)."""
    return (1.0 - np.cos(np.pi * (np.arange(DEGREE) + 0.5) / DEGREE)) / 2


@cache
def to_bezier() -> FloatArray:
    """The matrix from values at the nodes to Bézier points; its end rows are exact."""
    matrix = np.asarray(np.linalg.inv(bernstein(DEGREE, list_nodes())), np.float64)
    matrix[0], matrix[-1] = np.eye(DEGREE + 1)[0], np.eye(DEGREE + 1)[-1]
    return matrix


@cache
def _extrapolation(drop_first: bool, drop_last: bool) -> FloatArray:
    """Weights (2, n + 1) of the values at inner nodes for the values at the first and last node."""
    used = np.arange(int(drop_first), DEGREE + 1 - int(drop_last))
    x = list_nodes()
    weights = np.zeros((2, DEGREE + 1))
    for row, target in enumerate((x[0], x[-1])):
        for k in used:
            others = used[used != k]
            weights[row, k] = np.prod((target - x[others]) / (x[k] - x[others]))
    return weights


def place_curves(
    surfaces: ClosedSurfaces, face: Ints, curves: Splines, tolerance: float
) -> CurvesOnFaces:
    """Curves, with the poles at which they begin or end up to a tolerance."""
    number = np.arange(len(face))
    axes, sides = np.full((2, len(face)), -1), np.zeros((2, len(face)))
    if surfaces.is_pole[face].any():
        both = np.array([surfaces.low, surfaces.surfaces.high])
        for k, t in enumerate((curves.start, curves.end)):
            axes[k], end = surfaces.find_poles(face, curves.evaluate(number, t), tolerance)
            sides[k] = both[end, face, axes[k]]
    return CurvesOnFaces(surfaces, face, curves, axes, sides)


def begin_pieces(work: CurvesOnFaces, guesses: FirstGuesses) -> tuple[Pieces, FloatArray]:
    """The first pieces of the curves, with the feet at their nodes as from `find_node_feet`.

    These are the spans, cut where curves pass near poles.
    """
    curves = work.curves
    owner, breaks = _list_breaks(curves, guesses.cuts)
    begin = (owner[1:] == owner[:-1]).nonzero()[0]
    own, low, high = owner[begin], breaks[begin], breaks[begin + 1]
    inner_nodes = list_nodes()[1:-1]
    t = low + (high - low) * inner_nodes[:, np.newaxis]
    # Breaks and nodes together.
    curve = np.concatenate([owner, np.tile(own, len(inner_nodes))])
    parameters = np.concatenate([breaks, t.ravel()])
    guess = guesses.guess(curve, parameters)
    found = work.find_feet(curve, parameters, guess)
    feet, guess = found[: len(owner)], guess[: len(owner)]
    every = np.arange(len(curves))
    for k in range(2):
        at = np.searchsorted(owner, every + k) - k  # the first and the last break
        rows = (work.pole_axes[k] >= 0).nonzero()[0]
        feet[at[rows]] = guess[at[rows]]
        feet[at[rows], work.pole_axes[k, rows]] = work.pole_sides[k, rows]
    inner = found[len(owner) :].reshape(len(inner_nodes), -1, 2).transpose(0, 2, 1)
    is_cut = np.zeros(len(curves), bool)
    is_cut[guesses.cuts.curve] = True
    size = np.where(is_cut[own], high - low, (curves.end - curves.start)[own])
    infinite = np.full(len(own), np.inf)
    pieces = Pieces(own, low, high, size, infinite, feet[begin].T, feet[begin + 1].T, inner)
    return pieces, _continue_to_poles(work, pieces, _join_ends(pieces, inner))


def _list_breaks(curves: Splines, cuts: PoleCuts) -> tuple[Ints, FloatArray]:
    """The curves, ascending, and the parameters of all breaks and cuts, (b,)."""
    owner = np.repeat(np.arange(len(curves)), curves.span_count + 1)
    if not len(cuts.curve):
        return owner, curves.breaks
    owner = np.concatenate([owner, cuts.curve])
    breaks = np.concatenate([curves.breaks, cuts.t])
    order = np.lexsort((breaks, owner))
    owner, breaks = owner[order], breaks[order]
    is_new = np.append(True, (np.diff(owner) != 0) | (np.diff(breaks) > 0))
    return owner[is_new], breaks[is_new]


def find_node_feet(work: CurvesOnFaces, pieces: Pieces) -> FloatArray:
    """Feet (n + 1, 2, m) at the nodes of pieces."""
    count = DEGREE - 1
    t = pieces.list_parameters(list_nodes()[1:-1])
    guess = pieces.inner.transpose(0, 2, 1).reshape(-1, 2)
    inner = work.find_feet(np.tile(pieces.curve, count), t.ravel(), guess)
    inner = inner.reshape(count, -1, 2).transpose(0, 2, 1)
    return _continue_to_poles(work, pieces, _join_ends(pieces, inner))


def _join_ends(pieces: Pieces, inner: FloatArray) -> FloatArray:
    """The feet (n + 1, 2, m) at all nodes from those at inner nodes (n − 1, 2, m)."""
    return np.concatenate([pieces.first[np.newaxis], inner, pieces.last[np.newaxis]])


def measure_excess(work: CurvesOnFaces, pieces: Pieces, points: FloatArray) -> FloatArray:
    """How far (m,) pieces are from the feet of their curves between the nodes.

    Parameters
    ----------
    points : ndarray of float64, shape (n + 1, 2, m)
        Control points of the pieces.
    """
    shares = list_checks()
    feet = np.einsum("ij,jkm->imk", bernstein(DEGREE, shares), points)
    t = pieces.list_parameters(shares)
    error = work.measure(np.tile(pieces.curve, len(shares)), t.ravel(), feet.reshape(-1, 2))
    excess: FloatArray = error.reshape(len(shares), -1).max(axis=0)
    return excess


def _continue_to_poles(work: CurvesOnFaces, pieces: Pieces, feet: FloatArray) -> FloatArray:
    """Feet (n + 1, 2, m); at poles the free parameter continues that of the other nodes."""
    if (work.pole_axes < 0).all():
        return feet
    curve = pieces.curve
    first = np.where(pieces.low == work.curves.start[curve], work.pole_axes[0, curve], -1)
    last = np.where(pieces.high == work.curves.end[curve], work.pole_axes[1, curve], -1)
    feet = feet.copy()
    for drop_first, drop_last in ((True, False), (False, True), (True, True)):
        rows = (((first >= 0) == drop_first) & ((last >= 0) == drop_last)).nonzero()[0]
        if not len(rows):
            continue
        ends = np.einsum("ij,jkm->ikm", _extrapolation(drop_first, drop_last), feet[..., rows])
        every = np.arange(len(rows))
        if drop_first:
            feet[0, 1 - first[rows], rows] = ends[0, 1 - first[rows], every]
        if drop_last:
            feet[-1, 1 - last[rows], rows] = ends[1, 1 - last[rows], every]
    return feet
