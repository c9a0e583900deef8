"""Faces on closed surfaces, with loops of parameter curves alone: tubes, lenses and rings."""

from collections.abc import Sequence
from itertools import pairwise
from math import tau

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.brep_model import BrepModel
from service.surface.spline_tables import CurveTable, SurfaceTable
from tests.strategies import Array

WIDE, LONG = 3.0, 2.0
"""The domains of all surfaces are [0, WIDE] × [0, LONG]."""

KINDS = ("tube", "lens", "ring")
"""Closed along u; closed along u, with poles at both ends of v; closed along both."""

Loop = Sequence[tuple[float, float]]


def build_net(kind: str, rows: int = 6, columns: int = 6) -> Array:
    """A net (rows + 1, columns + 1, 3) about the z axis."""
    u = np.arange(rows + 1) % rows * tau / rows
    v = np.arange(columns + 1) / columns
    if kind == "ring":
        angle = np.arange(columns + 1) % columns * tau / columns
        radius, height = 3.0 + np.cos(angle), np.sin(angle)
    elif kind == "lens":
        radius, height = np.sin(v * tau / 2), 2.0 * v
        radius[[0, -1]] = 0.0
    else:
        radius, height = 1.0 + 0.3 * v, 2.0 * v
    net = np.empty((rows + 1, columns + 1, 3))
    net[..., 0] = np.cos(u)[:, np.newaxis] * radius
    net[..., 1] = np.sin(u)[:, np.newaxis] * radius
    net[..., 2] = height
    return net


def build_face(kind: str, loops: Sequence[Loop], *, skips: bool = False) -> BrepModel:
    """A face bounded by closed polygons of parameters, with a pcurve for each side.

    A polygon that runs around ends a period away from its beginning.
    """
    net = build_net(kind)
    counts = net.shape[:2]
    knots = [np.concatenate([[0.0], np.linspace(0, end, n), [end]]) for n, end in
             zip(counts, (WIDE, LONG), strict=True)]  # fmt: skip
    surfaces = SurfaceTable(
        np.array([[1, 1]]),
        np.array([counts]),
        net.reshape(-1, 3),
        np.ones(net[..., 0].size),
        np.zeros(1, bool),
        np.concatenate(knots),
    )
    ends = [np.array([a, b]) for loop in loops for a, b in pairwise(loop)]
    sides = np.concatenate(ends) if ends else np.zeros((0, 2))
    count = len(sides) // 2
    none = np.zeros(0, np.intp)
    return BrepModel(
        name="face",
        up="z",
        vertices=np.zeros((0, 3)),
        vertex_uncertainties=np.zeros(0),
        edge_vertices=np.zeros((0, 2), np.intp),
        edge_curves=none,
        edge_uncertainties=np.zeros(0),
        is_degenerate=np.zeros(0, bool),
        curves=build_lines(np.zeros((0, 3))),
        surfaces=surfaces,
        face_names=("",),
        palette=np.zeros((0, 4)),
        face_colors=np.array([-1]),
        is_reversed=np.array([False]),
        loop_faces=np.zeros(len(loops), np.intp),
        loop_counts=np.array([len(loop) - 1 for loop in loops], np.intp),
        coedge_edges=np.full(count, -1),
        coedge_reversed=np.zeros(count, bool),
        coedge_pcurves=np.arange(count),
        pcurves=build_lines(sides),
        shell_counts=np.array([1]),
        shell_faces=np.array([0]),
        is_closed=np.array([False]),
        uncertainty=1e-6,
        skips_invalid=skips,
    )


def build_lines(points: FloatArray) -> CurveTable:
    """Segments between points 0 and 1, 2 and 3, and so on."""
    count = len(points) // 2
    return CurveTable(
        np.ones(count, np.intp),
        np.full(count, 2),
        points,
        np.ones(len(points)),
        np.zeros(count, bool),
        np.tile([0.0, 0, 1, 1], count),
    )
