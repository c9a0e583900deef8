"""Meshes of one brep by tolerance: prepared once, for all meshes of a request."""

from dataclasses import replace

import numpy as np

from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.adaptive.tolerances import move_goal, subtract_rounding
from service.engine.bounds.goal import Goal
from service.engine.brep.assemble import assemble
from service.engine.brep.meshing import triangulate_brep
from service.engine.brep.prepared import PreparedBrep
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.scenes.painting import paint_parts
from service.engine.stored_positions import Storage, bound_origin_error
from service.surface.brep_model import BrepModel

COARSEST = 0.02
"""The greatest tolerance of a mesh, as a share of the diagonal of the brep: much coarser meshes
fold."""


class BrepMesher:
    """Builds meshes of one brep; all that does not depend on the tolerance is given.

    Parameters
    ----------
    prepared : PreparedBrep
        Its model has the box of the prepared brep.
    options : MeshOptions
    storage : Storage
    paints : bool
        Whether vertices get the colours of faces, for formats whose parts have no colours.
    """

    def __init__(
        self,
        prepared: PreparedBrep,
        options: MeshOptions,
        storage: Storage,
        *,
        paints: bool = False,
    ) -> None:
        self._paints = paints
        self._prepared, self._options, self._storage = prepared, options, storage
        self.model: BrepModel = prepared.model

    def build_mesh(self, goal: Goal, most: int, effort: Effort | None = None) -> Mesh:
        """The mesh that meets a goal, or the nearest that the gaps of the brep allow.

        See `service.engine.meshers.Mesher`. A view becomes the tolerance that it allows at the
        point of the box that is nearest to the eye.
        """
        prepared, storage = self._prepared, self._storage
        low, high = prepared.box
        origin = storage.choose_origin(low, high)
        nearest = np.array([goal.find_nearest_distance(low, high)])
        allowed = float(goal.find_allowed(nearest)[0])
        goal = replace(goal, tolerance=min(allowed, COARSEST * prepared.diagonal), view=None)
        # The brep is not placed here: this only subtracts the rounding of adding the origin.
        goal = move_goal(goal, None, (low, high), bound_origin_error(origin, low, high))
        rounding = storage.bound_storage_rounding(origin, low, high)
        triangulation = triangulate_brep(
            prepared,
            subtract_rounding(goal, rounding, (low, high)),
            MeshLimits(most, effort or Effort()),
        )
        mesh = assemble(
            prepared,
            triangulation,
            replace(goal, tolerance=allowed),
            self._options,
            storage=storage,
            origin=origin,
        )
        return paint_parts(mesh) if self._paints else mesh
