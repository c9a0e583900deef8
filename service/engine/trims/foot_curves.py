"""Parameter curves through the foot points of curves of space, as ordinary splines.

On a plane the curve of foot points is the affine image of the curve itself: of its control points,
with its weights and knots. On other surfaces it is interpolated: a *piece* is the polynomial of
degree n through the foot points at n + 1 Chebyshev–Lobatto nodes (1 − cos πk/n) / 2. Pieces begin
as the spans of the curve, cut where it passes near a pole (`foot_passes`). Where a piece is further
than `goal` from the foot points between its nodes, it is divided: at the parameter at which it
crosses a knot line of the surface, because foot points have only as many derivatives as the
surface, and otherwise in the middle.

The result does not depend on the tolerance of any mesh.

References
----------
Trefethen, Approximation Theory and Approximation Practice, chapters 2 and 5.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import find_begins
from service.cancellation import checkpoint
from service.engine.trims.closure import AT_POLE, ClosedSurfaces
from service.engine.trims.foot_cuts import divide_pieces
from service.engine.trims.foot_pieces import (
    DEGREE,
    CurvesOnFaces,
    Pieces,
    begin_pieces,
    find_node_feet,
    list_nodes,
    measure_excess,
    place_curves,
    to_bezier,
)
from service.engine.trims.foot_tables import FirstGuesses
from service.engine.trims.piecewise import join_spans
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.vectors import Items

DEPTH = 10
"""No piece is divided that is shorter than 2^-DEPTH of its curve's domain (`Pieces.size`)."""

KEPT = 0.5
"""A short piece ends, if its excess is above this share of that of the piece of which it is a part:
then the edge is off the surface, or the surface is folded."""

SHORT = 1 / 16
"""Pieces below this share of the domain are short."""

MOST = 512
"""A curve ends, as it is then, when its pieces are this many more than it began with. Without this
each cut of a curve whose feet jump could make 1024 pieces."""


@dataclass(frozen=True, eq=False, slots=True)
class _Done(Items):
    """m finished pieces, with their ends and their control points (n + 1, 2, m)."""

    curve: Ints
    low: FloatArray
    high: FloatArray
    points: FloatArray


def fit_feet(
    surfaces: ClosedSurfaces, face: Ints, curves: Splines, guesses: FirstGuesses, goal: float
) -> Splines:
    """The parameter curves of the foot points of curves on the surfaces of faces.

    Parameters
    ----------
    face : ndarray of int, shape (n,)
        The face of each curve.
    curves : Splines
        n curves of space.
    guesses : FirstGuesses
        First guesses.
    goal : float
        The greatest distance that interpolation may add. Ends of curves that are nearer to a pole
        than a hundred times this are at it. Model units.
    """
    work = place_curves(surfaces, face, curves, AT_POLE * goal)
    pieces, feet = begin_pieces(work, guesses)
    straight = _find_straight(work, pieces, feet, goal)
    done = _make_lines(work, pieces, feet, straight)
    is_bent = np.ones(len(curves), bool)
    is_bent[straight] = False
    is_left = is_bent[pieces.curve]
    pieces, feet = pieces.take(is_left), feet[..., is_left]
    most = MOST + np.bincount(pieces.curve, minlength=len(curves))
    while len(pieces.curve):
        checkpoint()
        points = np.einsum("ij,jkm->ikm", to_bezier(), feet)
        excess = measure_excess(work, pieces, points)
        share = (pieces.high - pieces.low) / pieces.size
        is_done = (excess <= goal) | (share < 2.0**-DEPTH)
        is_done |= (excess > KEPT * pieces.excess) & (share < SHORT)
        is_done |= (np.bincount(pieces.curve, minlength=len(curves)) > most)[pieces.curve]
        done.append(_Done(pieces.curve, pieces.low, pieces.high, points).take(is_done))
        left = ~is_done
        pieces = divide_pieces(work, pieces.take(left), points[..., left], excess[left])
        if len(pieces.curve):
            feet = find_node_feet(work, pieces)
    return _join(done)


def project_to_planes(surfaces: ClosedSurfaces, face: Ints, curves: Splines) -> Splines:
    """The curves of foot points of curves on planes: affine images, with their own weights."""
    corner = surfaces.low[face]
    origin, su, sv = surfaces.evaluate_partials(face, corner)
    uu, uv, vv = (np.einsum("ij,ij->i", a, b) for a, b in ((su, su), (su, sv), (sv, sv)))
    determinant = uu * vv - uv * uv
    dual_u = (vv[:, np.newaxis] * su - uv[:, np.newaxis] * sv) / determinant[:, np.newaxis]
    dual_v = (uu[:, np.newaxis] * sv - uv[:, np.newaxis] * su) / determinant[:, np.newaxis]
    spans = curves.list_spans()
    nets = []
    for rows, net in curves.restrict(spans):
        owner = spans.curve[rows]
        weights = net[..., 3:] if net.shape[-1] == 4 else np.ones((*net.shape[:2], 1))
        rest = net[..., :3] - weights * origin[owner][:, np.newaxis]
        u, v = (np.einsum("ijk,ik->ij", rest, dual[owner]) for dual in (dual_u, dual_v))
        image = np.stack([u, v], axis=2) + weights * corner[owner][:, np.newaxis]
        nets.append((rows, np.concatenate([image, weights], 2) if net.shape[-1] == 4 else image))
    return join_spans(2, spans, nets)


def _find_straight(work: CurvesOnFaces, pieces: Pieces, feet: FloatArray, goal: float) -> Ints:
    """The curves whose feet move uniformly along a segment, up to a tenth of `goal`.

    Feet (n + 1, 2, m) are those at the nodes of all spans.
    """
    curves, curve = work.curves, pieces.curve
    t = pieces.list_parameters(list_nodes())
    begins = find_begins(curve)
    ends = np.append(begins[1:], len(curve)) - 1
    start, stop = feet[0][:, begins][:, curve], feet[-1][:, ends][:, curve]
    share = (t - curves.start[curve]) / (curves.end - curves.start)[curve]
    line = start + share[:, np.newaxis] * (stop - start)
    is_near = np.abs(line - feet) <= 1e-6 * work.surfaces.period[work.face[curve]].T
    candidates = np.logical_and.reduceat(is_near.all(axis=(0, 1)), begins)
    rows = candidates[curve].nonzero()[0]
    is_straight = np.zeros(len(curve), bool)
    owner = np.tile(curve[rows], DEGREE - 1)
    places = line[1:-1][..., rows].transpose(0, 2, 1).reshape(-1, 2)
    error = work.measure(owner, t[1:-1][:, rows].ravel(), places).reshape(DEGREE - 1, -1)
    is_straight[rows] = (error <= 0.1 * goal).all(axis=0)
    straight: Ints = np.logical_and.reduceat(is_straight, begins).nonzero()[0]
    return straight


def _make_lines(work: CurvesOnFaces, pieces: Pieces, feet: FloatArray, chosen: Ints) -> list[_Done]:
    """Segments from the first foot to the last of the chosen curves, as pieces of degree 1."""
    if not len(chosen):
        return []
    begins = np.searchsorted(pieces.curve, chosen)
    ends = np.searchsorted(pieces.curve, chosen, side="right") - 1
    points = np.array([feet[0][:, begins], feet[-1][:, ends]])
    return [_Done(chosen, work.curves.start[chosen], work.curves.end[chosen], points)]


def _join(parts: list[_Done]) -> Splines:
    """Splines from finished pieces of all curves."""
    curve = np.concatenate([part.curve for part in parts])
    low = np.concatenate([part.low for part in parts])
    high = np.concatenate([part.high for part in parts])
    order = np.lexsort((low, curve))
    place = np.empty(len(order), np.intp)
    place[order] = np.arange(len(order))
    nets, first = [], 0
    for part in parts:
        rows = place[first : first + len(part.curve)]
        nets.append((rows, part.points.transpose(2, 0, 1)))
        first += len(part.curve)
    intervals = Intervals(
        curve[order], curve[order], low[order], high[order], np.zeros(len(order), np.intp)
    )
    return join_spans(2, intervals, nets)
