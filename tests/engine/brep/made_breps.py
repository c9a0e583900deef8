"""Prepared breps and their triangles made by hand, for tests of what follows triangulation."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.brep_triangulation import BrepTriangulation
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.places import SIZE, Places
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.errors import Issue
from service.surface.brep_model import BrepModel, SkippedFace
from service.surface.spline_tables import CurveTable, SurfaceTable
from tests.strategies import Array

CUBE = np.array(list(product((0.0, 1.0), repeat=3)))
SIDES = (
    ((0, 1, 2, 3), False), ((4, 5, 6, 7), True), ((0, 1, 4, 5), True),
    ((2, 3, 6, 7), False), ((0, 2, 4, 6), False), ((1, 3, 5, 7), True),
)  # fmt: skip
"""For each side of the cube its corners at (u, v) = (0, 0), (0, 1), (1, 0) and (1, 1), and whether
du × dv is the outer normal; else the face is reversed."""


def build_lines(points: FloatArray) -> CurveTable:
    """Lines between pairs of points (n, 2, D)."""
    count = len(points)
    return CurveTable(
        np.ones(count, np.intp),
        np.full(count, 2),
        points.reshape(2 * count, points.shape[2]),
        np.ones(2 * count),
        np.zeros(count, bool),
        np.tile([0.0, 0, 1, 1], count),
    )


def build_nets(nets: Sequence[Array], degrees: Sequence[tuple[int, int]]) -> SurfaceTable:
    """Polynomial surfaces of these nets and degrees, with uniform clamped knots."""
    knots: list[float] = []
    for net, degree in zip(nets, degrees, strict=True):
        for axis in (0, 1):
            inner = net.shape[axis] - degree[axis] - 1
            steps = [k / (inner + 1) for k in range(1, inner + 1)]
            knots += [*[0.0] * (degree[axis] + 1), *steps, *[1.0] * (degree[axis] + 1)]
    points = np.concatenate([net.reshape(-1, 3) for net in nets])
    return SurfaceTable(
        np.array(degrees),
        np.array([net.shape[:2] for net in nets]),
        points,
        np.ones(len(points)),
        np.zeros(len(nets), bool),
        np.array(knots),
    )


def build_cube(
    reversed_faces: bool = True, names: Sequence[str] = ("bottom",), skips: Sequence[int] = ()
) -> tuple[PreparedBrep, BrepTriangulation]:
    """A cube of six plane faces with two triangles each; its corners are in `CUBE`.

    With `reversed_faces` the normals of all faces point outwards, else du × dv is the normal. The
    first two faces are red. The faces `skips` have no triangles.
    """
    nets = [CUBE[list(corners)].reshape(2, 2, 3) for corners, _ in SIDES]
    is_reversed = np.array([not is_outer for _, is_outer in SIDES]) & reversed_faces
    loops = [
        [(corners[k], corners[m]) for k, m in ((0, 2), (2, 3), (3, 1), (1, 0))]
        for corners, _ in SIDES
    ]
    edges = sorted({tuple(sorted(pair)) for loop in loops for pair in loop})
    coedges = [edges.index((min(pair), max(pair))) for loop in loops for pair in loop]
    edge_vertices = np.array(edges)
    model = build_model(build_nets(nets, [(1, 1)] * 6), is_reversed, names, skips)
    prepared = build_prepared(
        model, CUBE, edge_vertices, np.array(coedges), np.repeat(np.arange(6), 4)
    )
    corners = np.array([corner for corners, _ in SIDES for corner in corners])
    triangles, faces = [], []
    for face in range(6):
        if face in skips:
            continue
        for triangle in ((0, 2, 3), (0, 3, 1)):
            ordered = triangle[::-1] if is_reversed[face] else triangle
            triangles.append([4 * face + k for k in ordered])
            faces.append(face)
    square = np.array([[0, 0], [0, SIZE], [SIZE, 0], [SIZE, SIZE]])
    triangulation = BrepTriangulation(
        positions=CUBE,
        triangles=np.array(triangles),
        faces=np.array(faces),
        points=corners,
        corner_faces=np.repeat(np.arange(6), 4),
        places=np.tile(square, (6, 1)),
        face_bounds=np.arange(6) / 1024,
        edge_bounds=np.full(len(edges), 1 / 4096),
        mesh_bounds=None,
        edge_starts=2 * np.arange(len(edges) + 1),
        edge_points=edge_vertices.ravel(),
        rounds=1,
    )
    return prepared, triangulation


def build_grid(
    net: Array, degree: tuple[int, int], divisions: int
) -> tuple[PreparedBrep, BrepTriangulation]:
    """One face, the whole surface of a net, as a grid of triangles; all samples are points.

    Samples at one position are one point. The edges are those of the first and last row.
    """
    table = build_nets([net], [degree])
    model = build_model(table, np.zeros(1, bool), ("face",), ())
    at = np.linspace(0, SIZE, divisions + 1).astype(np.intp)
    places = np.stack(np.meshgrid(at, at, indexing="ij"), axis=-1).reshape(-1, 2)
    surfaces = FaceSurfaces.of(table)
    grid = Places.of(surfaces, surfaces.low, surfaces.high)
    samples = grid.evaluate(np.zeros(len(places), np.intp), places)
    positions, points = np.unique(samples.round(12), axis=0, return_inverse=True)
    number = np.arange(len(places)).reshape(divisions + 1, divisions + 1)
    a, b, c, d = (
        rows.ravel()
        for rows in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    )
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    corners = points.reshape(-1)[triangles]
    triangles = triangles[(corners != corners[:, [1, 2, 0]]).all(axis=1)]
    edge_points = points.reshape(-1)[number[[0, -1]]]
    prepared = build_prepared(
        model, positions, edge_points[:, [0, -1]], np.array([0, 1]), np.zeros(2, np.intp)
    )
    triangulation = BrepTriangulation(
        positions=positions,
        triangles=triangles,
        faces=np.zeros(len(triangles), np.intp),
        points=points.reshape(-1),
        corner_faces=np.zeros(len(places), np.intp),
        places=places,
        face_bounds=np.array([0.5]),
        edge_bounds=np.zeros(2),
        mesh_bounds=None,
        edge_starts=np.array([0, divisions + 1, 2 * divisions + 2]),
        edge_points=edge_points.ravel(),
        rounds=1,
    )
    return prepared, triangulation


def build_model(
    surfaces: SurfaceTable, is_reversed: Bools, names: Sequence[str], skips: Sequence[int]
) -> BrepModel:
    """The lowered form, as far as a mesh needs it; its first two faces are red."""
    faces, empty = len(surfaces), np.empty(0, np.intp)
    no_curves, no_pcurves = (build_lines(np.empty((0, 2, k))) for k in (3, 2))
    kept = np.array([face for face in range(faces) if face not in skips])
    skipped = tuple(
        SkippedFace(face, Issue("loop_open", "Open.", "", "a gap", "none")) for face in skips
    )
    return BrepModel(
        name="made",
        up="z",
        vertices=np.empty((0, 3)),
        vertex_uncertainties=np.empty(0),
        edge_vertices=np.empty((0, 2), np.intp),
        edge_curves=empty,
        edge_uncertainties=np.empty(0),
        is_degenerate=np.empty(0, bool),
        curves=no_curves,
        surfaces=surfaces,
        face_names=(*names, *[""] * (faces - len(names))),
        palette=np.array([[0.8, 0.2, 0.1, 1.0]]),
        face_colors=np.where(np.arange(faces) < 2, 0, -1),
        is_reversed=is_reversed,
        loop_faces=empty,
        loop_counts=empty,
        coedge_edges=empty,
        coedge_reversed=np.empty(0, bool),
        coedge_pcurves=empty,
        pcurves=no_pcurves,
        shell_counts=np.array([len(kept)]),
        shell_faces=kept,
        is_closed=np.array([False]),
        uncertainty=1e-6,
        skipped=skipped,
    )


def build_prepared(
    model: BrepModel,
    vertices: FloatArray,
    edge_vertices: Ints,
    coedge_edges: Ints,
    coedge_faces: Ints,
) -> PreparedBrep:
    """A prepared brep with straight edges; its parameter curves are not those of its faces."""
    surfaces = FaceSurfaces.of(model.surfaces)
    coedges, edges = len(coedge_edges), len(edge_vertices)
    loop_faces, loop_counts = np.unique(coedge_faces, return_counts=True)
    prepared = PreparedBrep(
        model=model,
        surfaces=surfaces,
        places=Places.of(surfaces, surfaces.low, surfaces.high),
        curves=Splines.of(build_lines(vertices[edge_vertices])),
        pcurves=Splines.of(build_lines(np.zeros((coedges, 2, 2)))),
        vertices=vertices,
        vertex_uncertainties=np.full(len(vertices), 1e-6),
        edge_vertices=edge_vertices,
        edge_curves=np.arange(edges),
        edge_ranges=np.tile([0.0, 1.0], (edges, 1)),
        edge_uncertainties=np.full(edges, 1e-6),
        is_degenerate=np.zeros(edges, bool),
        loop_faces=loop_faces,
        loop_counts=loop_counts,
        loop_sources=np.arange(len(loop_faces)),
        coedge_edges=coedge_edges,
        coedge_faces=coedge_faces,
        coedge_loops=np.searchsorted(loop_faces, coedge_faces),
        coedge_reversed=np.zeros(coedges, bool),
        is_replaced=np.zeros(coedges, bool),
        is_reversed=model.is_reversed,
        edge_sources=np.arange(edges),
        model_vertices=len(vertices),
        skipped_faces=model.skipped,
        box=np.array([vertices.min(axis=0), vertices.max(axis=0)]),
    )
    prepared.__dict__["gaps"] = np.full(coedges, 1e-7)
    return prepared
