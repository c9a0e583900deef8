"""Bounds of the points of a cell on a ray, proved from the model of the cell.

A ray is o + t d, |d| = 1; it begins at t = near. A cell has the model of
`service.engine.cells.models`, in its own parameters s = (a, b) in [−1, 1]². With g = c − o, X = B ×
d, Y = d × A and D = d · (A × B), the functions

    G = (X · (S − o), Y · (S − o)) / D = (X · g, Y · g) / D + s + (terms of second order, rest)

vanish where S is on the line of the ray, because X and Y are perpendicular to d. A cell is
*settled* if the partials of G differ from those of s by at most `MAX_CONTRACTION`: then it meets
the line at most once.

Proofs in docs/proofs.md: "No hit in a cell", "At most one hit" and "Exactly one hit".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.engine.cells import models as model_rows
from service.engine.cells.tree import CellTree
from service.engine.nets.query_nets import QueryNets
from service.engine.vectors import UNIT, Items, cross, dot, length

MAX_CONTRACTION = 0.5
"""The largest ν of settled cells: Newton's method then finds their roots in few steps."""

CHUNK_PAIRS = 1 << 13
"""How many pairs of a ray and a sphere or cell are computed at once; this limits the memory."""

SAFE = 1 + 64 * UNIT
"""A factor that is larger than all rounding of a few products."""

MIN_THICKNESS = 2.0**6
"""The thickness of a ray is at least this factor times its slack. So the radius of a cell that does
not count as a point is more than 8 times the slack (`levels`)."""


@dataclass(frozen=True, eq=False, slots=True)
class Rays(Items):
    """m rays, in the coordinates of the nets.

    Attributes
    ----------
    origin, direction : ndarray of float64, shape (3, m)
        The origin o, moved along the ray to the nets; and the direction d, of length 1.
    near : ndarray of float64, shape (m,)
        The t at which the ray begins: its origin in the request, which is not o.
    slack : ndarray of float64, shape (m,)
        A bound of the errors of differences c − o: of rounding, and of the nets.
    thickness : ndarray of float64, shape (m,)
        A point of the surface that is nearer than this to the ray may count as a hit.
    """

    origin: FloatArray
    direction: FloatArray
    near: FloatArray
    slack: FloatArray
    thickness: FloatArray


def local_rays(
    nets: QueryNets, origins: FloatArray, directions: FloatArray, thickness: float
) -> Rays:
    """Convert rays (m, 3) from model coordinates to the coordinates of the nets.

    `thickness` already is in the coordinates of the nets.
    """
    with np.errstate(all="ignore"):
        error = 0.0 if nets.errors is None else float(nets.errors.max())
        return make_rays(nets.local(origins), directions, thickness, error)


@np.errstate(all="ignore")
def make_rays(origins: FloatArray, directions: FloatArray, thickness: float, error: float) -> Rays:
    """Rays with origins and directions (m, 3) in the coordinates of the nets.

    Nets may be off by `error`, which is added to the slack.
    """
    d = directions.T / np.abs(directions).max(axis=1)
    d = np.ascontiguousarray(d / length(d))
    local_origins = np.ascontiguousarray(origins.T)
    begins = dot(local_origins, d)
    o = local_origins - begins * d
    # Points of nets are nearer to the origin than 4.
    slack = 4 * UNIT * (length(local_origins) + np.abs(begins)) + 16 * UNIT * (length(o) + 4)
    slack += error
    slack = np.where(np.isfinite(slack), slack, np.inf)
    return Rays(o, d, begins, slack, np.maximum(thickness, MIN_THICKNESS * slack))


def sphere_misses(
    spheres: FloatArray, rays: Rays, ray: Ints, farthest: FloatArray
) -> tuple[Bools, FloatArray]:
    """For N pairs of a sphere and a ray: which do not meet, and lower bounds of t in the spheres.

    Parameters
    ----------
    spheres : ndarray of float64, shape (at least 4, N)
        Centres and radii.
    ray : ndarray of int, shape (N,)
    farthest : ndarray of float64, shape (N,) or ()
        The largest t of interest.
    """
    g = spheres[:3] - rays.origin.take(ray, axis=1)
    d = rays.direction.take(ray, axis=1)
    radius = spheres[3] + rays.slack[ray]
    across = cross(g, d)
    along = dot(g, d)
    misses = dot(across, across) > radius * radius * SAFE
    low = along - radius
    misses |= low > farthest
    misses |= along + radius < rays.near[ray]
    return misses, low


def find_met_spheres(spheres: FloatArray, rays: Rays) -> tuple[Ints, Ints]:
    """The pairs of a ray and a sphere that the ray may meet, in the order of rays.

    All pairs of m rays and n spheres are tested, in arrays (m, n). With g = c − o, the squared
    distance of a centre from the line of a ray is |g|² − (g · d)², up to 16 u |g|²; twice this
    error is subtracted.
    """
    pairs = []
    center, radius = spheres[:3, np.newaxis], spheres[3]
    for rows in row_slices(len(rays.near), spheres.shape[1], CHUNK_PAIRS):
        o, d = rays.origin[:, rows, np.newaxis], rays.direction[:, rows, np.newaxis]
        g = center - o
        along_ray, squared_distance = dot(g, d, -3), dot(g, g, -3)
        squared_distance *= 1 - 32 * UNIT
        squared_along_ray = along_ray * along_ray
        squared_distance -= squared_along_ray
        radius_with_slack = radius + rays.slack[rows, np.newaxis]
        along_ray += radius_with_slack
        is_met = along_ray >= rays.near[rows, np.newaxis]
        radius_with_slack *= radius_with_slack
        radius_with_slack *= SAFE
        is_met &= squared_distance <= radius_with_slack
        ray, sphere = np.nonzero(is_met)
        pairs.append((ray + rows.start, sphere))
    ray, sphere = (np.concatenate(column) for column in zip(*pairs, strict=True))
    return ray, sphere


@dataclass(frozen=True, eq=False, slots=True)
class RootBounds(Items):
    """The bounds of the roots of N settled pairs of a ray and a cell.

    Attributes
    ----------
    ray, cell : ndarray of int, shape (N,)
    low : ndarray of float64, shape (N,)
        A lower bound of t in the cell.
    first, second : ndarray of float64, shape (3, N)
        −B and A, so that X · y = first · (y × d) and Y · y = second · (y × d) for every y.
    lengths : ndarray of float64, shape (2, N)
        |B| and |A|.
    determinant : ndarray of float64, shape (N,)
        D.
    contraction : ndarray of float64, shape (N,)
        ν.
    start : ndarray of float64, shape (2, N)
        The parameters (a, b) at which the model meets the line of the ray, approximately.
    exists : ndarray of bool, shape (N,)
        Whether the bounds over the whole cell prove a root.
    """

    ray: Ints
    cell: Ints
    low: FloatArray
    first: FloatArray
    second: FloatArray
    lengths: FloatArray
    determinant: FloatArray
    contraction: FloatArray
    start: FloatArray
    exists: Bools


@np.errstate(all="ignore")
def root_bounds(
    cells: CellTree, rays: Rays, ray: Ints, cell: Ints, low: FloatArray
) -> tuple[Bools, Bools, RootBounds]:
    """Bound the roots of G for N pairs of a ray and a cell.

    Parameters
    ----------
    cells : CellTree
    rays : Rays
    ray, cell : ndarray of int, shape (N,)
    low : ndarray of float64, shape (N,)
        Lower bounds of t in the cells, from `sphere_misses`.

    Returns
    -------
    is_empty, is_settled : ndarray of bool, shape (N,)
        Which pairs have no hit by the bounds of X · g and Y · g (`sphere_misses` tests
        the others), and which of the other pairs are settled.
    bounds : RootBounds
        The bounds of the settled pairs.
    """
    m = model_rows
    model, slack = cells.models[: m.ROUND + 1].take(cell, axis=1), rays.slack[ray]
    o, d = rays.origin.take(ray, axis=1), rays.direction.take(ray, axis=1)
    a, b = model[m.TANGENT_A : m.TANGENT_A + 3], model[m.TANGENT_B : m.TANGENT_B + 3]
    seconds = [model[k : k + 3] for k in (m.SECOND_AA, m.SECOND_AB, m.SECOND_BB)]
    q = cross(model[:3] - o, d)  # X · g = −B · q and Y · g = A · q
    x, y = cross(b, d), cross(d, a)
    lengths = np.sqrt(model[[m.FORM_BB, m.FORM_AA]])  # |B| and |A|
    size = np.abs(determinant := dot(x, a))  # |D|
    error = (model[m.ROUND] + slack) * lengths
    # For X and for Y: X · g; the products of X with Q_aa, Q_ab and Q_bb; k_X; and n_X |D|.
    values, curvature_terms, bounds_k, bounds_n = [], [], [], []
    for k, (row, tangent) in enumerate(((x, -b), (y, a))):
        value = dot(tangent, q)
        aa, ab, bb = (dot(row, second) for second in seconds)
        row_length = length(row) * SAFE
        second_order = np.abs(aa) + 2 * np.abs(ab) + np.abs(bb)
        bounds_k.append((0.5 * second_order + row_length * model[m.REST]) * SAFE + error[k])
        bounds_n.append((second_order + 3 * row_length * model[m.REST]) * SAFE + error[k])
        values.append(value)
        curvature_terms.append((aa, ab, bb))
    is_empty = np.abs(values[0]) > size + bounds_k[0]
    is_empty |= np.abs(values[1]) > size + bounds_k[1]
    max_n = np.maximum(bounds_n[0], bounds_n[1])
    is_settled = (max_n <= MAX_CONTRACTION * size) & ~is_empty
    rows = np.flatnonzero(is_settled)
    size, determinant = size[rows], determinant[rows]
    exists = np.abs(values[0][rows]) + bounds_k[0][rows] < size
    exists &= np.abs(values[1][rows]) + bounds_k[1][rows] < size
    values = [-value[rows] / determinant for value in values]
    curvature_terms = [
        (aa[rows] / determinant, ab[rows] / determinant, bb[rows] / determinant)
        for aa, ab, bb in curvature_terms
    ]
    # The root (a, b) of the model, approximately, by fixed-point iteration.
    root_a = root_b = np.zeros(len(rows))
    for _ in range(3):
        root_a, root_b = (
            np.clip(
                value - 0.5 * (aa * root_a * root_a + bb * root_b * root_b) - ab * root_a * root_b,
                -1.0,
                1.0,
            )
            for value, (aa, ab, bb) in zip(values, curvature_terms, strict=True)
        )
    bounds = RootBounds(
        ray[rows],
        cell[rows],
        low[rows],
        -b[:, rows],
        a[:, rows],
        lengths[:, rows],
        determinant,
        max_n[rows] / size,
        np.stack([root_a, root_b]),
        exists,
    )
    return is_empty, is_settled, bounds
