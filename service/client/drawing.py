"""Draws meshes of the client in this process, as the service draws surfaces.

Only `Mesh.draw` imports this module, when it is called: it loads the engine and Pillow.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, Ints, RealArray
from service.client.fields import ViewFields
from service.encoders.png import encode_png
from service.engine.mesh.mesh import Mesh, MeshPart, MeshReport, Overlay
from service.engine.pictures.camera import build_camera
from service.engine.pictures.draw import draw_picture
from service.engine.pictures.options import PictureStyle, Viewpoint
from service.engine.pictures.parts import list_parts, list_points
from service.engine.vectors import cross, normalize
from service.surface.checks import Up
from service.surface.lowered import Color

Run: TypeAlias = tuple[int, int]

_NO_REPORT = MeshReport(
    vertices=0,
    triangles=0,
    quads=0,
    patches=0,
    bounds_min=(0.0, 0.0, 0.0),
    bounds_max=(0.0, 0.0, 0.0),
    watertight=False,
    boundary_edges=0,
    poles_repaired=0,
)
"""The report of a mesh that is only drawn: nothing reads it."""


@dataclass(frozen=True, eq=False, slots=True)
class Faces:
    """The faces and lines of a mesh, as they are drawn.

    Attributes
    ----------
    positions : ndarray, shape (V, 3)
    faces : ndarray of int, shape (F, 3) or (F, 4)
        Among quads, a triangle repeats its last corner.
    normals : ndarray, shape (V, 3), or None
        Unit normals; without them, faces are flat.
    colors : ndarray, shape (V, 3) or (V, 4), or None
        sRGB.
    parts : sequence of (run, color)
        Runs of faces with their base colours, sRGB with opacity.
    lines : sequence of (name, points (K, 3), segments (L, 2))
    """

    positions: FloatArray
    faces: IndexArray
    normals: RealArray | None
    colors: RealArray | None
    parts: Sequence[tuple[Run, Color | None]]
    lines: Sequence[tuple[str, FloatArray, IndexArray]]


def draw_faces(drawn: Faces, up: Up, view: ViewFields) -> bytes:
    """A picture of faces with a transparent background, as PNG."""
    viewpoint = Viewpoint(**view)
    mesh = _build_mesh(drawn, up)
    camera = build_camera(viewpoint, list_points(list_parts(mesh)), up)
    return encode_png(draw_picture(mesh, camera, PictureStyle()))


def _build_mesh(drawn: Faces, up: Up) -> Mesh:
    """The mesh of the engine, of triangles."""
    triangles, ends = _divide_quads(drawn.faces)
    positions, normals, colors = drawn.positions, drawn.normals, drawn.colors
    if normals is None:
        # Each triangle gets vertices of its own, with its normal.
        corners = triangles.ravel()
        positions = positions[corners]
        a, b, c = positions.reshape(-1, 3, 3).swapaxes(0, 1)
        normals = np.repeat(normalize(cross(b - a, c - a, -1), -1), 3, axis=0)
        colors = None if colors is None else colors[corners]
        triangles = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
    parts = (
        MeshPart("", (int(ends[first]), int(ends[last])), (0, 0), color)
        for (first, last), color in drawn.parts
    )
    return Mesh(
        name="",
        positions=positions,
        normals=normals,
        uvs=None,
        triangles=triangles,
        quads=np.zeros((0, 4), np.uint32),
        parts=tuple(parts),
        grids=(),
        welds=None,
        overlays=tuple(Overlay(*line) for line in drawn.lines),
        origin=np.zeros(3),
        up=up,
        report=_NO_REPORT,
        colors=colors,
    )


def _divide_quads(faces: IndexArray) -> tuple[IndexArray, Ints]:
    """Triangles (T, 3), and how many of them come before each face and after all, (F + 1,)."""
    if faces.shape[1] == 3:
        return faces, np.arange(len(faces) + 1)
    kept = np.ones((len(faces), 2), bool)
    kept[:, 1] = faces[:, 2] != faces[:, 3]
    halves = np.stack([faces[:, :3], faces[:, [0, 2, 3]]], axis=1)
    return halves[kept], np.concatenate([[0], np.cumsum(kept.sum(axis=1))])
