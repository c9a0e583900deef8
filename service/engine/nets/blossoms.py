"""Nets of the surface over boxes and triangles of parameters, by blossoming.

A polynomial F of degree (p, q) has a blossom f(u_1 … u_p; v_1 … v_q), symmetric in the u and in the
v, affine in each, with f(u, …, u; v, …, v) = F(u, v). Control points over a box or a triangle are
its values, or means of its values, at the corners, chosen with repetition: products of matrices
with the net. No number in them is negative and every row adds up to one.

Arrays are (m, …), a matrix for each item: NumPy multiplies stacked matrices one by one, so that the
bits of an item do not depend on other items.

Proof in docs/proofs.md: "Nets over boxes and triangles".

References
----------
Ramshaw, Blossoms are polar forms, CAGD 6 (1989); DeRose, Goldman, Hagen and Mann, Functional
composition algorithms via blossoming, ACM TOG 12 (1993).
"""

from functools import lru_cache
from math import comb, prod
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.vectors import BEFORE, NEXT

Exponents: TypeAlias = tuple[int, ...]

SHAPES = (
    ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)),
    ((0.0, 0.0), (1.0, 0.0), (0.5, 1.0)),
    ((0.0, 0.0), (0.0, 1.0), (1.0, 0.5)),
)
"""Corners (u, v) of the usual triangles in the box about them, if the box is [0, 1]²: half of the
box, and the triangles of fans, with a base along u and with a base along v."""


@lru_cache(maxsize=256)
def list_mixtures(arguments: int, degree: int) -> tuple[Exponents, ...]:
    """The multiplicity of each argument in each mixture, in the order of `build_blossoms`.

    A mixture is a choice of `degree` arguments with repetition, in any order. Its last argument
    extends a mixture of the arguments up to that one; mixtures are sorted by their last argument.
    """
    if degree == 0:
        return ((0,) * arguments,)
    shorter = list_mixtures(arguments, degree - 1)
    # The first C(degree − 1 + last, last) mixtures have no argument after `last`.
    return tuple(
        (*mixture[:last], mixture[last] + 1, *mixture[last + 1 :])
        for last in range(arguments)
        for mixture in shorter[: comb(degree - 1 + last, last)]
    )


@lru_cache(maxsize=256)
def _find_parents(arguments: int, degree: int) -> tuple[Ints, Ints]:
    """The shorter mixture that each mixture extends, and the argument that extends it."""
    counts = [comb(degree - 1 + last, last) for last in range(arguments)]
    parent = np.concatenate([np.arange(count) for count in counts])
    return parent, np.repeat(np.arange(arguments), counts)


def build_blossoms(degree: int, arguments: FloatArray) -> FloatArray:
    """Blossoms of the Bernstein polynomials of a degree at all mixtures of some arguments.

    b(t_1 … t_d) of B_i^d is (1 − t_d) b(t_1 … t_{d−1}) of B_i^{d−1} + t_d b(…) of B_{i−1}^{d−1}.

    Parameters
    ----------
    degree : int
        n ≥ 1.
    arguments : ndarray of float64, shape (k, m)
        Each in [0, 1]; 1 − t must be exact, as it is for multiples of 2^-53.

    Returns
    -------
    ndarray of float64, shape (m, mixtures, n+1)
        Row r times the control points of a curve is its blossom at mixture r.
    """
    complements = 1.0 - arguments
    blossoms = np.empty((len(arguments), 2, arguments.shape[1]))
    blossoms[:, 0], blossoms[:, 1] = complements, arguments
    for d in range(2, degree + 1):
        parent, last = _find_parents(len(arguments), d)
        shorter = blossoms.take(parent, axis=0)
        blossoms = np.empty((len(parent), d + 1, arguments.shape[1]))
        np.multiply(shorter, complements.take(last, axis=0)[:, np.newaxis], out=blossoms[:, :d])
        blossoms[:, d] = 0.0
        shorter *= arguments.take(last, axis=0)[:, np.newaxis]
        blossoms[:, 1:] += shorter
    return np.ascontiguousarray(blossoms.transpose(2, 0, 1))


def restrict(nets: FloatArray, corners: FloatArray) -> FloatArray:
    """Nets over boxes of parameters, or blossoms at mixtures of more than two corners.

    Parameters
    ----------
    nets : ndarray of float64, shape (m, D, p+1, q+1)
        D is 3, or 4 with weights.
    corners : ndarray of float64, shape (k, 2, m)
        For each net k arguments along u, and k along v: with k = 2 two opposite corners of a box.

    Returns
    -------
    ndarray of float64, shape (m, D, U, V)
        Blossoms at the U mixtures of arguments along u and the V along v; for k = 2, U = p + 1 and
        V = q + 1.
    """
    p, q, count = nets.shape[2] - 1, nets.shape[3] - 1, corners.shape[2]
    if p == q:  # one call for both directions is faster than two
        along = build_blossoms(p, np.concatenate([corners[:, 0], corners[:, 1]], axis=1))
        return apply_along(nets, along[:count], along[count:])
    return apply_along(nets, build_blossoms(p, corners[:, 0]), build_blossoms(q, corners[:, 1]))


def apply_along(nets: FloatArray, along_u: FloatArray, along_v: FloatArray) -> FloatArray:
    """Nets (m, D, p+1, q+1) times matrices (m, U, p+1) and (m, V, q+1): (m, D, U, V)."""
    size, p1, q1 = nets.shape[1:]
    lines = nets.reshape(-1, size * p1, q1) @ along_v.swapaxes(1, 2)
    return along_u[:, np.newaxis] @ lines.reshape(len(lines), size, p1, -1)


def build_triangle_nets(
    nets: FloatArray, parameters: FloatArray, *, ordered: bool = True
) -> FloatArray:
    """Nets (m, D, N) over triangles of parameters; the order of their N points: `list_exponents`.

    Parameters
    ----------
    nets : ndarray of float64, shape (m, D, p+1, q+1)
    parameters : ndarray of float64, shape (3, 2, m)
        The corners (u_k, v_k) of the triangles.
    ordered : bool
        Whether a net must have its corners in the order of `parameters`. Otherwise triangles with
        one of the `SHAPES` in their boxes get their nets, with corners in the order of `SHAPES`,
        from the nets over these boxes. That is faster, because these have fewer points than
        blossoms of three corners.
    """
    p, q = nets.shape[2] - 1, nets.shape[3] - 1
    if ordered:
        return _flatten(restrict(nets, parameters)) @ _build_triangle_shares(p, q)
    shape, boxes = _find_shapes(parameters)
    is_other = shape == len(SHAPES)
    usual, other = (~is_other).nonzero()[0], is_other.nonzero()[0]
    if not len(usual):
        return _flatten(restrict(nets, parameters)) @ _build_triangle_shares(p, q)
    triangles = np.empty((*nets.shape[:2], comb(p + q + 2, 2)))
    if len(other):
        other_nets = _flatten(restrict(nets.take(other, axis=0), parameters.take(other, axis=2)))
        triangles[other] = other_nets @ _build_triangle_shares(p, q)
    if len(usual):
        box_nets = _flatten(restrict(nets.take(usual, axis=0), boxes.take(usual, axis=2)))
        for number in np.bincount(shape[usual]).nonzero()[0].tolist():
            chosen = (shape[usual] == number).nonzero()[0]
            triangles[usual[chosen]] = box_nets.take(chosen, axis=0) @ _build_box_shares(
                p, q, number
            )
    return triangles


def _flatten(blossoms: FloatArray) -> FloatArray:
    """Blossoms (m, D, U, V) as rows (m, D, U V)."""
    return blossoms.reshape(*blossoms.shape[:2], -1)


def _find_shapes(parameters: FloatArray) -> tuple[Ints, FloatArray]:
    """The shapes (m,) of triangles (3, 2, m), and boxes (2, 2, m) about them.

    A shape is a number in `SHAPES`, or `len(SHAPES)` for all other triangles. A box is given by two
    opposite corners. The triangle has the corners in `SHAPES` if these two are (0, 0) and (1, 1).
    """
    after, before = parameters.take(NEXT, axis=0), parameters.take(BEFORE, axis=0)
    # For each corner and coordinate: whether it is that of the corner after, or of the one before;
    # whether these two agree; whether it is half-way between them.
    same_after, same_before, level = parameters == after, parameters == before, after == before
    halfway = 2.0 * parameters == after + before
    # Axes: the shape, the tip (the corner at the right angle, or opposite the base), the triangle.
    fits = np.empty((len(SHAPES), *same_after[:, 0].shape), dtype=bool)
    fits[0] = (same_after & same_before[:, ::-1]).any(axis=1)
    fits[1], fits[2] = level[:, 1] & halfway[:, 0], level[:, 0] & halfway[:, 1]
    fits = fits.reshape(-1, fits.shape[2])
    row = fits.argmax(axis=0)
    every = np.arange(len(row))
    shape, tip_number = np.where(fits[row, every], row // 3, len(SHAPES)), row % 3
    # The tip, the corner after it and the corner before it: shape (2, m) each.
    tip, one, two = (corners[tip_number, :, every].T for corners in (parameters, after, before))
    # The box about a right triangle goes from the tip to the opposite corner, that about a triangle
    # of a fan from the beginning of the base to the opposite corner.
    is_right = shape == 0
    boxes = np.empty((2, *tip.shape))
    boxes[0] = np.where(is_right, tip, one)
    boxes[1, 0] = np.where(is_right, one[0] + two[0] - tip[0], np.where(shape == 1, two[0], tip[0]))
    boxes[1, 1] = np.where(is_right, one[1] + two[1] - tip[1], np.where(shape == 1, tip[1], two[1]))
    return shape, boxes


@lru_cache(maxsize=256)
def list_exponents(degree: int) -> tuple[Exponents, ...]:
    """(i, j, k) of the points of a triangular net, in its order."""
    return tuple((degree - j - k, j, k) for k in range(degree + 1) for j in range(degree + 1 - k))


@lru_cache(maxsize=64)
def _build_triangle_shares(p: int, q: int) -> FloatArray:
    """The matrix (U V, N) from blossoms (u, v) of a surface to the points of a triangle's net.

    A point is a mean of blossoms; an entry is the share of one blossom in one point.
    """
    along_u, along_v = list_mixtures(3, p), list_mixtures(3, q)
    column = {key: number for number, key in enumerate(list_exponents(p + q))}
    shares = np.zeros((len(along_u), len(along_v), len(column)))
    # Of all C(p + q, p) choices of the p corners that give their u, out of the p + q dealt corners,
    # `ways` take the corners a along u, and leave the corners b along v (a, b: multiplicities).
    for j, b in enumerate(along_v):
        for i, a in enumerate(along_u):
            both = tuple(x + y for x, y in zip(a, b, strict=True))
            ways = prod(comb(n, k) for n, k in zip(both, a, strict=True))
            shares[i, j, column[both]] = ways / comb(p + q, p)
    matrix = shares.reshape(-1, len(column))
    matrix.flags.writeable = False
    return matrix


@lru_cache(maxsize=64)
def _build_box_shares(p: int, q: int, shape: int) -> FloatArray:
    """The matrix ((p+1)(q+1), N) from the net over a box to the net over a triangle in it."""
    u, v = np.array(SHAPES[shape]).T[..., np.newaxis]
    along_u, along_v = build_blossoms(p, u), build_blossoms(q, v)
    matrix: FloatArray = np.kron(along_u[0], along_v[0]).T @ _build_triangle_shares(p, q)
    matrix.flags.writeable = False
    return matrix
