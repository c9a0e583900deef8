"""The cells of edges for rays: chords, and how far the pieces of edges are from these.

A ray is o + t d, and a chord goes from P to Q = P + e. With m = P − o, the point P + s e is at t =
d · m + s d · e, and |(m + s e) × d| from the line of the ray.

Proof in docs/proofs.md: "Rays near edges".
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.engine.bounds.chords import bound_chord_deviations
from service.engine.cells import models as model_rows
from service.engine.cells.tree import CellTree, Table
from service.engine.rays.bounds import Rays
from service.engine.vectors import UNIT, cross, dot, length, project

START, END, BEND, SIZE_A, SIZE_B, ROW_COUNT = 5, 8, 11, 12, 13, 14
"""The rows of a model, after ball and error: the ends of the chord, how far the curve may be from
it, and the lengths along a and b; and the number of rows."""

SHARE = 1 / 16
"""A piece is halved until it is at most this far from its chord, in units of its reach."""

DENSE_PAIRS = 1 << 16
"""How many pairs of a ray and a sphere are tested at once."""

SLACKS = 8
"""Reaches are enlarged by this number of slacks of a ray, for rounding."""


def edge_models(nets: FloatArray, depth: Ints, largest: float) -> FloatArray:
    """The models (ROW_COUNT, K) of cells with nets (n+1, 1, 3 or 4, K) of curves.

    `depth` (K,) is the number of halvings of each cell, and no control point is further than
    `largest` from the origin.
    """
    polygons = nets[:, 0].transpose(2, 0, 1)
    points = project(polygons, -1)
    table = np.zeros((ROW_COUNT, len(polygons)))
    start, end = points[:, 0], points[:, -1]
    # At least twice the error of a control point: `cell_models` has the proof.
    error = 4 * UNIT * largest * (depth + 2) * (polygons.shape[1] + 1)
    bend = bound_chord_deviations(polygons, np.stack([start, end], axis=1))
    table[BEND] = bend + 2 * error
    table[:3], table[START : START + 3], table[END : END + 3] = (
        ((start + end) / 2).T,
        start.T,
        end.T,
    )
    table[model_rows.RADIUS] = length(end - start, -1) / 2 + table[BEND]
    table[model_rows.ERROR] = table[BEND]
    table[SIZE_A] = length(np.diff(points, axis=1), -1).sum(axis=1)
    return table


EDGES = Table(edge_models, ROW_COUNT, (SIZE_A, SIZE_B))
"""The table of the models of pieces of edges."""


def find_near_spheres(spheres: FloatArray, rays: Rays) -> tuple[Ints, Ints]:
    """The pairs of a ray and a sphere that the ray may meet, in the order of rays.

    All pairs of m rays and n spheres are tested by products of matrices. The origin o of a ray is
    the point of its line that is nearest to 0. So for a sphere of the radius r about c, enlarged by
    the slack s of the ray, the line meets the sphere if

        |c|² − r² − 2 (c · o + r s) + |o|² − s² ≤ (c · d)²,

    up to 64 u (|c|² + |o|² + r² + s²); twice this error is subtracted on the left.
    """
    center, radius = spheres[:3], spheres[3]
    squared, less = dot(center, center), 1 - 128 * UNIT
    more = 1 + 128 * UNIT
    ones = np.ones(len(radius))
    left = np.stack([*(-2.0 * center), -2.0 * radius, squared * less - radius**2 * more, ones])
    parts = []
    for rows in row_slices(len(rays.near), len(radius), DENSE_PAIRS):
        o, d, slack = rays.origin[:, rows], rays.direction[:, rows], rays.slack[rows]
        last = dot(o, o) * less - slack * slack * more
        right = np.stack([*o, slack, np.ones(len(slack)), last])
        along = d.T @ center
        along *= along
        met = np.flatnonzero(right.T @ left <= along)
        ray, sphere = np.divmod(met, len(radius))
        parts.append((ray + rows.start, sphere))
    ray, sphere = (np.concatenate(column) for column in zip(*parts, strict=True))
    reach = radius[sphere] + rays.slack[ray]
    is_ahead = dot(center[:, sphere], rays.direction[:, ray]) + reach >= rays.near[ray]
    return ray[is_ahead], sphere[is_ahead]


@np.errstate(all="ignore")
def bound_passes(
    cells: CellTree, rays: Rays, ray: Ints, cell: Ints, reach: FloatArray
) -> tuple[Bools, Bools, FloatArray]:
    """Where rays pass the pieces of edges at most the reach (N,) away, for N pairs.

    Returns
    -------
    is_met, is_done : ndarray of bool, shape (N,)
        Which pairs may come that near, and of which of these the pieces need not be halved.
    passes : ndarray of float64, shape (4, N)
        An interval of t that contains all places of the line of the ray that are that near; the
        parameter in the cell, from 0 to 1, of the nearest point of the chord; and its distance.
    """
    model = cells.models.take(cell, axis=1)
    d = rays.direction.take(ray, axis=1)
    m = model[START : START + 3] - rays.origin.take(ray, axis=1)
    e = model[END : END + 3] - model[START : START + 3]
    is_done = model[BEND] <= SHARE * reach
    reach = reach + model[BEND] + SLACKS * rays.slack[ray]
    first, along = cross(m, d), cross(e, d)  # at s = 0, and its change for s = 1
    speed = length(along)
    nearest = np.clip(-dot(first, along) / (speed * speed), 0.0, 1.0)
    nearest = np.where(speed > 0, nearest, 0.0)
    distance = length(first + nearest * along)
    is_met = distance <= reach
    # Chords that the ray follows are near it as a whole.
    half = np.sqrt(np.maximum(reach * reach - distance * distance, 0.0))
    middle = -dot(first, along) / (speed * speed)
    width = half / speed
    is_along = speed <= reach
    begin = np.where(is_along | (length(first) <= reach), 0.0, np.maximum(middle - width, 0.0))
    end = np.where(
        is_along | (length(first + along) <= reach), 1.0, np.minimum(middle + width, 1.0)
    )
    t, rate = dot(m, d), dot(e, d)
    low = t + np.minimum(begin * rate, end * rate) - half
    high = t + np.maximum(begin * rate, end * rate) + half
    return is_met, is_done, np.stack([low, high, nearest, distance])
