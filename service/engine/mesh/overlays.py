"""Lines beside the faces: the control net, and the boundary curves of the patches."""

from collections.abc import Iterable

import numpy as np

from service.bases import triangle
from service.bases.arrays import FloatArray, IndexArray, Ints, RealArray
from service.engine.connectivity.edges import sample_edges
from service.engine.connectivity.seams import find_seams
from service.engine.mesh.mesh import Overlay
from service.engine.options import MeshOptions
from service.engine.plans.layout import Layout
from service.engine.scratch import Real
from service.surface.batches import TensorPatches, TrianglePatches
from service.surface.lowered import PatchModel


def draw_overlays(
    model: PatchModel,
    options: MeshOptions,
    origin: FloatArray,
    dtype: Real,
) -> tuple[Overlay, ...]:
    """The requested overlays; positions have this dtype and are relative to the origin."""
    return tuple(
        draw_control_net(model, origin, dtype)
        if name == "control_net"
        else _draw_boundary(model, options, origin, dtype)
        for name in options.overlays
    )


def draw_control_net(model: PatchModel, origin: FloatArray, dtype: Real) -> Overlay:
    """The control net: all control points, segments between neighbours, and cells.

    Cells are omitted if the model has triangular nets.
    """
    positions, segments, cells = [], [], []
    first = 0
    for batch in model.nets:
        positions.append((batch.points - origin).reshape(-1, 3).astype(dtype))
        first_points = first + np.arange(batch.count) * (len(positions[-1]) // batch.count)
        if isinstance(batch, TrianglePatches):
            lines = _triangle_pattern(batch.degree)
        else:
            lines, quads = _net_pattern(batch)
            cells.append((quads + first_points[:, None, None]).reshape(-1, 4))
        segments.append((lines + first_points[:, None, None]).reshape(-1, 2))
        first += len(positions[-1])
    return Overlay(
        "control_net",
        np.concatenate(positions),
        np.concatenate(segments).astype(np.uint32),
        # An encoder that draws cells draws no segments, so triangular nets would not be shown.
        np.concatenate(cells).astype(np.uint32) if len(cells) == len(model.nets) else None,
    )


def _net_pattern(batch: TensorPatches) -> tuple[Ints, Ints]:
    """Segments (L, 2) and cells (C, 4) of one net; control point (i, j) has index i (q + 1) + j."""
    p, q = batch.degree
    number = np.arange((p + 1) * (q + 1)).reshape(p + 1, q + 1)
    along_u = np.stack([number[:-1], number[1:]], axis=-1).reshape(-1, 2)
    along_v = np.stack([number[:, :-1], number[:, 1:]], axis=-1).reshape(-1, 2)
    cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1)
    return np.concatenate([along_u, along_v]), cells.reshape(-1, 4)


def _triangle_pattern(degree: int) -> Ints:
    """Segments (L, 2) of one triangular net: along its rows, then from row to row."""
    # Each point but the last of its row begins an upright triangle. The points above these points
    # have consecutive numbers.
    first_corner = np.delete(
        np.arange(triangle.count_points(degree)), triangle.side_rows(degree)[1]
    )
    above = degree + 1 + np.arange(len(first_corner))
    lines = [(first_corner, first_corner + 1), (first_corner, above), (first_corner + 1, above)]
    return np.concatenate([np.stack(ends, axis=1) for ends in lines])


def draw_polylines(name: str, runs: Iterable[FloatArray], dtype: Real) -> Overlay:
    """Lines through points; a run (N, R+1, 3) has N lines of R + 1 points each."""
    positions: list[RealArray] = [np.empty((0, 3), dtype)]
    segments: list[IndexArray] = [np.empty((0, 2), np.uint32)]
    first = 0
    for points in runs:
        index = first + np.arange(points.size // 3, dtype=np.uint32).reshape(points.shape[:2])
        segments.append(np.stack([index[:, :-1], index[:, 1:]], axis=-1).reshape(-1, 2))
        positions.append(points.reshape(-1, 3).astype(dtype))
        first += index.size
    return Overlay(name, np.concatenate(positions), np.concatenate(segments))


def _draw_boundary(
    model: PatchModel, options: MeshOptions, origin: FloatArray, dtype: Real
) -> Overlay:
    """Each distinct edge once, as a polyline through its samples."""
    seams = find_seams(model.batches)
    divisions = Layout.build(seams.connectivity, options.resolution).divisions
    is_line = seams.connectivity.is_line
    runs = (
        sample_edges(seams.curves, is_line & (divisions == number), number, options.method) - origin
        for number in np.unique(divisions[is_line]).tolist()
    )
    return draw_polylines("boundary", (points.swapaxes(0, 1) for points in runs), dtype)
