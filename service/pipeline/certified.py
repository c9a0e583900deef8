"""Meshes by tolerance: how large they may become, and what came out."""

import sys
from dataclasses import replace
from typing import Protocol, TypeAlias

from service.encoders.format import EncodeOptions, Format, MeshSize
from service.engine.adaptive.accuracy import Accuracy
from service.engine.adaptive.aims import goal_of, stated
from service.engine.adaptive.limits import Effort
from service.engine.adaptive.meshing import meshing
from service.engine.adaptive.storage import Storage
from service.engine.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.scene import Scene
from service.errors import InvalidRequest, Issue, TooLarge
from service.measuring import measured
from service.pipeline.checks import check_bytes, check_vertices
from service.pipeline.limits import Limits
from service.pipeline.mesh_memory import SHARE
from service.surface.lowered import GroupModel, PatchModel

TRIANGLE = 5_000
"""Multiplications that are as long as what a triangle takes at least."""

Made: TypeAlias = Mesh | Scene


class Make(Protocol):
    """What makes the mesh that an accuracy asks for, or one by another tolerance."""

    def __call__(self, accuracy: Accuracy, tolerance: float | None = None) -> Made:
        """The mesh; `tolerance`, in model units, takes the place of the one that was stated."""
        ...


def most_triangles(limits: Limits) -> int:
    """Triangles that are made at most, whatever is asked for."""
    # A closed surface has two triangles a vertex, an open one fewer.
    return min(2 * limits.max_vertices, limits.max_multiplications // TRIANGLE)


class Certifier:
    """What makes the meshes of a model, as a format stores them; what they have in common once.

    All of them together may take so much `effort`.

    Parameters
    ----------
    model : PatchModel or GroupModel
    options : MeshOptions
    fmt : Format
    limits : Limits
    effort : Effort
    quantized : bool
        Whether positions are stored on grids.
    affordable : int
        Triangles that the memory allows.
    """

    def __init__(
        self,
        model: PatchModel | GroupModel,
        options: MeshOptions,
        fmt: Format,
        limits: Limits,
        effort: Effort,
        *,
        quantized: bool = False,
        affordable: int = sys.maxsize,
    ) -> None:
        self._affordable = affordable
        storage = Storage(fmt.single, fmt.local)
        self._model, self._limits, self._effort = model, limits, effort
        nodes = fmt.encode_scene is not None
        self._meshing = meshing(model, options, storage, nodes=nodes, quantized=quantized)

    def made(self, accuracy: Accuracy, tolerance: float | None = None) -> Made:
        """The mesh that is as near to the model as it was asked for.

        A `tolerance`, in model units, takes the place of the one that was stated.

        Raises
        ------
        InvalidRequest, TooLarge
            With pointers to the option that asked for it.
        """
        most, limit = most_triangles(self._limits), stated(accuracy)
        if accuracy.max_triangles is not None and accuracy.max_triangles < most:
            most, limit = accuracy.max_triangles, "/max_triangles"
        scarce = self._affordable < most
        most = min(most, self._affordable)
        goal = goal_of(accuracy, self._model)
        if tolerance is not None:
            goal = replace(goal, tolerance=tolerance)
        try:
            with measured("adaptive"):
                made = self._meshing.made(goal, most, self._effort)
        except TooLarge as error:
            issues = [_limited(issue, limit, most) for issue in error.issues]
            if scarce:
                issues = [_scarce(issue, self._limits) for issue in issues]
            raise TooLarge(*issues) from None
        except InvalidRequest as error:
            invalid = (replace(issue, pointer=stated(accuracy)) for issue in error.issues)
            raise InvalidRequest(*invalid) from None
        self._effort.spent += TRIANGLE * made.report.triangles
        return made


def _limited(issue: Issue, limit: str, most: int) -> Issue:
    """What was too large, where the limit was set; of a group, the limit of the whole."""
    if issue.code != "too_many_triangles":
        return replace(issue, pointer=limit)
    got, needed = f"more than {most} triangles", f"at most {most}; a greater tolerance needs fewer"
    return replace(issue, pointer=limit, got=got, needed=needed)


def _scarce(issue: Issue, limits: Limits) -> Issue:
    """What was too large for the memory that it may take."""
    if issue.code != "too_many_triangles":
        return issue
    most = limits.max_memory // SHARE
    return Issue(
        "too_much_memory",
        "The mesh would take more memory than this service has for one by tolerance.",
        issue.pointer,
        f"more than {most} bytes",
        f"at most {most}; a greater tolerance, or another format, takes less",
    )


def check_made(
    made: Made,
    predicted: MeshSize,
    accuracy: Accuracy,
    limits: Limits,
    form: tuple[Format, EncodeOptions],
) -> None:
    """Refuses what came out too large for an answer; `predicted` as in `counted`."""
    where = stated(accuracy)
    copies = [made] if isinstance(made, Mesh) else [made.meshes[n.model] for n in made.nodes]
    vertices = sum(len(mesh.positions) for mesh in copies)
    size = counted(made, predicted)
    check_vertices(replace(size, vertices=vertices), limits, where)
    check_bytes(size, *form, limits, where)


def check_content(content: bytes, accuracy: Accuracy) -> None:
    """Refuses a file that is larger than it was to be."""
    most = accuracy.max_bytes
    if most is not None and len(content) > most:
        message = "To be so near to the surface the file would need too many bytes."
        got, needed = f"{len(content)} bytes", f"at most {most}"
        raise TooLarge(Issue("too_many_bytes", message, "/max_bytes", got, needed))


def counted(made: Made, predicted: MeshSize) -> MeshSize:
    """Counts of what is stored of a mesh, or of the meshes of a scene.

    What was predicted has the names, and all that does not depend on how finely is divided.
    """
    meshes = [made] if isinstance(made, Mesh) else made.meshes
    overlays = [overlay for mesh in meshes for overlay in mesh.overlays]
    return replace(
        predicted,
        vertices=sum(len(mesh.positions) for mesh in meshes),
        triangles=sum(len(mesh.triangles) for mesh in meshes),
        quads=0,
        overlay_points=sum(len(overlay.positions) for overlay in overlays),
        overlay_segments=sum(len(overlay.segments) for overlay in overlays),
        overlay_cells=sum(0 if o.cells is None else len(o.cells) for o in overlays),
    )
