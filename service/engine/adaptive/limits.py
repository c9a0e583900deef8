"""Limits of one mesh: of depth, triangles and work; and bounds of its size before it is made.

A patch is cut into at most the number of cells, powers of two along u and along v, whose second
derivatives bend by half of the tolerance. A face of n cells with b pieces of the border around them
has at most 2 n + b vertices and 4 n + b triangles. Most meshes have a tenth of these numbers.

Proof in docs/proofs.md: "The size of a mesh by tolerance".
"""

from dataclasses import dataclass, field
from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from service.bases.arrays import Ints
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.bounds.goal import Goal
from service.engine.bounds.second_derivatives import bound_second_derivatives
from service.engine.connectivity.seams import Seams, find_seams
from service.engine.evaluation.evaluate import evaluate
from service.engine.options import MeshOptions
from service.engine.wires.divisions import count_goal_divisions
from service.engine.wires.draw import bound_solid_counts
from service.engine.wires.isocurves import IsoCurves, sample_divided_isocurves
from service.errors import InvalidRequest, Issue, TooLarge, count_nouns
from service.surface.batches import TrianglePatches
from service.surface.lowered import PatchModel

TERM_DIVISOR = 6
"""Each of the three terms may be 1/6 of the tolerance: a third of its half."""

FINEST, FEWEST = 30, 4
"""Sides are halved at most `FINEST` times here, to the unit of places. They have at least `FEWEST`
pieces, because a closed side is halved, and its halves are halved again."""

DIVISIONS, SMOOTH, CHUNK = 8, 0.5, 1 << 16
"""Divisions, in each direction, of patches whose normals are sampled; the largest distance of unit
normals of neighbouring samples that counts as a smooth turn; about the samples in one block."""


@dataclass(slots=True)
class Effort:
    """The work of one request, approximately in multiplications.

    Attributes
    ----------
    limit : float
        The limit of all work.
    spent : float
        Work done.
    reserve : float
        Work that the mesh being built must leave for the next ones.
    """

    limit: float = inf
    spent: float = 0.0
    reserve: float = 0.0

    def spend(self, work: float) -> None:
        """Add to the work spent; raise `TooLarge` beyond the limit, `Cancelled` if cancelled.

        Work beyond the limit is not added, because it is not done.
        """
        checkpoint()
        if self.spent + work > self.limit - self.reserve:
            raise TooLarge(
                Issue(
                    "too_costly",
                    "A mesh with this tolerance takes more work than one request may take.",
                    "/tolerance",
                    f"more than {self.limit:.3g} multiplications",
                    "a greater tolerance",
                )
            )
        self.spent += work

    def reserve_rest(self, work: float) -> None:
        """Reserve the rest of the limit, except for this amount of work."""
        self.reserve = max(self.limit - self.spent - work, 0.0)


@dataclass(slots=True)
class MeshLimits:
    """Limits of one mesh: its number of triangles, and its work."""

    triangles: float = inf
    effort: Effort = field(default_factory=Effort)

    def spend(self, work: float) -> None:
        """Add to the work spent, as `Effort.spend` does."""
        self.effort.spend(work)

    def count(self, triangles: int) -> None:
        """Raise `TooLarge` if this lower bound of the number of triangles exceeds the limit."""
        if triangles > self.triangles:
            raise TooLarge(
                Issue(
                    "too_many_triangles",
                    "A mesh with this tolerance has more triangles than the limit.",
                    "/tolerance",
                    f"more than {count_nouns(round(self.triangles), 'triangles')}",
                    "a greater tolerance, or a greater limit",
                )
            )


class SidePieces:
    """Counts the pieces of the sides of faces, once for each side, and limits the triangles.

    A face with k pieces on its border has at least k − 2 triangles.
    """

    def __init__(self, faces: int, most: int) -> None:
        self.triangles, self._limits = -2 * faces, MeshLimits(most)

    def add(self, uses: Ints) -> None:
        """Count n more pieces; `uses` (n,) has the number of sides that have each piece."""
        self.triangles += int(uses.sum())
        self._limits.count(self.triangles)


def build_depth_error() -> InvalidRequest:
    """The error for a tolerance that would need cells smaller than `cells.SHORTEST`."""
    return InvalidRequest(
        Issue(
            "tolerance_too_small",
            "The tolerance needs more divisions than double precision can tell apart.",
            "/tolerance",
            "a smaller tolerance",
            "a greater tolerance",
        )
    )


def sample_goal_isocurves(
    model: PatchModel, seams: Seams, goal: Goal, options: MeshOptions, most: int
) -> list[IsoCurves]:
    """The isocurves of the options, as lines that are within the tolerance of a goal.

    Raises
    ------
    TooLarge
        `too_many_triangles` if lines have more than `most` samples, or tubes or ribbons more than
        `most` triangles.
    """
    divisions = count_goal_divisions(model, seams, goal)
    size = divisions.count_curves(seams, options.isocurves)  # curves, samples
    has_triangles = options.has_solid_wires
    MeshLimits(most).count(bound_solid_counts(*size, options)[1] if has_triangles else size[1])
    return sample_divided_isocurves(model, seams, divisions, options.isocurves)


class MostTriangles(NamedTuple):
    """Upper bounds of the numbers of vertices, of triangles, and of points of lines."""

    vertices: int
    triangles: int
    points: int


def bound_triangles(model: PatchModel, goal: Goal, options: MeshOptions) -> MostTriangles:
    """Bounds for one model; cuts for angles are not counted.

    A vertex that patches share is counted for each of them.
    """
    cells, pieces = _bound_cells(model, goal)
    vertices, triangles = (2 * cells + pieces, 4 * cells + pieces) if options.has_faces else (0, 0)
    points = pieces if "boundary" in options.overlays else 0
    if options.has_wires:
        seams = find_seams(model.batches)
        curves, samples = count_goal_divisions(model, seams, goal).count_curves(
            seams, options.isocurves
        )
        if options.has_solid_wires:
            solid_vertices, solid_triangles, _ = bound_solid_counts(curves, samples, options)
            vertices, triangles = vertices + solid_vertices, triangles + solid_triangles
        else:
            points += samples
    return MostTriangles(vertices, triangles, points)


def estimate_least_triangles(model: PatchModel, angle: float) -> float:
    """The least number of triangles of a mesh whose normals turn by at most an angle along edges.

    The normals at the corners of a triangle of the mesh are a triangle on the unit sphere. Its
    sides are at most the angle α, so its area is about √3/4 α² or less. Together these triangles
    cover ∫ |K| dA, which is estimated from some samples. The result is 1/8 of the quotient: an
    estimate with a wide margin, not a proof. Places where normals turn far between two samples do
    not count: they may be creases, where no division helps.
    """
    area = 0.0
    for batch in model.batches:
        grids = batch.to_tensor() if isinstance(batch, TrianglePatches) else batch
        for rows in row_slices(grids.count, DIVISIONS**2, CHUNK):
            chosen = grids.take(np.arange(grids.count)[rows])
            normals = evaluate(chosen, (DIVISIONS, DIVISIONS)).normals
            assert normals is not None
            a, b, c = normals[:, :-1, :-1], normals[:, 1:, :-1], normals[:, :-1, 1:]
            along_u, along_v = b - a, c - a
            # Squares of the areas on the unit sphere, and of the larger turns along u and v.
            size = np.square(np.cross(along_u, along_v)).sum(axis=-1)
            turn = np.maximum(np.square(along_u).sum(axis=-1), np.square(along_v).sum(axis=-1))
            area += float(np.sqrt(size[turn < SMOOTH**2]).sum())
    return area / (sqrt(3) / 4 * angle**2) / 8


def _bound_cells(model: PatchModel, goal: Goal) -> tuple[int, int]:
    """Upper bounds of the numbers of cells and of pieces of the borders of patches."""
    nearest = np.array([goal.find_nearest_distance(*model.bounds)])
    allowed = float(goal.find_allowed(nearest)[0])
    term = max(allowed / TERM_DIVISOR, float(np.finfo(np.float64).tiny))
    cells = pieces = 0
    for batch in model.batches:
        patches = batch.to_tensor() if isinstance(batch, TrianglePatches) else batch
        bends = bound_second_derivatives(patches, (1, 1), (1, 1))  # each patch as one block
        uu, uv, vv = (each[0, 0] / (8 * term) for each in (bends.uu, 2 * bends.uv, bends.vv))
        # Numbers of cells along u and along v, powers of 2.
        along = [np.exp2(np.clip(np.ceil(np.log2(m + 1e-300) / 2), 0, FINEST)) for m in (uu, vv)]
        # By the mixed term, the product of both numbers must be at least `uv`; as a power of 2 it
        # is less than twice that.
        cells += int(np.minimum(np.maximum(along[0] * along[1], 2 * uv), 4.0**FINEST).sum())
        pieces += int(sum(2 * np.maximum(side, FEWEST).sum() for side in along))
    return cells, pieces
