"""Colours of parts as colours of vertices, for formats whose parts have no colours."""

from dataclasses import replace

import numpy as np

from service.engine.mesh.mesh import Mesh
from service.surface.lowered import Color

WHITE: Color = (1.0, 1.0, 1.0, 1.0)
"""The colour of parts without a colour, if other parts have one."""


def paint_parts(mesh: Mesh) -> Mesh:
    """The mesh, all of triangles, whose vertices have the colours of their parts.

    A vertex that parts of different colours share becomes several vertices at one position. The
    mesh is returned as it is if no part has a colour.
    """
    colors: dict[Color, int] = {}
    parts = [part for part in mesh.parts if part.triangles[0] < part.triangles[1]]
    numbers = [colors.setdefault(part.color or WHITE, len(colors)) for part in parts]
    if all(part.color is None for part in parts):
        return mesh
    counts = [part.triangles[1] - part.triangles[0] for part in parts]
    color_of_triangle = np.repeat(numbers, counts)
    keys = mesh.triangles.astype(np.intp) * len(colors) + color_of_triangle[:, np.newaxis]
    used, corners = np.unique(keys, return_inverse=True)
    rows, number = np.divmod(used, len(colors))
    palette = np.array(list(colors))
    columns = 3 if (palette[:, 3] == 1).all() else 4
    leaders = rows if mesh.welds is None else mesh.welds[rows].astype(np.intp)
    first = np.zeros(len(mesh.positions), np.uint32)
    # The first of the new vertices at each position: in reverse order, it is written last.
    first[leaders[::-1]] = np.arange(len(rows), dtype=np.uint32)[::-1]
    welds = first[leaders]
    return replace(
        mesh,
        positions=mesh.positions[rows],
        normals=None if mesh.normals is None else mesh.normals[rows],
        uvs=None if mesh.uvs is None else mesh.uvs[rows],
        attributes=tuple((name, values[rows]) for name, values in mesh.attributes),
        colors=palette[number, :columns].astype(mesh.positions.dtype),
        triangles=corners.reshape(-1, 3).astype(np.uint32),
        welds=None if (welds == np.arange(len(rows))).all() else welds,
    )
