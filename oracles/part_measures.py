"""Areas, volumes and first moments of parts, by Green's theorem on loops and the rule of Gauss.

    ∬ g du dv = −∮ H du,   H(u, v) = ∫ g(u, s) ds, from the lowest v of the region,

and the same with u and v exchanged where only v is closed, so that seams, along which the outer
parameter does not change, need not be in the loops. Where a parameter curve is further from its
edge than the uncertainty of the document, the loop runs along the points of the surface that are
nearest to the edge.

The errors are those of the rule: all is computed with pieces and with halves of pieces.
"""

from typing import NamedTuple

import numpy as np

from oracles.brep_documents import Array, Long, Spline
from oracles.brep_partials import evaluate_curve, evaluate_surface
from oracles.coedges import iterate_coedges, read_edge
from oracles.loop_nodes import GUESS, divide_curve, list_nodes, place_nodes
from oracles.parts import Document, Face, Part

PIECES = 1
"""Pieces of a span, at first."""

AT_A_TIME = 40_000
"""Points of a surface that are evaluated together."""


class Measured(NamedTuple):
    """Area, volume and first moments (x, y, z) about an origin, (5,), and errors (5,).

    The volume of a closed part is that inside of its faces and of the strips between these and the
    edges; an open part has the volumes of the cones from the origin to its faces and strips.
    """

    values: Array
    errors: Array


def measure_part(part: Part, origin: Array) -> Measured:
    """The measures of all faces of a part together."""
    coarse, fine = (
        sum(_measure_face(face, origin, pieces) for face in part.faces)
        for pieces in (PIECES, 2 * PIECES)
    )
    return Measured(np.asarray(fine), np.abs(fine - coarse))


def _measure_face(face: Face, origin: Array, pieces: int) -> Array:
    """Measures (5,) of a face."""
    entry: Document = {} if face.document is None else face.document["faces"][face.number]
    outer = 1 if face.periods[1] > 0 and not face.periods[0] > 0 else 0
    # Outer loops run counter-clockwise: towards greater v where u is greatest.
    sign = -1.0 if outer == 0 else 1.0
    total, turns = np.zeros(5, np.longdouble), 0.0
    for nodes, weights in list_nodes(face, entry, outer, pieces):
        total += sign * _integrate(face, (nodes, weights), outer, origin, pieces)
        turns += float(weights.sum())
    low, high = face.domain
    # A loop around the surface has its material up to the next one, or to the border.
    is_open_above = -sign * turns > 0.5 * (high - low)[outer]
    if is_open_above or total[0] < 0 or not entry.get("loops"):
        ends = np.stack([low, high])
        ends[:, 1 - outer] = high[1 - outer]
        knots = face.net.knots[outer]
        degree = face.net.degree[outer]
        inner = knots[degree : len(knots) - degree]
        places = ends[0] + ((inner - low[outer]) / np.ptp(face.domain[:, outer]))[:, np.newaxis] * (
            ends[1] - ends[0]
        )
        spline = Spline(
            1, np.concatenate([inner[:1], inner, inner[-1:]]), places, np.ones(len(inner))
        )
        nodes, rates, steps = divide_curve(face, spline, pieces)
        weights = rates[:, outer] * steps
        total += _integrate(face, (nodes, weights), outer, origin, pieces)
    total[1:] += _measure_strips(face, entry, origin, pieces)
    flips = bool(entry.get("reversed")) + (np.linalg.det(face.matrix[:3, :3]) < 0)
    if flips % 2:
        total[1:] *= -1
    return total.astype(np.float64)


def _measure_strips(face: Face, entry: Document, origin: Array, pieces: int) -> Long:
    """Volume and moments (4,) of the strips between the parameter curves of a face and its edges.

    A strip consists of the lines between points of both at equal parameters.
    """
    total = np.zeros(4, np.longdouble)
    x, w = np.polynomial.legendre.leggauss(4)
    for loop in entry.get("loops") or []:
        if face.document is None or not loop.get("edges"):
            continue
        coedges = iterate_coedges(face.document, entry, loop, face.net, GUESS)
        for coedge, edge in zip(coedges, loop["edges"], strict=True):
            if coedge.is_traced or face.document["edges"][edge].get("degenerate"):
                continue
            space, (first, last) = read_edge(face.document, edge), coedge.curve.domain
            low, high = space.domain
            knots = first + (space.knots - low) * ((last - first) / (high - low))
            knots = np.concatenate([knots, coedge.curve.knots])
            t, steps = place_nodes(np.unique(np.clip(knots, first, last)), pieces)
            places, rates = evaluate_curve(coedge.curve, t)
            on_face, partials = evaluate_surface(
                face.net, face.move_inside(places.astype(np.float64))
            )
            along_face = np.einsum("mk,mki->mi", rates, partials)
            share = np.clip(low + (t - first) * ((high - low) / (last - first)), low, high)
            on_edge, along_edge = evaluate_curve(space, share)
            along_edge = along_edge * ((high - low) / (last - first))
            turn = face.matrix[:3, :3].T.astype(np.longdouble)
            for s, weight in zip((1 + x) / 2, w / 2, strict=True):
                point = ((1 - s) * on_face + s * on_edge) @ turn + face.matrix[:3, 3] - origin
                along = ((1 - s) * along_face + s * along_edge) @ turn
                normal = np.cross((on_edge - on_face) @ turn, along)
                values = np.column_stack([(point * normal).sum(axis=1) / 3, point**2 * normal / 2])
                sign = -1.0 if coedge.is_reversed else 1.0
                total += sign * weight * (steps[:, np.newaxis] * values).sum(axis=0)
    return total


def _integrate(
    face: Face, nodes: tuple[Array, Long], outer: int, origin: Array, pieces: int
) -> Long:
    """Σ weights · H (5,) at nodes: places (m, 2) and weights (m,). H are the inner integrals."""
    (places, weights), inner = nodes, 1 - outer
    low = face.box[0, inner]
    knots = face.net.knots[inner]
    breaks = np.unique(np.append(knots[(knots > low) & (knots < places[:, inner].max())], low))
    total = np.zeros(5, np.longdouble)
    for begin, end in zip(breaks, [*breaks[1:], np.inf], strict=True):
        rows = np.flatnonzero(places[:, inner] > begin)
        x, w = place_nodes(np.array([0.0, 1.0]), pieces)
        for first in range(0, len(rows), max(1, AT_A_TIME // len(x))):
            some = rows[first : first + max(1, AT_A_TIME // len(x))]
            length = np.minimum(places[some, inner], end) - begin
            at = np.empty((len(some), len(x), 2))
            at[..., outer] = places[some, outer][:, np.newaxis]
            at[..., inner] = begin + length[:, np.newaxis] * x
            values = _list_integrands(face, at.reshape(-1, 2), origin).reshape(*at.shape[:2], 5)
            lines = np.einsum("mnk,n->mk", values, w) * length[:, np.newaxis]
            total += (weights[some, np.newaxis] * lines).sum(axis=0)
    return total


def _list_integrands(face: Face, places: Array, origin: Array) -> Long:
    """The integrands (m, 5): |N|, (S − o) · N / 3, (S − o)² N / 2, where N = S_u × S_v."""
    point, partials = evaluate_surface(face.net, places, is_long=False)
    turn = face.matrix[:3, :3].T.astype(np.longdouble)
    offset = point @ turn + face.matrix[:3, 3] - origin
    normal = np.cross(partials[:, 0] @ turn, partials[:, 1] @ turn)
    area = np.sqrt((normal * normal).sum(axis=1, keepdims=True))
    volume = (offset * normal).sum(axis=1, keepdims=True) / 3
    return np.concatenate([area, volume, offset**2 * normal / 2], axis=1)
