"""Meshes by tolerance of one model of patches.

1. The goal is converted to the units of the model (`tolerances`).
2. Patches are joined to faces, and the sides of faces are divided (`faces`, `border`).
3. The faces are divided until every triangle is certified (`refine`).
4. Triangles become a mesh (`assemble`).

`service.engine.meshers` chooses the mesher of a model, and makes scenes of groups.
"""

from dataclasses import replace
from math import pi

from service.engine.adaptive.assemble import assemble, draw_overlays
from service.engine.adaptive.borders.border import divide_border
from service.engine.adaptive.borders.curves import SideNormals, build_side_normals
from service.engine.adaptive.limits import (
    Effort,
    MeshLimits,
    estimate_least_triangles,
    sample_goal_isocurves,
)
from service.engine.adaptive.refine import triangulate
from service.engine.adaptive.tolerances import limit_tolerance, move_goal, tighten_for_border
from service.engine.bounds.faces import find_faces
from service.engine.bounds.goal import Goal, check_goal, find_least_tolerance
from service.engine.connectivity.closure import find_closure
from service.engine.connectivity.curve_patches import leave_out_curves
from service.engine.connectivity.seams import Seams, find_seams
from service.engine.mesh.mesh import Mesh
from service.engine.nets.patch_nets import PatchNets
from service.engine.options import MeshOptions
from service.engine.stored_positions import Storage, bound_origin_error
from service.engine.wires.draw import add_wires, build_line_mesh
from service.surface.lowered import PatchModel


class ModelMesher:
    """Builds meshes of one model; its nets, seams and faces are computed once for all meshes.

    `seams` are those of the model, if they are known.
    """

    def __init__(
        self, model: PatchModel, options: MeshOptions, storage: Storage, seams: Seams | None = None
    ) -> None:
        self._options, self._storage = options, storage
        self._origin = storage.choose_origin(*model.bounds)
        # `find_seams` makes weights of an edge equal whatever the factors of its sides.
        has_weights = any(batch.weights is not None for batch in model.batches)
        seams = find_seams(model.batches) if seams is None or has_weights else seams.orient()
        self._closure = find_closure(model, seams.connectivity)
        if seams.connectivity.has_thin:  # some patches may be curves
            model = leave_out_curves(model, seams.connectivity)
            seams = find_seams(model.batches)
        self.model, self.seams, self._patch_nets = model, seams, PatchNets.of(model)
        self._faces = find_faces(model, self.seams)

    def build_mesh(
        self,
        goal: Goal,
        most: int,
        effort: Effort | None = None,
        normals: SideNormals | None = None,
    ) -> Mesh:
        """The mesh that meets a goal.

        Parameters
        ----------
        goal : Goal
            In the coordinates of the model.
        most : int
            Largest number of triangles.
        effort : Effort, optional
            Limit of the work of all meshes of a request.
        normals : SideNormals, optional
            Normals along the edges of the model, if it is meshed together with other models and the
            goal has an angle.

        Raises
        ------
        InvalidRequest
            `tolerance_too_small` if the tolerance is below the rounding errors.
        TooLarge
            `too_many_triangles` or `too_costly`, as soon as it is known that a limit is too low.
        """
        model, options, storage = self.model, self._options, self._storage
        origin = self._origin
        # The model is not placed here: this only subtracts the rounding of adding the origin.
        goal = move_goal(goal, None, model.bounds, bound_origin_error(origin, *model.bounds))
        rounding = storage.bound_storage_rounding(origin, *model.bounds)
        least = find_least_tolerance(self._patch_nets, rounding)
        goal = limit_tolerance(goal, model.diagonal, least)
        check_goal(goal, least, goal.find_nearest_distance(*model.bounds))
        if goal.angle < pi:
            # An impossible angle is refused at once, not after all the work of refinement.
            MeshLimits(most).count(int(estimate_least_triangles(model, goal.angle)))
        if normals is None and goal.angle < pi:
            (normals,) = build_side_normals([(model.batches, self.seams)])
        edge_goal = tighten_for_border(goal, rounding, model.bounds)
        border = divide_border(self._faces, self.seams, edge_goal, most, normals)
        overlays = draw_overlays(model, border, options, storage, origin)
        if options.has_faces:
            triangulation = triangulate(
                self._patch_nets,
                self._faces,
                border,
                goal,
                store=lambda positions: storage.restore_positions(positions, origin),
                most=most,
                effort=effort,
            )
            mesh = assemble(
                model,
                self._faces,
                triangulation,
                options,
                overlays,
                storage=storage,
                origin=origin,
                closure=self._closure,
            )
        else:
            lines = build_line_mesh(model, options, overlays, origin, storage.dtype)
            mesh = replace(lines, step=storage.step)
        if options.has_wires:
            most -= len(mesh.triangles)
            curves = sample_goal_isocurves(model, self.seams, goal, options, most)
            mesh = add_wires(mesh, model, options, curves)
        return mesh
