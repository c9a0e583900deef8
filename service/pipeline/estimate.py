"""Estimates the size of a mesh without making it, and lists the reasons to refuse it."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import inf

import numpy as np

from service.encoders.format import EncodeOptions, Format, MeshSize
from service.encoders.registry import FORMATS
from service.encoders.text import json_text
from service.engine.accuracy import Accuracy
from service.engine.adaptive.limits import MostTriangles, bound_triangles
from service.engine.adaptive.tolerances import (
    build_goal,
    build_model_goals,
    separate_copies,
    subtract_rounding,
)
from service.engine.curvatures.placement_scale import add_stretches
from service.engine.curvatures.rows import is_affordable
from service.engine.joining.join import join
from service.engine.joining.members import join_group
from service.engine.meshers import COPY_WEIGHT
from service.engine.options import MeshOptions
from service.engine.plans.counts import Counts, count_mesh
from service.engine.quantize import find_grid_error
from service.errors import InvalidRequest, Issue, SurfaceError, TooLarge
from service.pipeline.brep_checks import settle_accuracy
from service.pipeline.checks import check_surface
from service.pipeline.cost import Cost, Work
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.mesh import keep_storable_channels
from service.pipeline.mesh_costs import EFFORT_FACTOR, adaptive_triangles, estimation_cost
from service.pipeline.mesh_counts import count_models, mesh_size, sum_counts
from service.pipeline.mesh_plan import PLAIN, build_plan, estimate_stored_size, shares_meshes
from service.pipeline.orienting import orient, plan_orientation
from service.surface.brep_model import BrepModel
from service.surface.curve_model import SweepModel
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sizes import SurfaceKind

ROUNDING_SHARE = 2.0**-16
"""A tolerance above this share of the largest coordinate is larger than all rounding."""

GRID_FACTOR = 4
"""A tolerance of at least this factor times the largest error of quantizing leaves enough room for
quantizing."""


@dataclass(frozen=True, slots=True)
class _Prediction:
    """Exact counts or upper bounds of a mesh.

    Attributes
    ----------
    distinct_counts, all_counts : Counts
        The counts if each distinct surface of a group counts once, and if all copies count.
    exact : bool
        Whether the counts are exact.
    certain : bool
        Whether no later check can refuse the mesh.
    line_points : int or None
        For a mesh by tolerance: upper bound of the points of lines, and of their segments, in
        addition to those that `MeshSize` already has. None for a mesh by resolution.
    """

    distinct_counts: Counts
    all_counts: Counts
    exact: bool
    certain: bool = True
    line_points: int | None = None

    def reduce_size(self, size: MeshSize, *, is_shared: bool) -> MeshSize:
        """The upper bounds `size`, with the smaller counts of this prediction where they apply.

        Vertices of a mesh by resolution stay as in `size`, because a file stores a welded vertex
        several times if its normals differ. `is_shared` says whether copies share one mesh.
        """
        counts = self.distinct_counts if is_shared else self.all_counts
        is_by_tolerance = self.line_points is not None
        if not (self.exact or is_by_tolerance):
            return size
        line_points = self.line_points or 0
        return replace(
            size,
            vertices=counts.vertices if is_by_tolerance else size.vertices,
            triangles=counts.triangles,
            quads=counts.quads,
            overlay_points=size.overlay_points + line_points,
            overlay_segments=size.overlay_segments + line_points,
        )


def plan_estimate(
    surface: SurfaceKind,
    options: MeshOptions,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
    formats: Sequence[Format] = FORMATS,
) -> Work[bytes]:
    """Plan an estimate: estimate its own cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The surface exceeds a limit.
    """
    check_surface(surface.stored_size(), limits)
    size = surface.size()
    options = settle_accuracy(size, options)
    cost = estimation_cost(size, options, len(formats), limits)
    if options.orient:
        orientation = plan_orientation(size, limits, "/orient")
        memory = max(cost.memory, orientation.memory)
        cost = Cost(memory, cost.seconds + orientation.seconds)
    return Work(cost, partial(_estimate, surface, options, encode, limits, formats))


def _estimate(
    surface: SurfaceKind,
    options: MeshOptions,
    encode: EncodeOptions,
    limits: Limits,
    formats: Sequence[Format],
) -> bytes:
    """Estimate the size of the file in each format, list the refusals, and write them as JSON.

    `accepted` says whether the service would return the mesh in at least one format. It is
    `certain` unless a mesh that is accepted in some format may still be refused in it by a later
    check. Counts and bytes are upper bounds unless they are exact.

    The estimate finds the shared edges but evaluates no points. So it takes much less time than
    the mesh.
    """
    if options.orient:
        surface, _ = orient(surface, options.weld_tolerance)
    model, has_joined_members = surface.lower(), False
    if isinstance(model, GroupModel):
        joined_group = join_group(model, options)
        model, has_joined_members = joined_group.group, bool(joined_group.clusters)
    elif isinstance(model, PatchModel):
        model, _ = join(model, options.weld_tolerance)
    if options.curvatures:
        # Copies with different curvatures are stored separately.
        model = add_stretches(model)
    bounds = distinct_bound, all_bound = count_models(model, options)
    # Numbers of vertices and faces do not depend on the format, so any format will do.
    size_bound = mesh_size(surface.size(), options, formats[0], all_bound)
    prediction = _predict(model, size_bound, options, encode, limits)
    if has_joined_members and options.accuracy is None:
        # The prediction counts the vertices on common borders of members once, but the mesh has
        # them in each of these members. So only the upper bounds are known.
        prediction = _Prediction(*bounds, exact=False, certain=prediction.certain)
    sizes: dict[str, int] = {}
    memory: dict[str, int] = {}
    refused_formats: dict[Issue, list[str]] = {}
    certain = prediction.certain
    for fmt in formats:
        storable_model, storable_options = keep_storable_channels(model, options, fmt)
        try:
            plan = build_plan(surface, options, fmt, encode, limits)
            plan.check(storable_model, storable_options, bounds)
            memory[fmt.name] = plan.cost.memory
            if options.accuracy is not None:
                # A mesh with more triangles than its cost allows is refused while it is built.
                certain &= prediction.all_counts.triangles <= plan.max_triangles
        except SurfaceError as error:
            for issue in error.issues:
                refused_formats.setdefault(issue, []).append(fmt.name)
            # Only a mesh that is refused as too large can be stored, so only it has a size.
            if not isinstance(error, TooLarge):
                continue
        is_shared = shares_meshes(fmt, encode)
        stored_size = estimate_stored_size(surface, options, fmt, encode)
        size = mesh_size(
            stored_size, storable_options, fmt, distinct_bound if is_shared else all_bound
        )
        byte_bound = fmt.byte_bound(prediction.reduce_size(size, is_shared=is_shared), encode)
        if options.accuracy is not None:
            certain &= byte_bound <= limits.max_bytes
            byte_bound = min(byte_bound, limits.max_bytes, options.accuracy.max_bytes or byte_bound)
        sizes[fmt.name] = byte_bound
    # The length of a text depends on its numbers.
    is_binary = encode.stl == "binary"
    is_exact = {f.name: prediction.exact and f.has_exact_bound and is_binary for f in formats}
    estimate = {
        **asdict(prediction.all_counts),
        "exact": prediction.exact,
        "bytes": sizes,
        "exact_bytes": [name for name in sizes if is_exact[name]],
        "memory": memory,
        "accepted": bool(memory),
        "certain": certain or not memory,
        "refused": [
            {
                "formats": names,
                "code": issue.code,
                "pointer": issue.pointer,
                "detail": issue.message,
                "got": issue.got,
                "needed": issue.needed,
            }
            for issue, names in refused_formats.items()
        ],
    }
    return json_text(estimate)


def _predict(
    model: Model, size: MeshSize, options: MeshOptions, encode: EncodeOptions, limits: Limits
) -> _Prediction:
    """Predict the counts of the mesh of a model, which do not exceed the counts of `size`.

    For a mesh by resolution the prediction is exact, with these exceptions: tubes, ribbons and
    solid wires, whose corners are counted only while they are built; and meshes that exceed the
    limits.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small`, as when the mesh is made.
    """
    models = model.models if isinstance(model, GroupModel) else (model,)
    patch_models = [submodel for submodel in models if isinstance(submodel, PatchModel)]
    counts_bound = Counts(size.vertices, size.triangles, size.quads)
    has_sweeps = any(isinstance(submodel, SweepModel) for submodel in models)
    has_breps = any(isinstance(submodel, BrepModel) for submodel in models)
    if has_breps or (has_sweeps and options.accuracy is not None):
        return _predict_limits(options, limits, is_group=isinstance(model, GroupModel))
    # The second condition follows from the first, and only tells mypy the type of the model.
    if len(patch_models) < len(models) or not isinstance(model, PatchModel | GroupModel):
        return _Prediction(counts_bound, counts_bound, exact=False)
    if options.accuracy is not None:
        return _predict_by_tolerance(model, patch_models, options, encode, limits)
    if options.has_solid_wires or size.vertices > limits.max_vertices:
        return _Prediction(counts_bound, counts_bound, exact=False)
    counts = [
        count_mesh(submodel, options) if options.has_faces else Counts(0, 0, 0)
        for submodel in patch_models
    ]
    certain = not options.curvatures or is_affordable(patch_models, size.vertices)
    return _Prediction(*sum_counts(model, counts), exact=True, certain=certain)


def _predict_limits(options: MeshOptions, limits: Limits, *, is_group: bool) -> _Prediction:
    """The limits of triangles and vertices: only the mesh of a brep or sweep shows its counts."""
    accuracy = options.accuracy or Accuracy()
    triangles = adaptive_triangles(accuracy, limits)
    most = Counts(min(limits.max_vertices, 2 * triangles), triangles, 0)
    placed = most
    if is_group and accuracy.max_triangles is None:  # formats that share meshes may place more
        factor = round(1 / COPY_WEIGHT)
        placed = Counts(factor * most.vertices, factor * triangles, 0)
    # Each edge with a point of a line is an edge of a triangle.
    line_points = most.vertices if options.overlays else 0
    return _Prediction(most, placed, exact=False, certain=False, line_points=line_points)


def _predict_by_tolerance(
    model: PatchModel | GroupModel,
    patch_models: list[PatchModel],
    options: MeshOptions,
    encode: EncodeOptions,
    limits: Limits,
) -> _Prediction:
    """Upper bounds of the counts of a mesh by tolerance; they do not exceed the limits."""
    accuracy = options.accuracy or Accuracy()
    moved = find_grid_error(model, options) if encode.quantize else 0.0
    try:
        distinct_bound, all_bound = _bound_meshes(model, options, accuracy, moved)
    except InvalidRequest as error:
        raise InvalidRequest(
            *(replace(issue, pointer=accuracy.pointer) for issue in error.issues)
        ) from None
    if not (options.has_faces or options.has_wires):
        none = Counts(0, 0, 0)
        return _Prediction(none, none, exact=True, line_points=all_bound.points)
    allowed = adaptive_triangles(accuracy, limits)
    # For a budget or an angle tolerance, the only bound of the triangles is `allowed`.
    is_bounded = not accuracy.is_budgeted and accuracy.angle_tolerance is None
    degree = max(
        max(batch.side_degrees) for patch_model in patch_models for batch in patch_model.batches
    )
    # The multiplications for one triangle of the bound. The proof of a triangle takes more, but
    # most meshes have only a tenth of the triangles of the bound.
    triangle_effort = 16 * (degree + 1) ** 2 * (2 * degree)
    certain = (
        is_bounded
        and all_bound.triangles + all_bound.points <= allowed
        and all_bound.vertices + all_bound.points <= limits.max_vertices
        and all_bound.triangles * triangle_effort <= EFFORT_FACTOR * limits.max_multiplications
        and _is_above_rounding(model, accuracy, moved)
        and (not options.curvatures or is_affordable(patch_models, all_bound.vertices))
    )

    def clip(bound: MostTriangles) -> Counts:
        triangles = min(bound.triangles, allowed) if is_bounded else allowed
        # A patch of T triangles has at most T + 2 vertices.
        vertices = min(limits.max_vertices, triangles + 2 * model.patch_count)
        return Counts(min(vertices, bound.vertices) if is_bounded else vertices, triangles, 0)

    return _Prediction(
        clip(distinct_bound),
        clip(all_bound),
        exact=False,
        certain=certain,
        line_points=all_bound.points,
    )


def _bound_meshes(
    model: PatchModel | GroupModel, options: MeshOptions, accuracy: Accuracy, moved: float
) -> tuple[MostTriangles, MostTriangles]:
    """Upper bounds of the triangles of a mesh by tolerance.

    `moved` is the largest distance by which quantizing moves a vertex.

    Returns
    -------
    distinct_bound, all_bound : MostTriangles
        The bounds if each distinct model of a group counts once, and if all copies count.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small`, without a pointer: the placements of a group magnify the rounding so
        that little of the tolerance is left.
    """
    goal = build_goal(accuracy, model)
    if isinstance(model, PatchModel):
        triangles = bound_triangles(model, subtract_rounding(goal, moved, model.bounds), options)
        return triangles, triangles
    # For a camera every copy has a mesh of its own, because its distance is its own.
    group = model if goal.view is None else separate_copies(model)
    goals = build_model_goals(goal, group, moved)
    # All models are `PatchModel`s (`_predict` has checked it), so `bounds` has one for each model.
    bounds = [
        bound_triangles(submodel, model_goal, options)
        for submodel, model_goal in zip(group.models, goals, strict=True)
        if isinstance(submodel, PatchModel)
    ]
    return _add_bounds(bounds), _add_bounds(bounds[member.model] for member in group.members)


def _add_bounds(bounds: Iterable[MostTriangles]) -> MostTriangles:
    return MostTriangles(*map(sum, zip(*bounds, strict=True)))


def _is_above_rounding(model: PatchModel | GroupModel, accuracy: Accuracy, moved: float) -> bool:
    """Whether the tolerance is so large that the rounding of no format matters.

    `moved` is the largest distance by which quantizing moves a vertex.
    """
    goal = build_goal(accuracy, model)
    # A camera allows the least error where the surface is nearest to it.
    allowed_by_view = inf if goal.view is None else goal.view.rate * goal.view.near
    min_tolerance = min(goal.tolerance, allowed_by_view)
    return min_tolerance >= ROUNDING_SHARE * float(np.abs(model.bounds).max()) + GRID_FACTOR * moved
