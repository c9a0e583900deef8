"""The size of a mesh before it is made, and the reasons for which it would be refused."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from math import inf

import numpy as np

from service.encoders.format import EncodeOptions, Format, MeshSize
from service.encoders.registry import FORMATS
from service.engine.adaptive.size_bound import MostTriangles, bound_triangles
from service.engine.adaptive.tolerance_spec import Accuracy
from service.engine.adaptive.tolerances import (
    build_goal,
    build_model_goals,
    separate_copies,
    subtract_rounding,
)
from service.engine.curvatures.limit_curvature import is_affordable
from service.engine.curvatures.placement_scale import add_stretches
from service.engine.joining.join import join
from service.engine.joining.members import join_group
from service.engine.mesh.counts import Counts, count_mesh
from service.engine.options import MeshOptions
from service.engine.quantize import find_grid_error
from service.errors import InvalidRequest, Issue, SurfaceError, TooLarge
from service.pipeline.checks import check_surface, count_models, sum_counts
from service.pipeline.cost import EFFORT, Cost, adaptive_triangles, estimate_cost, mesh_size
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.mesh import PLAIN, keep_storable_channels, plan_mesh
from service.pipeline.mesh_sizes import estimate_stored_size, member_shares
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sizes import SurfaceKind
from service.surface.sweep_model import SweepModel

ROUNDING_SHARE = 2.0**-16
"""A tolerance above this share of the largest coordinate is above all rounding."""

GRID_SHARE = 4
"""A tolerance leaves room for quantizing if it is at least this many times the largest error."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """A reason for a refusal, and the formats that it applies to."""

    formats: tuple[str, ...]
    issue: Issue

    def to_object(self) -> dict[str, object]:
        """The refusal as a JSON object."""
        issue = self.issue
        texts = {"code": issue.code, "pointer": issue.pointer, "detail": issue.message}
        return {"formats": list(self.formats), **texts, "got": issue.got, "needed": issue.needed}


@dataclass(frozen=True, slots=True)
class Estimate:
    """The estimate of a mesh.

    Attributes
    ----------
    counts : Counts
    exact : bool
        Whether the counts will be those of the report; if not, they are upper bounds.
    sizes : tuple of (name of a format, bytes, whether they are exact)
        For the formats that can store the mesh; upper bounds unless exact.
    memory : tuple of (name of a format, bytes)
        An upper bound for each format in which the mesh would be returned.
    refusals : tuple of Refusal
        Each reason once, with its formats.
    accepted : bool
        Whether there is a format in which the mesh would be returned.
    certain : bool
        Whether an accepted mesh cannot be refused later.
    """

    counts: Counts
    exact: bool
    sizes: tuple[tuple[str, int, bool], ...]
    memory: tuple[tuple[str, int], ...]
    refusals: tuple[Refusal, ...]
    accepted: bool
    certain: bool


@dataclass(frozen=True, slots=True)
class _Prediction:
    """Expected counts of a mesh.

    Attributes
    ----------
    once, copies : Counts
        Counts with every distinct surface once, and with all its copies.
    exact, certain : bool
        As in `Estimate`.
    pieces : int or None
        For a mesh by tolerance: segments of the boundary in addition to those of its bound.
    """

    once: Counts
    copies: Counts
    exact: bool
    certain: bool = True
    pieces: int | None = None

    def within(self, size: MeshSize, *, shared: bool) -> MeshSize:
        """The upper bound `size`, in which smaller counts of this prediction replace larger ones.

        Welded vertices are stored several times where their normals differ.
        """
        counts, pieces = self.once if shared else self.copies, self.pieces or 0
        if not self.exact and self.pieces is None:
            return size
        return replace(
            size,
            vertices=size.vertices if self.pieces is None else counts.vertices,
            triangles=counts.triangles,
            quads=counts.quads,
            overlay_points=size.overlay_points + pieces,
            overlay_segments=size.overlay_segments + pieces,
        )


@dataclass(frozen=True, eq=False, slots=True)
class EstimateWork:
    """The work of an estimate, and its cost."""

    surface: SurfaceKind
    options: MeshOptions
    encode: EncodeOptions
    limits: Limits
    formats: Sequence[Format]
    cost: Cost

    def run(self) -> Estimate:
        """The sizes of the files of each format, and the refusals.

        This finds shared edges and evaluates no points, so it costs much less than the mesh.
        """
        surface, options, encode, limits = self.surface, self.options, self.encode, self.limits
        model, is_joined = surface.lower(), False
        if isinstance(model, GroupModel):
            joined = join_group(model, options)
            model, is_joined = joined.group, bool(joined.clusters)
        elif isinstance(model, PatchModel):
            model, _ = join(model, options.weld_tolerance)
        if options.curvatures:
            # Copies with different curvatures are stored separately.
            model = add_stretches(model)
        bounds = count_models(model, options)
        largest = mesh_size(surface.size(), options, self.formats[0], bounds[1])
        expected = self._predict(model, largest)
        if is_joined:
            # Members that meet each have vertices on their common border.
            expected = _Prediction(*bounds, exact=False, certain=expected.certain)
        sizes: list[tuple[str, int, bool]] = []
        memory: list[tuple[str, int]] = []
        refused: dict[Issue, list[str]] = {}
        accepted, certain = False, expected.certain
        for fmt in self.formats:
            carried, carried_options = keep_storable_channels(model, options, fmt)
            try:
                work = plan_mesh(surface, options, fmt, encode, limits)
                work.check(carried, carried_options, bounds)
                accepted = True
                memory.append((fmt.name, work.cost.memory))
                if options.accuracy is not None:
                    certain &= expected.copies.triangles <= work.cost.triangles
            except SurfaceError as error:
                for issue in error.issues:
                    refused.setdefault(issue, []).append(fmt.name)
                if not isinstance(error, TooLarge):
                    continue
            shared = member_shares(fmt, encode)
            stored = estimate_stored_size(surface, options, fmt, encode)
            size = mesh_size(stored, carried_options, fmt, bounds[0] if shared else bounds[1])
            most = fmt.byte_bound(expected.within(size, shared=shared), encode)
            if options.accuracy is not None:
                certain &= most <= limits.max_bytes
                most = min(most, limits.max_bytes, options.accuracy.max_bytes or most)
            sizes.append((fmt.name, most, expected.exact and fmt.fixed))
        refusals = tuple(Refusal(tuple(names), issue) for issue, names in refused.items())
        counts, exact, certain = expected.copies, expected.exact, certain or not accepted
        return Estimate(counts, exact, tuple(sizes), tuple(memory), refusals, accepted, certain)

    def _predict(self, model: Model, size: MeshSize) -> _Prediction:
        """Bounds of the mesh of a model that has at most this size.

        Exact with a resolution, except for sweeps and wires with faces, whose corners are counted
        only when they are built, and for meshes that exceed the limits.

        Raises
        ------
        InvalidRequest
            `tolerance_too_small`, as for the mesh.
        """
        options, models = self.options, model.models if isinstance(model, GroupModel) else (model,)
        patches = [submodel for submodel in models if isinstance(submodel, PatchModel)]
        most = Counts(size.vertices, size.triangles, size.quads)
        if len(patches) < len(models) or isinstance(model, SweepModel):
            return _Prediction(most, most, exact=False)
        if options.accuracy is not None:
            return self._by_tolerance(model, patches, options.accuracy)
        if options.has_solid_wires or size.vertices > self.limits.max_vertices:
            return _Prediction(most, most, exact=False)
        counts = [
            count_mesh(submodel, options) if options.has_faces else Counts(0, 0, 0)
            for submodel in patches
        ]
        certain = not options.curvatures or is_affordable(patches, size.vertices)
        return _Prediction(*sum_counts(model, counts), exact=True, certain=certain)

    def _by_tolerance(
        self, model: PatchModel | GroupModel, patches: list[PatchModel], accuracy: Accuracy
    ) -> _Prediction:
        """Upper bounds of a mesh by tolerance; they are at most the limits."""
        options, limits = self.options, self.limits
        moved = find_grid_error(model, options) if self.encode.quantize else 0.0
        try:
            once, copies = _bound_meshes(model, options, accuracy, moved)
        except InvalidRequest as error:
            issues = (replace(issue, pointer=accuracy.pointer) for issue in error.issues)
            raise InvalidRequest(*issues) from None
        if not (options.has_faces or options.has_wires):
            return _Prediction(Counts(0, 0, 0), Counts(0, 0, 0), True, pieces=copies.points)
        allowed = adaptive_triangles(accuracy, limits)
        # Meshes by budget or angle have no other bound.
        bounded = not accuracy.is_budgeted and accuracy.angle_tolerance is None
        degree = max(max(batch.side_degrees) for own in patches for batch in own.batches)
        effort = 16 * (degree + 1) ** 2 * (2 * degree)
        certain = (
            bounded
            and copies.triangles + copies.points <= allowed
            and copies.vertices + copies.points <= limits.max_vertices
            and copies.triangles * effort <= EFFORT * limits.max_multiplications
            and _is_clear_of_rounding(model, accuracy, moved)
            and (not options.curvatures or is_affordable(patches, copies.vertices))
        )

        def clip(most: MostTriangles) -> Counts:
            triangles = min(most.triangles, allowed) if bounded else allowed
            # A face of T triangles has T + 2 vertices at most.
            vertices = min(limits.max_vertices, triangles + 2 * model.patch_count)
            return Counts(min(vertices, most.vertices) if bounded else vertices, triangles, 0)

        return _Prediction(clip(once), clip(copies), False, certain, copies.points)


def plan_estimate(
    surface: SurfaceKind,
    options: MeshOptions,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
    formats: Sequence[Format] = FORMATS,
) -> EstimateWork:
    """Plans an estimate; checks limits by the shapes of the surface.

    Raises
    ------
    TooLarge
    """
    size = surface.stored_size()
    check_surface(size, limits)
    cost = estimate_cost(surface.size(), options, len(formats), limits)
    return EstimateWork(surface, options, encode, limits, formats, cost)


def _bound_meshes(
    model: PatchModel | GroupModel, options: MeshOptions, accuracy: Accuracy, moved: float
) -> tuple[MostTriangles, MostTriangles]:
    """Bounds of the stored meshes, and of all copies; rounding moves vertices by `moved`.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small` if placing takes most of the tolerance; without a pointer.
    """
    goal = build_goal(accuracy, model)
    if isinstance(model, PatchModel):
        triangles = bound_triangles(model, subtract_rounding(goal, moved, model.bounds), options)
        return triangles, triangles
    group = model if goal.view is None else separate_copies(model)
    goals = build_model_goals(goal, group, moved)
    bounds = [
        bound_triangles(submodel, aim, options)
        for submodel, aim in zip(group.models, goals, strict=True)
        if isinstance(submodel, PatchModel)
    ]
    return _sum(bounds), _sum(bounds[member.model] for member in group.members)


def _sum(bounds: Iterable[MostTriangles]) -> MostTriangles:
    return MostTriangles(*map(sum, zip(*bounds, strict=True)))


def _is_clear_of_rounding(model: PatchModel | GroupModel, accuracy: Accuracy, moved: float) -> bool:
    """Whether the tolerance leaves room for the rounding of every format."""
    goal = build_goal(accuracy, model)
    allowed_by_view = inf if goal.view is None else goal.view.rate * goal.view.near
    least = min(goal.tolerance, allowed_by_view)
    return least >= ROUNDING_SHARE * float(np.abs(model.bounds).max()) + GRID_SHARE * moved


def estimate_object(estimate: Estimate) -> dict[str, object]:
    """The estimate as a JSON object."""
    return {
        **asdict(estimate.counts),
        "exact": estimate.exact,
        "bytes": {name: size for name, size, _ in estimate.sizes},
        "exact_bytes": [name for name, _, exact in estimate.sizes if exact],
        "memory": dict(estimate.memory),
        "accepted": estimate.accepted,
        "certain": estimate.certain,
        "refused": [refusal.to_object() for refusal in estimate.refusals],
    }
