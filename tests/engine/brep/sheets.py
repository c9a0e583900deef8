"""Prepared breps of sheets: faces on one surface (u, v, b u²), cut out by curves of parameters."""

from collections.abc import Sequence
from math import comb, cos, pi, sin
from typing import NamedTuple

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.places import SIZE, Places
from service.engine.trims.spline_shapes import find_boxes
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import CurveTable, SurfaceTable
from tests.engine.brep.made_breps import build_model

WIDTH = 10.0
"""Parameters of the surface are from 0 to 10."""


class Curve(NamedTuple):
    """A curve of parameters: a Bézier curve, or a polyline if the degree is 1."""

    points: Sequence[tuple[float, float]]
    weights: Sequence[float] | None = None
    degree: int | None = None


class Against(NamedTuple):
    """A curve that a loop runs against."""

    curve: Curve


Loop = Sequence[Curve | Against]
"""Curves one after the other."""


def line(*points: tuple[float, float]) -> Curve:
    """A line, or a polyline."""
    return Curve(points, degree=1)


def list_lines(points: Sequence[tuple[float, float]]) -> list[Curve]:
    """A polygon of lines."""
    return [line(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)]


def arc(center: tuple[float, float], radius: float, begin: float, end: float) -> list[Curve]:
    """An arc, in curves of at most 120°."""
    count = max(1, round(abs(end - begin) / (2 * pi / 3) + 0.49))
    curves = []
    for k in range(count):
        a, b = begin + (end - begin) * k / count, begin + (end - begin) * (k + 1) / count
        weight = cos((b - a) / 2)
        corners = [(a, 1.0), ((a + b) / 2, weight), (b, 1.0)]
        points = [
            (round(center[0] + radius / w * cos(x), 12), round(center[1] + radius / w * sin(x), 12))
            for x, w in corners
        ]
        curves.append(Curve(points, (1.0, weight, 1.0)))
    return curves


def hole(center: tuple[float, float], radius: float) -> list[Curve]:
    """A circle that runs clockwise, in two halves of quarters."""
    return [*arc(center, radius, 0, -pi), *arc(center, radius, -pi, -2 * pi)]


SQUARE = list_lines([(0, 0), (10, 0), (10, 10), (0, 10)])


def prepare_sheets(
    faces: Sequence[Sequence[Loop]],
    *,
    bend: float = 0.0,
    uncertainty: float = 1e-6,
    vertices: FloatArray | None = None,
) -> PreparedBrep:
    """A prepared brep of plane sheets, or of sheets bent by `bend`.

    A `Curve` that occurs several times is one edge. Ends of curves at one point are one vertex; its
    place is that point, or its row in `vertices`.
    """
    coedges = [
        (face, item.curve if isinstance(item, Against) else item, isinstance(item, Against))
        for face, loops in enumerate(faces)
        for loop in loops
        for item in loop
    ]
    loops = [loop for face in faces for loop in face]
    curves = list(dict.fromkeys(_freeze(curve) for _, curve, _ in coedges))
    number = {curve: k for k, curve in enumerate(curves)}
    corners = list(dict.fromkeys(curve.points[k] for curve in curves for k in (0, -1)))
    edges = np.array([number[_freeze(curve)] for _, curve, _ in coedges])
    coedge_faces = np.array([face for face, _, _ in coedges])
    pcurves = Splines.of(_build_table([_flat(curve) for curve in curves], 2)).take(edges)
    edge_curves = Splines.of(_build_table([_lift(curve, bend) for curve in curves], 3))
    low, high = np.full((2, len(faces), 2), np.inf)
    high *= -1
    least, most = find_boxes(pcurves)
    np.minimum.at(low, coedge_faces, least)
    np.maximum.at(high, coedge_faces, most)
    table = _build_surfaces(len(faces), bend)
    surfaces = FaceSurfaces.of(table).move_planes(low, high)
    places = Places.of(surfaces, low, high)
    if vertices is None:
        vertices = np.array([(u, v, bend * u * u) for u, v in corners])
    ends = [[corners.index(curve.points[k]) for k in (0, -1)] for curve in curves]
    counts = np.array([len(loop) for loop in loops])
    return PreparedBrep(
        model=build_model(table, np.zeros(len(faces), bool), ("sheet",), ()),
        surfaces=surfaces,
        places=places,
        curves=edge_curves,
        pcurves=pcurves.map_points(places.origin[coedge_faces], SIZE / places.extent[coedge_faces]),
        vertices=vertices,
        vertex_uncertainties=np.full(len(vertices), uncertainty),
        edge_vertices=np.array(ends),
        edge_curves=np.arange(len(curves)),
        edge_ranges=np.stack([edge_curves.start, edge_curves.end], axis=1),
        edge_uncertainties=np.full(len(curves), uncertainty),
        is_degenerate=np.zeros(len(curves), bool),
        loop_faces=np.repeat(np.arange(len(faces)), [len(face) for face in faces]),
        loop_counts=counts,
        loop_sources=np.arange(len(loops)),
        coedge_edges=edges,
        coedge_faces=coedge_faces,
        coedge_loops=np.repeat(np.arange(len(loops)), counts),
        coedge_reversed=np.array([is_reversed for _, _, is_reversed in coedges]),
        is_replaced=np.zeros(len(coedges), bool),
        is_reversed=np.zeros(len(faces), bool),
        edge_sources=np.arange(len(curves)),
        model_vertices=len(vertices),
        skipped_faces=(),
        box=np.array([[0.0, 0.0, 0.0], [WIDTH, WIDTH, bend * WIDTH * WIDTH]]),
        known_gaps=np.zeros(len(coedges)),
    )


def _freeze(curve: Curve) -> Curve:
    return Curve(
        tuple(curve.points), None if curve.weights is None else tuple(curve.weights), curve.degree
    )


def _flat(curve: Curve) -> tuple[FloatArray, FloatArray, int]:
    """Control points, weights and degree."""
    points = np.array(curve.points, float)
    weights = np.ones(len(points)) if curve.weights is None else np.array(curve.weights)
    return points, weights, curve.degree or len(points) - 1


def _lift(curve: Curve, bend: float) -> tuple[FloatArray, FloatArray, int]:
    """The curve on the surface: of twice the degree if this is bent, and the same parameters."""
    points, weights, degree = _flat(curve)
    if bend == 0.0:
        return np.column_stack([points, np.zeros(len(points))]), weights, degree
    x, y, w = points[:, 0] * weights, points[:, 1] * weights, weights
    products = [_multiply(x, w), _multiply(y, w), bend * _multiply(x, x), _multiply(w, w)]
    homogeneous = np.column_stack(products)
    return homogeneous[:, :3] / homogeneous[:, 3:], homogeneous[:, 3], 2 * degree


def _multiply(a: FloatArray, b: FloatArray) -> FloatArray:
    """The Bernstein coefficients of the product of two polynomials of degree n: degree 2 n."""
    n = len(a) - 1
    product = np.zeros(2 * n + 1)
    for i in range(n + 1):
        for j in range(n + 1):
            product[i + j] += comb(n, i) * comb(n, j) / comb(2 * n, i + j) * a[i] * b[j]
    return product


def _build_table(curves: list[tuple[FloatArray, FloatArray, int]], dimension: int) -> CurveTable:
    knots = []
    for points, _, degree in curves:
        spans = len(points) - degree
        inner = [k / spans for k in range(1, spans)]
        knots += [*[0.0] * (degree + 1), *inner, *[1.0] * (degree + 1)]
    return CurveTable(
        np.array([degree for _, _, degree in curves]),
        np.array([len(points) for points, _, _ in curves]),
        np.concatenate([points for points, _, _ in curves]).reshape(-1, dimension),
        np.concatenate([weights for _, weights, _ in curves]),
        np.array([bool((weights != weights[0]).any()) for _, weights, _ in curves]),
        np.array(knots),
    )


def _build_surfaces(count: int, bend: float) -> SurfaceTable:
    """Surfaces of degree (1, 1), or (2, 1) if they are bent."""
    heights = [0.0, bend * WIDTH * WIDTH] if bend == 0.0 else [0.0, 0.0, bend * WIDTH * WIDTH]
    degree = len(heights) - 1
    us = np.linspace(0.0, WIDTH, degree + 1)
    net = [(u, v, z) for u, z in zip(us, heights, strict=True) for v in (0.0, WIDTH)]
    knots = [*[0.0] * (degree + 1), *[WIDTH] * (degree + 1), 0.0, 0.0, WIDTH, WIDTH]
    return SurfaceTable(
        np.tile([degree, 1], (count, 1)),
        np.tile([degree + 1, 2], (count, 1)),
        np.tile(np.array(net), (count, 1)),
        np.ones(len(net) * count),
        np.zeros(count, bool),
        np.tile(knots, count),
    )
