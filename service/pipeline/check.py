"""The check of a mesh against its surface, in steps: count faults, build references, compare."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from functools import cached_property, partial
from math import ceil

import numpy as np

from service.bases.arrays import FloatArray
from service.encoders.content import list_skipped_faces, omit_none
from service.encoders.registry import BY_NAME
from service.encoders.text import FLOAT64_CHARS, json_document
from service.engine.accuracy import Accuracy
from service.engine.closest.project import ProjectQuery, project_on_surface
from service.engine.mesh.mesh import Mesh
from service.engine.mesh_checks.compare import compare
from service.engine.mesh_checks.faults import find_faults
from service.engine.mesh_checks.query import CheckQuery
from service.engine.mesh_checks.reference import (
    OutOfReach,
    ReferenceMesh,
    SurfacePlace,
    take_reference,
)
from service.engine.mesh_checks.values import Deviation
from service.engine.options import MeshOptions
from service.engine.parts.project import project_on_part
from service.engine.points.surface_columns import Columns
from service.errors import InvalidRequest, Issue, TooLarge
from service.measuring import Measured
from service.pipeline.adaptive import prepare_meshes
from service.pipeline.checks import require_numbered_patches
from service.pipeline.cost import Cost, Work
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.mesh import keep_storable_channels
from service.pipeline.mesh_plan import MeshPlan, build_plan
from service.pipeline.parts import has_breps, prepare_part, require_exact
from service.surface.given_mesh import GivenMesh
from service.surface.sizes import SurfaceKind

REFERENCE_GROWTH, LEAST_REFERENCE = 16.0, 1 << 17
"""A reference mesh may have this number of triangles for each of the given mesh, divided by the
relative tolerance; and always `LEAST_REFERENCE`. Meshes of spheres need a fifth of it, and those of
cylinders, of which few long triangles are near the surface, all of it and more."""

GIVEN_BYTES, REFERENCE_BYTES, SEARCH_BYTES = 3000, 1200, 64 << 20
"""Bytes for each triangle of the given mesh, of which all may be needles, and for each of the
reference mesh, while distances between them are searched; and for arrays of pieces of triangles."""

REFERENCE_LIMIT = 2 / 3
"""The share of the memory that is left for reference meshes with which they are planned: the third
of it that a mesh may take becomes less than all with `REFERENCE_BYTES`."""

TRIANGLE_SECONDS, ANSWER_BYTES = 2e-4, 4000
"""The time for each triangle of the given mesh, and bytes of the answer without lists."""

_NPZ = BY_NAME["npz"]
"""Reference meshes are those that this format would store: in double precision, groups as one."""


def plan_check(
    surface: SurfaceKind, mesh: GivenMesh, query: CheckQuery, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan the check of a mesh: estimate the cost from shapes, and check the limits.

    Raises
    ------
    InvalidRequest, TooLarge
        As those of a mesh of the surface by tolerance.
    """
    count, where, instead = len(mesh.triangles), "/mesh", "a mesh of fewer triangles"
    file_bytes = ANSWER_BYTES
    if query.distances:
        numbers = 4 * len(mesh.positions) + 4 * count
        file_bytes += numbers * (FLOAT64_CHARS + 2)
    limits.check_bytes(file_bytes, where)
    own_memory = GIVEN_BYTES * count + SEARCH_BYTES + 2 * file_bytes
    limits.check_memory(own_memory, "The check", where, instead)
    allowed = int(REFERENCE_LIMIT * (limits.max_memory - own_memory))
    growth = ceil(REFERENCE_GROWTH / query.relative_tolerance)
    accuracy = Accuracy(max_triangles=max(growth * count, LEAST_REFERENCE), two_sided=True)
    with _locating():
        plan = build_plan(
            surface,
            MeshOptions(accuracy=accuracy),
            _NPZ,
            limits=replace(limits, max_memory=allowed),
        )
    memory = own_memory + plan.cost.memory + REFERENCE_BYTES * plan.max_triangles
    limits.check_memory(memory, "The check", where, instead)
    cost = Cost(memory, plan.cost.seconds + TRIANGLE_SECONDS * count, file_bytes)
    return Work(cost, partial(_check, plan, surface, mesh, query))


def _check(plan: MeshPlan, surface: SurfaceKind, mesh: GivenMesh, query: CheckQuery) -> bytes:
    """Check the mesh, and write the answer as JSON.

    Raises
    ------
    InvalidRequest, TooLarge
        A brep is invalid, or the surface needs more than the limits for any mesh.
    """
    with Measured("faults"):
        faults = find_faults(mesh)
    with Measured("compare"), _locating():
        comparison = compare(mesh, _PlannedSurface(plan, surface), query)
    answer: dict[str, object] = {
        "surface_to_mesh": _write_deviation(comparison.surface_to_mesh),
        "mesh_to_surface": _write_deviation(comparison.mesh_to_surface),
        **asdict(faults),
        "max_normal_angle": comparison.angle,
        "max_normal_angle_triangle": comparison.angle_triangle,
        "reached": comparison.limit is None,
        "limit": comparison.limit,
        "vertices": len(mesh.positions),
        "triangles": len(mesh.triangles),
        "skipped_faces": list_skipped_faces(comparison.skipped_faces, "patch") or None,
    }
    answer = omit_none(answer)
    if comparison.distances is not None:
        answer["mesh"] = {"vertices": mesh.positions, "faces": mesh.triangles}
        answer["distances"] = comparison.distances
        answer["middle_distances"] = comparison.middle_distances
    return json_document(answer)


def _write_deviation(deviation: Deviation) -> dict[str, object]:
    """An interval, and where it is, as a JSON object."""
    return {
        "low": deviation.low,
        "high": deviation.high,
        "point": deviation.point,
        **deviation.place,
        "triangle": deviation.triangle,
    }


@contextmanager
def _locating() -> Iterator[None]:
    """Lets the errors of reference meshes point to the surface: a request has no options of them.

    A surface so small that rounding is larger than every tolerance is one without faces.
    """
    try:
        yield
    except (InvalidRequest, TooLarge) as error:
        raise type(error)(*map(_point_to_surface, error.issues)) from None


def _point_to_surface(issue: Issue) -> Issue:
    if issue.code == "tolerance_too_small":
        return _no_faces(())
    is_inside = issue.pointer.startswith("/surface")
    return issue if is_inside else replace(issue, pointer="/surface")


def _no_faces(codes: Iterable[str]) -> Issue:
    """The issue of a surface without any face, with which no mesh can be compared.

    `codes` are those of faces that were left out.
    """
    reasons = ", ".join(sorted(set(codes)))
    got = f"no face; what is wrong: {reasons}" if reasons else "no face with an area"
    message = "No face of the surface takes part: all are invalid, or have no area."
    return Issue("no_faces", message, "/surface", got, "a valid face")


class _PlannedSurface:
    """The surface of a request, with reference meshes within the limits of its plan."""

    def __init__(self, plan: MeshPlan, surface: SurfaceKind) -> None:
        model, options = keep_storable_channels(surface.lower(), plan.options, _NPZ)
        plan.check(model, options)
        self._build, self.diagonal = prepare_meshes(plan, model, options)
        self.max_triangles = plan.max_triangles
        self._accuracy = plan.options.accuracy or Accuracy()
        self._surface, self._is_built = surface, False

    def build_reference(self, tolerance: float) -> ReferenceMesh:
        """A reference mesh; the errors of the first one are those of the request."""
        try:
            mesh = self._build(self._accuracy, tolerance)
        except TooLarge:
            if not self._is_built:
                raise
            raise OutOfReach("work") from None
        except InvalidRequest as error:
            is_rounding = any(issue.code == "tolerance_too_small" for issue in error.issues)
            if not (self._is_built and is_rounding):
                raise
            raise OutOfReach("rounding") from None
        self._is_built = True
        assert isinstance(mesh, Mesh)  # the format has no nodes
        reference = take_reference(mesh, self.diagonal)
        if not len(reference.triangles):
            raise InvalidRequest(_no_faces(face.issue.code for face in reference.skipped_faces))
        return reference

    def find_place(self, point: FloatArray) -> SurfacePlace | None:
        """The nearest point of the surface; None for ribbons."""
        query = ProjectQuery(point[np.newaxis])
        if self._projector is None:
            return None
        columns = self._projector(query)
        place: dict[str, object] = {
            name: columns[name][0] for name in ("patch", "uv") if name in columns
        }
        low, high = columns["distance_bounds"][0].tolist()
        # The rounding of the position, and how far it may be outside of the trims of its face.
        error = high - float(columns["distances"][0])
        return SurfacePlace(columns["positions"][0], error, low, place)

    @cached_property
    def _projector(self) -> Callable[[ProjectQuery], Columns] | None:
        """Finds closest points; None for surfaces without parameters."""
        try:
            model = require_exact(self._surface).lower()
            if has_breps(model):
                return partial(project_on_part, prepare_part(model))
            return partial(project_on_surface, require_numbered_patches(model))
        except InvalidRequest:
            return None
