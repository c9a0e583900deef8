"""Bounds of the distance from the surface over triangles of places to the mesh.

A triangle is compared with its own triangle of the mesh and the neighbours of that
(`service.engine.bounds.certificate`). Three kinds are measured otherwise:

- An affine surface over a triangle is a triangle, so it is no further than its corners are.
- A *flat* triangle, with two equal points, is not in the mesh. It is compared with the triangles
  beyond its edges; if that does not help, with others of its face that have its points.
- A triangle may be near the mesh although it is not near its own triangle, because the surface is
  parametrised unevenly. It is also compared with the triangles at its corners (`nearest`).

Proof in docs/proofs.md: "Triangles of trimmed faces".
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.engine.adaptive.cutting.cells import estimate_piece_cost
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.certificate import PieceMeasure
from service.engine.bounds.clip import Parts, clip_parts
from service.engine.bounds.goal import Goal
from service.engine.brep.filling.corners import FaceCorners
from service.engine.brep.filling.nearest import NearestMeasure
from service.engine.brep.filling.neighbours import Neighbours
from service.engine.brep.filling.reverse import bound_reverse, find_maxima
from service.engine.brep.filling.triangles import Mates, Triangles, build_triangles
from service.engine.vectors import NEXT

FAR = 0.4
"""Corners further from the surface than this share of the tolerance have a gap that counts."""

REVERSE_WORK = 5e3
"""Multiplications to bound the distance of a triangle of the mesh from the surface, roughly."""

BLOCK = 1 << 10
"""The most triangles that are measured in one step; it limits memory."""


@dataclass(frozen=True, eq=False, slots=True)
class TriangleMeasure:
    """Measures triangles of faces; `limits` counts the work.

    Attributes
    ----------
    corners : FaceCorners
    aims : ndarray of float64, shape (F,)
        The bound that triangles of each face shall reach.
    beside : ndarray of float64, shape (F,)
        How much is added to distances from the mesh where polygons reach beyond their loops.
        Triangles of the mesh shall be nearer to the surface than twice the aim by this, but no
        nearer than the aim.
    goal : Goal
    limits : MeshLimits
    """

    corners: FaceCorners
    aims: FloatArray
    beside: FloatArray
    goal: Goal
    limits: MeshLimits

    def build(self, corners: Ints) -> Triangles:
        """Triangles (3, T) that have not been measured yet."""
        allowed = self._find_allowed(corners)
        beside = self.beside[self.corners.faces[corners[0]]]
        return build_triangles(corners, allowed, np.maximum(2 * allowed - beside, allowed))

    def measure(self, triangles: Triangles, mates: Mates) -> Triangles:
        """The triangles, with the bounds of those that changed, or that have changed neighbours."""
        fixed = self.corners.find_fixed(triangles.corners)
        neighbours = Neighbours(
            self.corners.points, triangles.corners, np.where(fixed, -1, mates.beyond)
        )
        rows = neighbours.find_outdated(triangles).nonzero()[0]
        bounds, is_wide = triangles.bounds.copy(), triangles.is_wide.copy()
        bounds[rows], is_wide[rows], far = self._measure_rows(triangles, neighbours, rows)
        # What rests on triangles that are no neighbours must always be measured again.
        is_changed = np.zeros(len(triangles), bool)
        is_changed[rows[far]] = True
        return replace(
            triangles,
            bounds=bounds,
            mesh_bounds=self._measure_mesh(triangles),
            is_wide=is_wide,
            is_changed=is_changed,
        )

    def _measure_mesh(self, triangles: Triangles) -> FloatArray:
        """`mesh_bounds` of triangles (T,), computed for those that changed.

        A triangle with two equal points is not in the mesh; on a plane the corners are furthest.
        """
        corners, bounds = self.corners, triangles.mesh_bounds.copy()
        if not self.goal.two_sided:
            return bounds
        rows = triangles.is_changed.nonzero()[0]
        own = triangles.corners.take(rows, axis=1)
        points, faces = corners.points[own], corners.faces[own[0]]
        surfaces = corners.surface.surfaces
        found = corners.residuals[own].max(axis=0) + surfaces.errors[faces]
        curved = (~surfaces.is_planar[faces]).nonzero()[0]
        self.limits.spend(REVERSE_WORK * len(curved))
        found[curved] = bound_reverse(corners, own.take(curved, axis=1), self.goal.tolerance)
        found[(points == points[NEXT]).any(axis=0)] = 0.0
        bounds[rows] = found
        return bounds

    def _measure_rows(
        self, triangles: Triangles, neighbours: Neighbours, rows: Ints
    ) -> tuple[FloatArray, Bools, Ints]:
        """Bounds of these triangles; whether they rest on others than the neighbours.

        The last result are the columns of those that rest on triangles further away.
        """
        corners, surfaces = self.corners, self.corners.surface.surfaces
        own = triangles.corners.take(rows, axis=1)
        faces, points = corners.faces[own[0]], corners.points[own]
        is_flat: Bools = (points == points[NEXT]).any(axis=0)
        bounds = np.full(len(rows), np.inf)
        affine = (surfaces.is_planar[faces] & ~is_flat).nonzero()[0]
        bounds[affine] = (
            corners.residuals[own[:, affine]].max(axis=0) + surfaces.errors[faces[affine]]
        )
        curved = (~surfaces.is_planar[faces] & ~is_flat).nonzero()[0]
        references = [(curved, rows[curved])]
        if is_flat.any():
            references.append(neighbours.list_beyond(rows, is_flat.nonzero()[0]))
        self._lower(bounds, own, references, neighbours)
        before = np.where(is_flat, np.inf, bounds)
        failing = curved[~(bounds[curved] <= triangles.allowed[rows[curved]])]
        if len(failing):
            nearest = NearestMeasure(corners, neighbours, self.goal, self.limits)
            near = nearest.bound(rows[failing], triangles.allowed[rows[failing]])
            bounds[failing] = np.minimum(bounds[failing], near)
        far = (~(bounds <= triangles.allowed[rows]) & is_flat).nonzero()[0]
        if len(far):
            every_face = corners.faces[triangles.corners[0]]
            at_points = neighbours.list_at_points(every_face, rows, far)
            self._lower(bounds, own, [at_points], neighbours)
            far = np.unique(at_points[0])
        return bounds, bounds < before, far

    def _lower(
        self,
        bounds: FloatArray,
        own: Ints,
        references: list[tuple[Ints, Ints]],
        neighbours: Neighbours,
    ) -> None:
        """Lower bounds of triangles `own` (3, m) to those against triangles of the mesh.

        `references` are pairs of a column of `own`, and a row of the triangles of the mesh.
        """
        measured = np.concatenate([pair[0] for pair in references])
        reference = np.concatenate([pair[1] for pair in references])
        for rows in row_slices(len(measured), 1, BLOCK):
            chosen = own.take(measured[rows], axis=1)
            points, across = neighbours.list_points(reference[rows])
            places = self.corners.places[chosen].swapaxes(1, 2)
            faces = self.corners.faces[chosen[0]]
            is_own = np.ones(len(faces), bool)
            parts = Parts(faces, np.ascontiguousarray(places), points, across, is_own)
            np.minimum.at(bounds, measured[rows], self._bound_parts(parts))

    def _find_allowed(self, corners: Ints) -> FloatArray:
        """The largest bounds (T,) at which triangles (3, T) may stay.

        Where an edge is far from the surface, the gap is added: no triangle there can be nearer.
        """
        allowed: FloatArray = self.aims[self.corners.faces[corners[0]]]
        gaps = self.corners.residuals[corners].max(axis=0)
        tolerance = self.goal.tolerance
        far = (gaps > FAR * tolerance).nonzero()[0]
        allowed[far] = np.maximum(tolerance, 1.1 * gaps[far] + 0.8 * tolerance)
        return allowed

    def _bound_parts(self, parts: Parts) -> FloatArray:
        """Bounds (m,) of the distances from the surface over parts to their references."""
        surface = self.corners.surface
        nets = surface.surfaces.nets
        pieces = clip_parts(surface, parts.face, parts.corners)
        costs = np.array([estimate_piece_cost(*group.degree) for group in nets.groups], np.float64)
        self.limits.spend(float(costs[nets.group[pieces.patch]].sum()))
        bounds = np.zeros((3, len(pieces.part)))
        measure = PieceMeasure(nets, parts, pieces, self.corners.positions, self.goal, None)
        measure.bound_pieces(bounds, np.arange(len(pieces.part)))
        return find_maxima(bounds[0], pieces.part, len(parts.face))
