"""How far a given mesh and a surface are apart: two intervals, from finer and finer references.

Let S be the surface, M the mesh, and R a reference mesh of S: no point of S is further than a from
R, no point of R further than b from S. For the largest distance D(A, B) from a point of A to B,

    D(R, M) − b ≤ D(S, M) ≤ D(R, M) + a,   D(M, R) − a ≤ D(M, S) ≤ D(M, R) + b.

The first reference mesh is coarse; each interval says how fine the next must be. The distances of
single points of the surface, and of the mesh, raise the lower ends.

Proof in docs/proofs.md: "Distances from anyone's mesh".
"""

from dataclasses import replace
from math import inf

import numpy as np

from service.bases.arrays import FloatArray
from service.cancellation import checkpoint
from service.engine.mesh_checks.angles import find_largest_angle
from service.engine.mesh_checks.query import CheckQuery
from service.engine.mesh_checks.reference import ComparedSurface, OutOfReach, ReferenceMesh
from service.engine.mesh_checks.values import Comparison, Deviation, Limit
from service.engine.mesh_distances.nearest import find_nearest
from service.engine.mesh_distances.search import LargestDistance, bound_largest_distance
from service.engine.mesh_distances.tree import TriangleTree
from service.surface.given_mesh import GivenMesh

FIRST, FLOOR = 0.01, 1e-9
"""The tolerance of the first reference mesh, and the width of intervals that are narrow enough in
any case: as shares of the diagonal of the surface."""

LARGEST_STEP, ROUNDS, FULL = 32.0, 8, 0.7
"""A reference mesh has at least 1/`LARGEST_STEP` of the tolerance of the one before, whose interval
may begin at 0 by chance. There are at most `ROUNDS`. As far as the growth of the number of
triangles shows, the next one has at most the share `FULL` of the most triangles."""

REFERENCE_SHARE, SEARCH_SHARE = 0.36, 0.25
"""The tolerance of a reference mesh, and the width of an interval between two meshes, as shares of
the allowed width. The second bound of a reference mesh is up to twice its tolerance."""

EFFORT, LEAST_EFFORT = 16, 1 << 16
"""The most pieces of triangles that a search between two meshes examines: for each of their
triangles, and in addition. Usually 6 for each triangle are enough."""

POINT_ERROR = 2.0**-44
"""The rounding of a point of the surface or of a triangle, as a share of the largest coordinate."""


def compare(mesh: GivenMesh, surface: ComparedSurface, query: CheckQuery) -> Comparison:
    """Compare a mesh with a surface.

    Raises
    ------
    OutOfReach
        There is not even the first reference mesh.
    """
    tolerance = FIRST * surface.diagonal
    task, limit = _Task(mesh, surface, query, tolerance), None
    for _ in range(ROUNDS - 1):
        wanted = task.find_tolerance()
        if wanted == inf:
            break
        growth = task.reference_count / (FULL * surface.max_triangles)
        least = tolerance * max(1 / LARGEST_STEP, growth)
        if max(wanted, least) > FULL * tolerance:
            break
        tolerance = max(wanted, least)
        try:
            task.refine(tolerance)
        except OutOfReach as error:
            limit = error.limit
            break
    return task.finish(limit)


class _Task:
    """The state of a comparison: the last reference mesh, and the best intervals so far."""

    def __init__(
        self, mesh: GivenMesh, surface: ComparedSurface, query: CheckQuery, tolerance: float
    ) -> None:
        self._mesh, self._surface, self._query = mesh, surface, query
        self._tree = TriangleTree(mesh.corners)
        self._floor = FLOOR * surface.diagonal
        self._take_reference(surface.build_reference(tolerance))
        self._of_surface, self._of_mesh = self._measure_surface(), self._measure_mesh()

    def _take_reference(self, reference: ReferenceMesh) -> None:
        self._reference, self._reference_tree = reference, TriangleTree(reference.corners)
        checkpoint()

    def refine(self, tolerance: float) -> None:
        """Narrow the intervals by a reference mesh of this tolerance; raises `OutOfReach`."""
        before = self._reference
        self._take_reference(self._surface.build_reference(tolerance))
        if self._reference.skipped_faces != before.skipped_faces:
            # The intervals are those of other faces.
            self._of_surface, self._of_mesh = self._measure_surface(), self._measure_mesh()
            return
        if self._is_open(self._of_surface):
            self._of_surface = _meet(self._of_surface, self._measure_surface())
        if self._is_open(self._of_mesh):
            self._of_mesh = _meet(self._of_mesh, self._measure_mesh())

    @property
    def reference_count(self) -> int:
        """The number of triangles of the last reference mesh."""
        return len(self._reference.triangles)

    def find_tolerance(self) -> float:
        """The tolerance of the next reference mesh; infinite if both intervals are narrow."""
        share = REFERENCE_SHARE * self._query.relative_tolerance
        return min(
            (
                max(share * each.low, REFERENCE_SHARE * self._floor)
                for each in (self._of_surface, self._of_mesh)
                if self._is_open(each)
            ),
            default=inf,
        )

    def finish(self, limit: Limit | None) -> Comparison:
        """The result; `limit` says why there is no finer reference mesh, if one was wanted."""
        if self.find_tolerance() == inf:
            limit = None
        else:
            limit = "thin" if self._reference.is_coarse else limit or "work"
        angle, triangle = find_largest_angle(self._mesh, self._reference, self._reference_tree)
        distances = middle_distances = None
        if self._query.distances:
            positions = self._mesh.positions
            middles = positions[self._mesh.triangles].mean(axis=1)
            distances = find_nearest(self._reference_tree, positions).high
            middle_distances = find_nearest(self._reference_tree, middles).high
        return Comparison(
            self._of_surface,
            self._of_mesh,
            limit,
            angle,
            triangle,
            distances,
            middle_distances,
            self._reference.skipped_faces,
        )

    def _is_open(self, deviation: Deviation) -> bool:
        return not deviation.is_narrow(self._query.relative_tolerance, self._floor)

    def _measure_surface(self) -> Deviation:
        """The largest distance from the surface to the mesh."""
        reference = self._reference
        found = self._search(reference.corners, self._tree)
        low, point, triangle = found.low - reference.mesh_deviation, found.point, found.target
        place = self._surface.find_place(point)
        if place is not None:
            point = place.position
            nearest = find_nearest(self._tree, point[np.newaxis])
            low = max(low, float(nearest.low[0]) - place.error - _bound_rounding(point))
            triangle = int(nearest.triangle[0])
        high = found.high + reference.deviation
        columns = {} if place is None else place.place
        return Deviation(max(low, 0.0), high, point, triangle, columns)

    def _measure_mesh(self) -> Deviation:
        """The largest distance from the mesh to the surface."""
        reference = self._reference
        found = self._search(self._mesh.corners, self._reference_tree)
        low = found.low - reference.deviation
        place = self._surface.find_place(found.point)
        if place is not None:
            low = max(low, place.low - _bound_rounding(found.point))
        high = found.high + reference.mesh_deviation
        columns = {} if place is None else place.place
        return Deviation(max(low, 0.0), high, found.point, found.source, columns)

    def _search(self, corners: FloatArray, tree: TriangleTree) -> LargestDistance:
        return bound_largest_distance(
            corners,
            tree,
            relative_width=SEARCH_SHARE * self._query.relative_tolerance,
            floor=SEARCH_SHARE * self._floor,
            effort=LEAST_EFFORT + EFFORT * (len(corners) + len(tree.order)),
        )


def _meet(before: Deviation, after: Deviation) -> Deviation:
    """The interval that is in both, at the place of the larger lower end."""
    best = before if before.low > after.low else after
    return replace(best, high=min(before.high, after.high))


def _bound_rounding(point: FloatArray) -> float:
    """A bound of the rounding of a point."""
    return POINT_ERROR * float(np.abs(point).max())
