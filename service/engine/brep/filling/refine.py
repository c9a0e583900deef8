"""Triangles of faces are refined until all are within the tolerance, as far as that is possible.

All triangles of all faces are measured together. In faces with failing triangles edges are flipped
and cut (`flips`, `splits`), then whatever changed is measured again. A face that still fails after
some rounds goes back to its first triangulation, and gets points by Delaunay insertion
(`insertion`), which takes more rounds but makes better triangles.

Every bound that is returned comes from a measurement of the triangles that are returned: a round
ends with the measurement, and a face that still fails then keeps its bounds above the tolerance.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Ints
from service.engine.brep.filling.angles import find_turning_edges
from service.engine.brep.filling.double_edges import find_double_edges
from service.engine.brep.filling.flips import flip_edges
from service.engine.brep.filling.insertion import choose_places
from service.engine.brep.filling.measure import TriangleMeasure
from service.engine.brep.filling.splits import add_middles, choose_edges, cut_edges, join_mates
from service.engine.brep.filling.triangles import Mates, Triangles, find_mates
from service.engine.brep.filling.triangulation import FaceTriangulations
from service.engine.vectors import NEXT

CUTTING_ROUNDS = 8
"""How often the triangles of a face are measured before it goes to Delaunay insertion, if many
still fail."""

MANY = 0.02
"""Failing triangles are many if they are more than this share of the triangles of a face."""

LONGEST = 60
"""How often the triangles of a face are measured before it is given up."""

REPAIRS = 10
"""How often edges are cut that exist twice, or whose normals turn too far."""

Step: TypeAlias = Callable[[Triangles, Mates, Ints], Triangles]
"""Refines faces, given their triangles and the rows of the failing ones."""


class Refinement:
    """Refines the triangles of all faces; a face is done when none of its triangles fails.

    Parameters
    ----------
    measure : TriangleMeasure
    triangulations : FaceTriangulations
        With the points of `measure.corners`.
    """

    def __init__(self, measure: TriangleMeasure, triangulations: FaceTriangulations) -> None:
        self._measure, self._triangulations = measure, triangulations
        self._done: list[Triangles] = []
        self.rounds = 0

    def run(self) -> Triangles:
        """The triangles inside of all faces, face after face.

        Raises
        ------
        TooLarge
            `too_many_triangles`, `too_costly`.
        """
        failing = self._refine(self._read(self._triangulations.faces), self._cut, CUTTING_ROUNDS)
        if len(failing):
            self._drop(failing)
            self._refine(self._read(failing.tolist()), self._insert, LONGEST)
        for _ in range(REPAIRS):
            triangles = self._join()
            edges = self._find_faulty_edges(triangles)
            if not len(edges):
                return triangles
            mates = find_mates(triangles.corners)
            divided = self._divide(triangles, mates, join_mates(mates, edges), edges[:0])
            if len(divided) == len(triangles):  # no edge can be cut
                return triangles
            self._done = []
            self._refine(divided, self._cut, CUTTING_ROUNDS)
        return self._join()

    def _read(self, faces: list[int]) -> Triangles:
        """The triangles of faces as they are in the triangulations."""
        return self._measure.build(self._triangulations.read(faces)[0])

    def _refine(self, triangles: Triangles, step: Step, most: int) -> Ints:
        """Measure and refine triangles until their faces are done; the faces that are not.

        A face with many failing triangles has `most` rounds, others have `LONGEST`. All triangles
        are added to those that are done.
        """
        corners, measure = self._measure.corners, self._measure
        count = len(corners.surface.surfaces)
        is_stuck, is_left = np.zeros(count, bool), np.zeros(count, bool)
        done = sum(self._count(each) for each in self._done)
        for round_number in range(1, LONGEST + 1 if len(triangles) else 1):
            self.rounds += 1
            mates = find_mates(triangles.corners)
            triangles = measure.measure(triangles, mates)
            measure.limits.count(done + self._count(triangles))
            faces, fails = corners.faces[triangles.corners[0]], triangles.fails
            failing = np.bincount(faces[fails], minlength=count)
            is_failing = failing > 0
            has_many = failing > MANY * np.bincount(faces, minlength=count)
            ends = is_stuck | (has_many & (round_number >= most)) | (round_number == LONGEST)
            ends &= is_failing
            is_left |= ends
            goes = (is_failing & ~ends)[faces]
            if not goes.all():
                self._done.append(triangles.take(~goes))
                done += self._count(self._done[-1])
                if goes.any():
                    triangles, fails = triangles.take(goes), fails[goes]
                    mates = find_mates(triangles.corners)
            if not goes.any():
                break
            triangles = step(triangles, mates, fails.nonzero()[0])
            # A face in which nothing moved would not move in the next round either.
            is_stuck[:] = True
            is_stuck[corners.faces[triangles.corners[0, triangles.is_changed]]] = False
        return is_left.nonzero()[0]

    def _count(self, triangles: Triangles) -> int:
        """The number of triangles with three points: others, at poles, are not in the mesh."""
        points = self._measure.corners.points[triangles.corners]
        return int(np.count_nonzero((points != points[NEXT]).all(axis=0)))

    def _cut(self, triangles: Triangles, mates: Mates, rows: Ints) -> Triangles:
        """Flip and cut edges of failing triangles."""
        corners, tolerance = self._measure.corners, self._measure.goal.tolerance
        triangles, flipped = flip_edges(corners, triangles, mates, rows, tolerance)
        if len(flipped):
            mates = find_mates(triangles.corners)
            rows = np.setdiff1d(rows, flipped)
        edges, without = choose_edges(corners, triangles, mates, rows)
        return self._divide(triangles, mates, edges, without)

    def _divide(self, triangles: Triangles, mates: Mates, edges: Ints, without: Ints) -> Triangles:
        """Cut edges, and divide the triangles `without` such edges at their middles."""
        corners = self._measure.corners
        removed, added = cut_edges(corners, triangles, mates, edges)
        without = without[~removed[without]]
        if len(without):
            also_removed, also_added = add_middles(corners, triangles, without)
            removed |= also_removed
            added = np.concatenate([added, also_added], axis=1)
        return Triangles.join([triangles.take(~removed), self._measure.build(added)])

    def _insert(self, triangles: Triangles, mates: Mates, rows: Ints) -> Triangles:
        """Insert places for failing triangles into the triangulations of their faces."""
        corners = self._measure.corners
        faces, places = choose_places(corners, triangles, mates, rows)
        self._triangulations.insert(faces, places, len(corners.places))
        corners.add(faces, places)
        owners = corners.faces[triangles.corners[0]]
        active = np.unique(owners)
        new, previous = self._triangulations.read(active.tolist())
        result = self._measure.build(new)
        # Triangles that are still there keep their bounds.
        known = (previous >= 0).nonzero()[0]
        first = np.searchsorted(owners, corners.faces[new[0, known]])
        before = triangles.take(first + previous[known])
        result.bounds[known], result.is_wide[known] = before.bounds, before.is_wide
        result.mesh_bounds[known] = before.mesh_bounds
        result.is_changed[known] = False
        return result

    def _find_faulty_edges(self, triangles: Triangles) -> Ints:
        """Edges inside faces that exist twice, or whose normals turn too far."""
        corners, angle = self._measure.corners, self._measure.goal.angle
        fixed = corners.find_fixed(triangles.corners)
        edges = find_double_edges(corners.points[triangles.corners], fixed)
        if angle < np.pi:
            turning = find_turning_edges(corners, triangles.corners, angle)
            edges = np.concatenate([edges, turning.ravel().nonzero()[0]])
        return edges

    def _drop(self, faces: Ints) -> None:
        """Forget the triangles of these faces."""
        owner = self._measure.corners.faces
        self._done = [each.take(~np.isin(owner[each.corners[0]], faces)) for each in self._done]

    def _join(self) -> Triangles:
        """All triangles, sorted by face."""
        if not self._done:
            return self._measure.build(np.empty((3, 0), np.intp))
        every = Triangles.join(self._done)
        faces = self._measure.corners.faces[every.corners[0]]
        return every.take(np.argsort(faces, kind="stable"))
