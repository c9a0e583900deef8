"""The task of dividing: faces, their patches, the goal, and limits of work."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.adaptive.cutting.cells import Cells
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.faces import SPAN, Faces
from service.engine.bounds.goal import Goal
from service.engine.bounds.patch_nets import PatchNets
from service.engine.bounds.vectors import Vectors


@dataclass(frozen=True, eq=False, slots=True)
class Task:
    """Faces to be divided, with their patches, the goal of their triangles, and limits."""

    patch_nets: PatchNets
    faces: Faces
    goal: Goal
    limits: MeshLimits

    def find_patches(self, cells: Cells) -> Ints:
        """The patches (m,) in which cells of one span lie."""
        return self.find_patches_at(cells.face, cells.box[0], cells.box[2])

    def find_patches_at(self, face: Ints, u: Ints, v: Ints) -> Ints:
        """The patches (m,) at places; on a knot line the patch after it, if there is one."""
        faces = self.faces
        k, l = (  # noqa: E741
            np.minimum(place // SPAN, faces.spans[face, axis] - 1)
            for axis, place in enumerate((u, v))
        )
        patch: Ints = faces.first[face] + k * faces.stride[face] + l
        return patch

    def evaluate_points(self, face: Ints, u: Ints, v: Ints) -> FloatArray:
        """Points of the surface at places, shape (m, 3), model coordinates."""
        ends = self.faces.spans[face].T * SPAN
        inner = (
            np.where(place == end, SPAN, place % SPAN) / SPAN
            for place, end in zip((u, v), ends, strict=True)
        )
        return self.patch_nets.evaluate_points(self.find_patches_at(face, u, v), *inner)

    def estimate_work(self, face: Ints, places: Ints) -> float:
        """Cost of certifying triangles (m, 3, 2) of places of faces, in multiplications, about."""
        costs = np.array([nets.piece_cost for nets in self.patch_nets.groups], dtype=np.float64)
        costs = costs[self.patch_nets.group[self.faces.first[face]]]
        if int(self.faces.spans.max()) == 1:
            return 1.5 * float(costs.sum())
        # A triangle has a piece in half of the patches in its box, and along one of its edges.
        first, last = places.min(axis=1) // SPAN, -(-places.max(axis=1) // SPAN)
        long, wide = np.maximum(last - first, 1).T.astype(np.float64)
        pieces = (long * wide + long + wide) / 2
        return float((pieces * costs).sum())

    def find_eyes(self, patch: Ints) -> Vectors | None:
        """The eye of the goal's view in the coordinates of the nets of these patches."""
        if self.goal.view is None:
            return None
        return self.goal.view.eye[:, np.newaxis] - self.patch_nets.middles.take(patch, axis=1)
