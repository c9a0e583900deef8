"""Lines beside an adaptive mesh: the control net, and the sides of the faces."""

from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.storage import Storage
from service.engine.mesh.mesh import Overlay
from service.engine.mesh.overlays import control_net
from service.engine.options import MeshOptions
from service.surface.lowered import PatchModel


def draw_lines(
    model: PatchModel, border: Border, options: MeshOptions, storage: Storage, origin: FloatArray
) -> tuple[Overlay, ...]:
    """The overlays asked for, in that order, in the precision and about the origin of the mesh."""
    return tuple(
        _net(model, storage, origin) if name == "control_net" else _sides(border, storage, origin)
        for name in options.overlays
    )


def _net(model: PatchModel, storage: Storage, origin: FloatArray) -> Overlay:
    """All control points, as they are stored."""
    if not storage.step:
        return control_net(model, origin, storage.dtype)
    net = control_net(model, np.zeros(3), np.float64)
    return replace(net, positions=storage.written(net.positions.astype(np.float64), origin))


def _sides(border: Border, storage: Storage, origin: FloatArray) -> Overlay:
    """Every side of every face once, through the vertices that the triangles have there."""
    ends = _segments(border)
    used, back = np.unique(ends, return_inverse=True)
    segments = back.reshape(-1, 2).astype(np.uint32)
    return Overlay("boundary", storage.written(border.points[used], origin), segments)


def _segments(border: Border) -> Ints:
    """Pairs (L, 2) of neighbouring vertices on the sides, each pair once, in order of sides."""
    follows = np.ones(len(border.vertex), dtype=bool)
    follows[border.start[1:] - 1] = False
    begin = follows.nonzero()[0]
    pairs = np.stack([border.vertex[begin], border.vertex[begin + 1]], axis=1)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    pairs.sort(axis=1)
    _, first = np.unique(pairs[:, 0] * (len(border.points) + 1) + pairs[:, 1], return_index=True)
    distinct: Ints = pairs[np.sort(first)]
    return distinct
