"""Makes meshes by tolerance or by budget; stops and refuses a mesh that becomes too large."""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from math import ceil, inf
from typing import TypeAlias

from service.encoders.format import Content, MeshSize
from service.engine.accuracy import Accuracy
from service.engine.adaptive.limits import Effort
from service.engine.adaptive.tolerances import build_goal
from service.engine.mesh.mesh import Mesh
from service.engine.meshers import build_mesher, weigh_copies
from service.engine.options import MeshOptions
from service.engine.scenes.scene import Scene
from service.engine.stored_positions import Storage
from service.errors import InvalidRequest, Issue, TooLarge, count_nouns
from service.measuring import Measured
from service.pipeline.brep_cost import estimate_preparation
from service.pipeline.budget_search import Attempt, search_tolerances
from service.pipeline.checks import check_bytes, check_vertices
from service.pipeline.mesh_costs import (
    EFFORT_FACTOR,
    MIN_TRIANGLE_BYTES,
    TRIANGLE_EFFORT,
    adaptive_triangles,
    count_counted,
)
from service.pipeline.mesh_plan import MeshPlan
from service.surface.lowered import Model

AnyMesh: TypeAlias = Mesh | Scene
Build: TypeAlias = Callable[[Accuracy, float | None], AnyMesh]

ATTEMPTS = 3
"""The search for a mesh within a budget may take the work of this number of meshes of the highest
cost. Most meshes cost less, so the search usually tries more than `ATTEMPTS` meshes."""

MIN_TOLERANCE, MIN_TOLERANCE_SINGLE = 2.0**-38, 2.0**-20
"""The least tolerance that a search tries, as a share of the model's diagonal, in double and in
single precision: a small multiple of the rounding error."""

NO_LIMIT = 2**62
"""A limit of triangles that no mesh reaches."""


def prepare_meshes(
    plan: MeshPlan, model: Model, options: MeshOptions, effort: Effort | None = None
) -> tuple[Build, float]:
    """A function that builds meshes of one model by tolerance; data that they share is made once.

    Parameters
    ----------
    plan : MeshPlan
        The request, its limits, and the number of triangles that fit into its memory.
    model : Model
    options : MeshOptions
    effort : Effort, optional
        The most work of all meshes together.

    Returns
    -------
    build : callable
    diagonal : float
        The diagonal of the model, of which relative tolerances are shares.

    Raises
    ------
    InvalidRequest
        A brep is invalid.
    """
    fmt, limits = plan.fmt, plan.limits
    all_effort = effort or Effort(EFFORT_FACTOR * limits.max_multiplications)
    all_effort.spend(estimate_preparation(plan.distinct_size))
    try:
        mesher = build_mesher(
            model,
            options,
            Storage(fmt.is_float32, fmt.has_local_origin),
            has_nodes=fmt.encode_scene is not None,
            is_quantized=plan.encode.quantize,
        )
    except InvalidRequest as error:
        raise error.within("/surface") from None

    def build(accuracy: Accuracy, tolerance: float | None) -> AnyMesh:
        """Build the mesh for an accuracy; `tolerance`, in model units, replaces its tolerance.

        The pointers of errors lead to the option that is the cause.
        """
        # The limit of the service, which is that of an accuracy without a budget.
        max_triangles, limit_pointer = adaptive_triangles(Accuracy(), limits), accuracy.pointer
        if accuracy.max_triangles is not None and accuracy.max_triangles < max_triangles:
            max_triangles, limit_pointer = accuracy.max_triangles, "/max_triangles"
        # `plan.max_triangles` is at most `allowed_triangles`; it is less if memory is the limit.
        requested = plan.options.accuracy or accuracy
        coarsest = count_counted(requested, plan.counted_size, plan.surface_size)
        allowed_triangles = adaptive_triangles(requested, limits, coarsest)
        is_memory_limit = plan.max_triangles < min(allowed_triangles, max_triangles)
        memory = plan.cost.memory if is_memory_limit else None
        max_triangles = min(max_triangles, plan.max_triangles)
        goal = build_goal(accuracy, mesher.model)
        if tolerance is not None:
            goal = replace(goal, tolerance=tolerance)
        try:
            with Measured("adaptive"):
                mesh = mesher.build_mesh(goal, max_triangles, all_effort)
        except TooLarge as error:
            issues = (
                _explain(issue, limit_pointer, max_triangles, accuracy, memory)
                for issue in error.issues
            )
            raise TooLarge(*issues) from None
        except InvalidRequest as error:
            invalid = (replace(issue, pointer=accuracy.pointer) for issue in error.issues)
            raise InvalidRequest(*invalid) from None
        all_effort.spent += TRIANGLE_EFFORT * sum(len(each.triangles) for each, _ in _weigh(mesh))
        check_mesh(mesh, plan, accuracy)
        return plan.note_facts(mesh)

    return build, mesher.model.diagonal


def build_within_budget(
    plan: MeshPlan, model: Model, options: MeshOptions, accuracy: Accuracy
) -> tuple[AnyMesh, Content]:
    """Make the mesh with the least proved deviation within the budget, and its file.

    All meshes of the search together may take the work of one request; one mesh may take
    1/`ATTEMPTS` of it.

    Raises
    ------
    InvalidRequest
        `budget_too_small`, with the size of the coarsest mesh.
    TooLarge
        Even the coarsest mesh exceeds a limit.
    """
    effort = Effort(EFFORT_FACTOR * plan.limits.max_multiplications)
    build, diagonal = prepare_meshes(plan, model, options, effort)
    effort_for_mesh = effort.limit / ATTEMPTS

    def try_tolerance(allowed: Accuracy, tolerance: float) -> Attempt[tuple[AnyMesh, Content]]:
        spent_before = effort.spent
        mesh = build(allowed, tolerance)
        content = plan.encode_mesh(mesh)
        effort_share = (effort.spent - spent_before) / effort_for_mesh
        cost = max(_budget_share(mesh, content, accuracy), effort_share)
        bound = mesh.report.deviation_bound
        if bound is None:
            # Without faces nothing deviates; a brep without a bound is worse than any with one.
            bound = 0.0 if mesh.report.brep is None else diagonal
        return Attempt(cost, bound, (mesh, content))

    # Build the coarsest mesh even if it exceeds the budget, because the error names its size.
    unlimited_accuracy = (
        accuracy if accuracy.max_triangles is None else replace(accuracy, max_triangles=NO_LIMIT)
    )
    coarsest_attempt = try_tolerance(unlimited_accuracy, inf)
    mesh, content = coarsest_attempt.result
    _check_budget("/max_triangles", "triangles", mesh.report.triangles, accuracy.max_triangles)
    _check_budget("/max_bytes", "bytes", len(content), accuracy.max_bytes)

    # The greatest tolerance that a brep did not reach: finer ones would not lower its bound.
    unreached = 0.0

    def attempt(tolerance: float) -> Attempt[tuple[AnyMesh, Content]] | None:
        nonlocal unreached
        if tolerance < unreached:
            return None
        effort.reserve_rest(effort_for_mesh)  # all but the work of this mesh
        try:
            result = try_tolerance(accuracy, tolerance)
            brep = result.result[0].report.brep
            if brep is not None and not brep.reached:
                unreached = tolerance
            return result
        except TooLarge:
            return None
        except InvalidRequest as error:
            # This tolerance is below the rounding of the vertices, so it counts as one that does
            # not fit.
            if any(issue.code != "tolerance_too_small" for issue in error.issues):
                raise
            return None

    min_share = MIN_TOLERANCE_SINGLE if plan.fmt.is_float32 else MIN_TOLERANCE
    return search_tolerances(attempt, coarsest_attempt, min_share * diagonal).result


def check_mesh(mesh: AnyMesh, plan: MeshPlan, accuracy: Accuracy) -> None:
    """Refuse a mesh with too many vertices, or whose file may have too many bytes."""
    where = accuracy.pointer
    vertices = ceil(sum(len(each.positions) * weight for each, weight in _weigh(mesh)))
    size = size_of_mesh(mesh, plan.stored)
    check_vertices(vertices + size.overlay_points, plan.limits, where)
    check_bytes(plan.fmt.byte_bound(size, plan.encode), plan.fmt, plan.limits, where)


def _weigh(mesh: AnyMesh) -> Iterator[tuple[Mesh, float]]:
    """The stored meshes, each with the number by which its vertices count in the limit."""
    if isinstance(mesh, Mesh):
        yield mesh, 1.0
        return
    copies = Counter(node.model for node in mesh.nodes)
    for number, each in enumerate(mesh.meshes):
        yield each, weigh_copies(copies[number])


def check_content(content: Content, accuracy: Accuracy | None) -> None:
    """Refuse a file with more bytes than the option `max_bytes` of the request allows."""
    max_bytes = None if accuracy is None else accuracy.max_bytes
    if max_bytes is not None and len(content) > max_bytes:
        raise TooLarge(_too_many_bytes(f"{len(content)} bytes", max_bytes))


def size_of_mesh(mesh: AnyMesh, size: MeshSize) -> MeshSize:
    """The size of a mesh, or of all meshes of a scene; names and attributes are those of `size`."""
    meshes = [mesh] if isinstance(mesh, Mesh) else mesh.meshes
    overlays = [overlay for each in meshes for overlay in each.overlays]
    return replace(
        size,
        vertices=sum(len(each.positions) for each in meshes),
        triangles=sum(len(each.triangles) for each in meshes),
        quads=0,  # meshes by tolerance have none
        overlay_points=sum(len(overlay.positions) for overlay in overlays),
        overlay_segments=sum(len(overlay.segments) for overlay in overlays),
        overlay_cells=sum(0 if o.cells is None else len(o.cells) for o in overlays),
    )


def _explain(
    issue: Issue, where: str, max_triangles: int, accuracy: Accuracy, memory: int | None
) -> Issue:
    """The issue of the engine for a mesh that is too large, with the limit of the request.

    In a group, the issue of the engine names only the triangles that are left for one member.

    Parameters
    ----------
    issue : Issue
        From the engine.
    where : str
        The JSON pointer to the option that is the cause.
    max_triangles : int
        The most triangles that the mesh may have.
    accuracy : Accuracy
    memory : int or None
        The bytes of memory that a mesh may take, if memory is the reason for
        `max_triangles`.
    """
    if issue.code != "too_many_triangles":
        return replace(issue, pointer=where)
    if memory is None:
        return replace(
            issue,
            pointer=where,
            got=f"more than {count_nouns(max_triangles, 'triangles')}",
            needed=f"at most {max_triangles}; a greater tolerance needs fewer",
        )
    # If a file of `max_triangles` triangles exceeds the budget, more memory would not help.
    if accuracy.max_bytes is not None and MIN_TRIANGLE_BYTES * max_triangles > accuracy.max_bytes:
        return _too_many_bytes(f"more than {accuracy.max_bytes} bytes", accuracy.max_bytes)
    return Issue(
        "too_much_memory",
        "The mesh would take more memory than this service has for a mesh by tolerance.",
        where,
        f"more than {memory} bytes",
        f"at most {memory}; a greater tolerance, or another format, takes less",
    )


def _too_many_bytes(got: str, max_bytes: int) -> Issue:
    message = "A file with this tolerance would have too many bytes."
    return Issue("too_many_bytes", message, "/max_bytes", got, f"at most {max_bytes}")


def _budget_share(mesh: AnyMesh, content: Content, budget: Accuracy) -> float:
    """The fraction of the budget that a mesh takes: of triangles or of bytes, the larger one."""
    counts = (mesh.report.triangles, budget.max_triangles), (len(content), budget.max_bytes)
    return max(count / max_count for count, max_count in counts if max_count is not None)


def _check_budget(where: str, unit: str, min_count: int, max_count: int | None) -> None:
    """Refuse a budget `max_count` that is below `min_count`, the size of the coarsest mesh."""
    if max_count is not None and min_count > max_count:
        raise InvalidRequest(
            Issue(
                "budget_too_small",
                "Even the coarsest mesh of the surface is larger.",
                where,
                count_nouns(max_count, unit),
                f"at least {count_nouns(min_count, unit)}",
            )
        )
