"""A picture of a surface, in steps: lower, mesh for the camera, draw, write."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from math import atan, inf
from types import MappingProxyType

from service.encoders.png import encode_png
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy, Camera
from service.engine.adaptive.tolerances import NEAR
from service.engine.pictures.camera import PictureCamera, build_camera
from service.engine.pictures.distance import find_distance
from service.engine.pictures.draw import draw_picture
from service.engine.pictures.options import PIXEL_TOLERANCE, PictureOptions
from service.engine.pictures.parts import list_parts, list_points
from service.errors import InvalidRequest, Issue, TooLarge
from service.measuring import Measured
from service.pipeline.adaptive import AnyMesh, prepare_meshes
from service.pipeline.cost import Cost, Work
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.mesh import keep_storable_channels
from service.pipeline.mesh_plan import MeshPlan, build_plan
from service.surface.sizes import SurfaceKind

COARSE = 0.02
"""The tolerance of the mesh that a camera without a position looks at as a whole, in diagonals."""

LESS = 0.99
"""Factor of the tolerance of a picture, for the second order of the error at the corners."""

PIXEL_BYTES, STRIP_BYTES, PIXEL_SECONDS = 12, 64 << 20, 3e-6
"""Bytes for each pixel of the picture and its file, bytes of the arrays of a strip, and the time
for each pixel."""

_FIELDS = MappingProxyType({
    "/curvatures": "/look",
    "/overlays": "/control_net",
    "/tolerance": "/height",
    "/pixel_tolerance": "/height",
})  # fmt: skip
"""The fields of a picture, by pointers to the options of its mesh."""

_GLB = BY_NAME["glb"]
"""The mesh of a picture has the precision of this format, and its copies are nodes."""


def plan_picture(
    surface: SurfaceKind, options: PictureOptions, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan a picture: estimate the cost from shapes, and check the limits.

    Raises
    ------
    InvalidRequest, TooLarge
        As those of a mesh for the same camera.
    """
    with _name_fields():
        plan = build_plan(surface, options.mesh_options(), _GLB, limits=limits)
    pixels = options.viewpoint.width * options.viewpoint.height
    memory = plan.cost.memory + STRIP_BYTES + PIXEL_BYTES * pixels
    limits.check_memory(memory, "The picture", "/width", "a smaller picture, or a smaller surface")
    cost = Cost(memory, plan.cost.seconds + PIXEL_SECONDS * pixels, PIXEL_BYTES * pixels)
    return Work(cost, partial(_make_picture, plan, surface, options))


def _make_picture(plan: MeshPlan, surface: SurfaceKind, options: PictureOptions) -> bytes:
    """Draw the picture, and write it as PNG.

    Raises
    ------
    InvalidRequest, TooLarge
        The patches show that the mesh is impossible or too large; `camera_on_surface`.
    """
    with _name_fields():
        model, mesh_options = keep_storable_channels(surface.lower(), plan.options, _GLB)
        plan.check(model, mesh_options)
        build, diagonal = prepare_meshes(plan, model, mesh_options)
        whole = build(Accuracy(), COARSE * diagonal)
        camera = build_camera(options.viewpoint, list_points(list_parts(whole)), model.up)
        # No point of the surface is further from the coarse mesh than this bound.
        bound = whole.report.deviation_bound
        nearest = 0.0 if bound is None else _find_distance(camera, whole) - bound
        mesh = build(find_accuracy(camera, nearest), None)
    least = NEAR * diagonal
    if nearest < least:
        _check_distance(_find_distance(camera, mesh), least)
    with Measured("draw"):
        return encode_png(draw_picture(mesh, camera, options.style))


@contextmanager
def _name_fields() -> Iterator[None]:
    """Errors about a mesh name the fields of a picture."""
    try:
        yield
    except (InvalidRequest, TooLarge) as error:
        raise type(error)(*map(_name_field, error.issues)) from None


def _name_field(issue: Issue) -> Issue:
    needed = issue.needed.replace('`overlays` with "boundary"', "`edges`")
    return replace(issue, pointer=_FIELDS.get(issue.pointer, issue.pointer), needed=needed)


def find_accuracy(camera: PictureCamera, nearest: float = 0.0) -> Accuracy:
    """The accuracy with which a mesh is right to `PIXEL_TOLERANCE` in a picture.

    No point of the surface is nearer to the camera than `nearest`.
    """
    if camera.orthographic:
        return Accuracy(tolerance=PIXEL_TOLERANCE / camera.focus)
    x, y, z = camera.eye.tolist()
    width, height = camera.size
    placed = Camera((x, y, z), 2 * atan(height / (2 * camera.focus)), height, max(nearest, 0.0))
    # A mesh has its tolerance in the middle of a picture. At the angle θ from there a distance
    # appears 1 / cos² θ times as large; the corners are furthest from the middle.
    squared_cosine = 1 / (1 + (width**2 + height**2) / (2 * camera.focus) ** 2)
    return Accuracy(camera=placed, pixel_tolerance=LESS * PIXEL_TOLERANCE * squared_cosine)


def _find_distance(camera: PictureCamera, mesh: AnyMesh) -> float:
    """The distance from the camera to a mesh; infinite for orthographic cameras."""
    if camera.orthographic:
        return inf
    parts = list_parts(mesh)
    return min(find_distance(camera.eye, each.positions, each.mesh.triangles) for each in parts)


def _check_distance(distance: float, least: float) -> None:
    """Refuse a camera on the surface."""
    if distance < least:
        raise InvalidRequest(
            Issue(
                "camera_on_surface",
                "The camera stands on the surface.",
                "/position",
                "a distance below 1/1000 of the diagonal of the surface",
                "a camera beside the surface",
            )
        )
