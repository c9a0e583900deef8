"""Decides which points are inside a closed surface, by winding numbers, with a proof.

A surface is closed if its patches pass along each edge equally often in both directions
(`service.engine.connectivity.orientation`). A point is inside if the winding number is not 0.

The winding number of a closed surface whose normals du × dv point outwards is

    w(x) = (1 / 4π) Σ Ω(cell, x),

an integer for every x that is not on the surface, where Ω is the signed solid angle of a cell as
seen from x. The angle of two triangles over the corners of a cell differs from Ω by at most the sum
of the areas between sides and chords (`service.engine.cells.chord_models`) divided by the squared
distance. Cells are halved until the sum of these bounds is less than 2π; then w is the nearest
integer. At a distance d from the surface, only cells larger than about d must be halved.

A point is replaced by the nearest point of a grid that is finer than its distance from the surface;
then one grid point replaces many points. Points outside the box of all control points have w = 0.

Proof in docs/proofs.md: "Winding numbers".

References
----------
Floater, Derivatives of rational Bézier curves, Computer Aided Geometric Design 9 (1992).
Van Oosterom and Strackee, The solid angle of a plane triangle, IEEE Transactions on Biomedical
Engineering 30 (1983).
"""

from math import pi

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.cells.chord_models import AREA, CHORDS, CORNERS, GAP_FACTOR
from service.engine.cells.pair_search import Chunks, Pairs, PairSearch
from service.engine.cells.tree import CellTree, WorkLimits
from service.engine.connectivity.orientation import orient_sides
from service.engine.connectivity.seams import Seams
from service.engine.nets.query_nets import QueryNets
from service.engine.options import MeshOptions
from service.engine.vectors import UNIT, cross, dot, length
from service.surface.lowered import PatchModel

WELD_TOLERANCE = MeshOptions().weld_tolerance
"""Patches are joined with the default tolerance of meshes."""

SAME_EDGE = 2.0**-40
"""Two sides may count as one edge although their weights differ by rounding. Their distance is at
most this share of the diagonal."""

LIMITS = WorkLimits(pairs=20_000_000, of_item=1 << 14)
"""After this number of pairs in a request, which takes 20 to 35 s, no further points are begun;
their winding numbers are uncertain. So is that of a point with too many pairs on one level."""

MAX_BOUND = 0.95 * 2 * pi
"""The largest sum of bounds with which the winding number is certain: a little less than 2π, which
the proof requires."""

SMALL_BOUNDS = (2.0**-4, 2.0**-7, 2.0**-10)
"""A cell is not halved if its bound of |Ω − Ω₂| is at most this. The search tries these numbers
one after another, until the sum of all bounds is at most `MAX_BOUND`."""

ROUNDING = 1e-6
"""A bound of the rounding error of a sum of solid angles; the error of one angle is about 1e-13."""

MIN_CLEARANCE = 0.1
"""A solid angle is computed only if the distance of x from the ball of the cell, and from the
strips beside it, is more than this, in radii of the ball."""

CHUNK_PAIRS = 1 << 15
"""How many pairs of a point and a cell are computed at once; this limits the memory."""


def compute_signs(
    model: PatchModel,
    joined: tuple[PatchModel, Seams],
    nets: QueryNets,
    x: FloatArray,
    low: FloatArray,
    *,
    limits: WorkLimits = LIMITS,
) -> FloatArray:
    """Compute the signs (m,) of points: −1 inside, +1 outside, NaN if this is uncertain.

    A point is inside if the winding number is not 0, so the direction of the normals does not
    matter. If the surface is open, all signs are NaN.

    Parameters
    ----------
    joined : (PatchModel, Seams)
        The result of `join`: borders that are equal up to rounding, or up to knots and degree, are
        edges, as in a mesh.
    nets : QueryNets
        Nets of the model.
    x : ndarray of float64, shape (m, 3)
        The points, in the coordinates of the nets.
    low : ndarray of float64, shape (m,)
        Lower bounds of their distances from the surface, in the coordinates of the nets.
    limits : WorkLimits
    """
    joined_model, seams = joined
    if not orient_sides(seams).is_closed:
        return np.full(len(x), np.nan)
    gap = (joined_model.moved + SAME_EDGE * model.diagonal) / nets.scale
    numbers = compute_winding_numbers(CellTree(nets, limits, CHORDS), x, low, gap)
    return np.where(np.isnan(numbers), np.nan, np.where(numbers != 0, -1.0, 1.0))


def compute_winding_numbers(
    cells: CellTree, x: FloatArray, low: FloatArray, gap: float
) -> FloatArray:
    """Compute the winding numbers (m,) of a closed surface about points x; NaN if uncertain.

    Parameters
    ----------
    cells : CellTree
        The cells of the nets of a closed surface, with the models of `chord_models`.
    x : ndarray of float64, shape (m, 3)
        In the coordinates of these nets.
    low : ndarray of float64, shape (m,)
        Lower bounds of the distances to the surface.
    gap : float
        The largest distance between two sides that are one edge.
    """
    lowest, highest = cells.box
    is_in_box = ((x >= lowest) & (x <= highest)).all(axis=1)
    gap += 2.0**-44 * cells.largest  # for rounding
    # A strip that closes a gap is within one gap of the surface, and the grid point that replaces x
    # is at least half as far from the surface as x.
    is_off_surface = low > 4 * gap
    numbers = np.where(is_in_box | ~is_off_surface, np.nan, 0.0)
    rows = np.flatnonzero(is_in_box & is_off_surface)
    grid_points, inverse = np.unique(
        find_grid_points(x[rows], low[rows]), axis=0, return_inverse=True
    )
    is_in_box = ((grid_points >= lowest) & (grid_points <= highest)).all(axis=1)
    distinct_numbers = np.where(is_in_box, np.nan, 0.0)
    inner = np.flatnonzero(is_in_box)
    # Each point begins with one pair for each of the `roots` cells; these fill about one chunk.
    size = max(1, CHUNK_PAIRS // cells.roots)
    chunks = Chunks(cells, len(inner), (1, size, size))
    for chunk, budget in chunks:
        if chunks.pairs <= 0:
            break
        points = inner[chunk]
        for small_bound in SMALL_BOUNDS:
            search = _Chunk(cells, grid_points[points].T, gap, small_bound)
            distinct_numbers[points] = search.numbers()
            budget.spent[0] += search.pair_count
            # Only points whose sum of bounds is too large are searched again, with a smaller limit.
            points = points[search.bound > MAX_BOUND]
            if not len(points) or cells.is_full:
                break
        if cells.is_full and chunks.can_split:
            distinct_numbers[inner[chunk]] = np.nan
            chunks.split()
    numbers[rows] = distinct_numbers[inverse.ravel()]
    return numbers


def find_grid_points(x: FloatArray, low: FloatArray) -> FloatArray:
    """For each point a grid point whose distance from it is at most half of `low`."""
    # The step, a power of 2, is at most 0.57 `low`. Half the diagonal of a cube of the grid is
    # √3 / 2 times the step, which is less than half of `low`.
    _, exponent = np.frexp(0.57 * low)
    step = np.ldexp(1.0, exponent - 1)[:, np.newaxis]
    return np.asarray(np.rint(x / step) * step + 0.0)  # + 0.0 turns −0.0 into 0.0


class _Chunk(PairSearch):
    """The search for the winding numbers of some points (3, m).

    Cells with bounds of at most `small_bound` are not halved. `angle` and `bound` are the sums of
    the angles and of their bounds so far. `is_given_up` marks points that stay uncertain, because
    they have a cell that cannot be halved, or too many pairs on a level.
    """

    def __init__(self, cells: CellTree, x: FloatArray, gap: float, small_bound: float) -> None:
        super().__init__(cells, x.shape[1], can_split=False)
        self.x, self.gap, self.small_bound = np.ascontiguousarray(x), gap, small_bound
        self.pair_count = 0
        self.angle, self.bound = np.zeros((2, self.count))
        self.is_given_up = np.zeros(self.count, bool)

    def numbers(self) -> FloatArray:
        """The winding numbers (m,), after all levels; NaN where they are uncertain."""
        point = np.repeat(np.arange(self.count), self.cells.roots)
        cell = np.tile(np.arange(self.cells.roots), self.count)
        while len(point):
            self.pair_count += len(point)
            point, cell = self.step(point, cell)
        # The sum of the angles is at most `bound` from 4π times an integer.
        winding_number = np.rint(self.angle / (4 * pi))
        is_certain = np.abs(self.angle - 4 * pi * winding_number) <= self.bound + ROUNDING
        is_certain &= self.bound <= MAX_BOUND
        return np.where(is_certain & ~self.is_given_up, winding_number, np.nan)

    def step(self, point: Ints, cell: Ints) -> Pairs:
        """Add the angles of pairs that are precise enough; returns the pairs of the next level."""
        m = self.count
        angle, bound = self.angles(point, cell)
        # Points whose sum of bounds is small enough without further halving.
        is_certain = self.bound + np.bincount(point, bound, m) <= MAX_BOUND
        is_precise = (bound <= self.small_bound) | is_certain[point]
        self.angle += np.bincount(point[is_precise], angle[is_precise], m)
        self.bound += np.bincount(point[is_precise], bound[is_precise], m)
        point, cell = point[~is_precise], cell[~is_precise]
        self.is_given_up[point[self.must_end(point, cell)]] = True
        is_kept = ~self.is_given_up[point]
        return self.halve(point[is_kept], cell[is_kept])

    def angles(self, point: Ints, cell: Ints) -> tuple[FloatArray, FloatArray]:
        """Solid angles of the triangles of cells, and bounds of their errors.

        A bound is infinite if the point is too near to the ball of the cell.
        """
        distinct_cells, number = np.unique(cell, return_inverse=True)
        model = self.cells.models[:, distinct_cells]
        areas = model[AREA] + model[GAP_FACTOR] * self.gap  # Σ A, with g added to each δ_i
        corners = model[CORNERS:].reshape(4, 3, -1)
        angle, bound = np.empty(len(point)), np.empty(len(point))
        for first in range(0, len(point), CHUNK_PAIRS):
            rows = slice(first, first + CHUNK_PAIRS)
            x, cell_numbers = self.x[:, point[rows]], number[rows]
            sphere = model[:4, cell_numbers]
            difference = x - sphere[:3]
            # From the ball, and from the strips that close gaps beside it; 8 u are for rounding.
            clearance = length(difference) * (1 - 8 * UNIT) - (sphere[3] + self.gap)
            is_near = clearance <= MIN_CLEARANCE * sphere[3]
            clearance[is_near] = 1.0
            bound[rows] = np.where(is_near, np.inf, areas[cell_numbers] / (clearance * clearance))
            angle[rows] = np.where(is_near, 0.0, _solid_angles(corners[..., cell_numbers] - x))
        return angle, bound


def _solid_angles(corners: FloatArray) -> FloatArray:
    """Solid angles (n,) at the origin of quadrilaterals, each taken as two triangles.

    `corners` has shape (4, 3, n).
    """
    a, b, c, d = corners
    la, lb, lc, ld = length(corners)
    return _solid_angle((a, b, c), (la, lb, lc)) + _solid_angle((a, c, d), (la, lc, ld))


def _solid_angle(
    corners: tuple[FloatArray, FloatArray, FloatArray],
    lengths: tuple[FloatArray, FloatArray, FloatArray],
) -> FloatArray:
    """Solid angles (n,) at the origin of triangles; `lengths` are the distances of the corners."""
    (a, b, c), (la, lb, lc) = corners, lengths
    volume = dot(a, cross(b, c))
    denominator = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
    return np.asarray(2 * np.arctan2(volume, denominator))
