"""Corners of tubes and ribbons: no face has zero area, whatever the sides and the scale."""

import io
import math
from collections import Counter

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from service.bases.arrays import FloatArray, RealArray
from service.encoders.format import EncodeOptions
from service.encoders.oogl import encode as encode_oogl
from service.encoders.stl import encode as encode_stl
from service.engine.build import build
from service.engine.mesh.mesh import Mesh
from service.engine.options import Faces, MeshOptions
from service.surface.curve import BezierCurve, BsplineCurve
from service.surface.sweeps import RibbonSurface, SweptSurface, TubeSurface

ZIGZAG = np.array([[0.0, 0, 0], [8, 0, 0], [2, 3, 0], [9, 7, 0]])
"""Two corners, both sharper than a right angle."""


@st.composite
def placed_polylines(draw: st.DrawFn) -> tuple[FloatArray, float]:
    """Points (n, 3) of a turned, scaled and moved polyline, and its scale.

    The points have whole coordinates before: corners of 180° and repeated points are frequent.
    """
    point = st.tuples(st.integers(0, 2), st.integers(0, 2), st.integers(0, 1))
    points = draw(st.lists(point, min_size=2, max_size=6).filter(lambda p: len(set(p)) > 1))
    rng = np.random.default_rng(draw(st.integers(0, 3)))
    turn = draw(st.sampled_from([np.eye(3), np.linalg.qr(rng.normal(size=(3, 3)))[0]]))
    scale = draw(st.sampled_from([1.0, 1e-6, 3e4]))
    shift = draw(st.sampled_from([0.0, 1.0, 100.0])) * scale
    return np.array(points) @ turn.T * scale + shift, scale


def find_areas(mesh: Mesh) -> FloatArray:
    """The areas of triangles, and of the triangles on both sides of a diagonal of each quad."""
    quads = mesh.quads
    faces = np.concatenate([mesh.triangles, quads[:, [0, 1, 2]]])
    first_areas = find_triangle_areas(mesh.positions, faces)
    first_areas[len(mesh.triangles) :] += find_triangle_areas(mesh.positions, quads[:, [0, 2, 3]])
    return first_areas


def find_triangle_areas(positions: RealArray, triangles: np.ndarray) -> FloatArray:
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    areas: FloatArray = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return areas


def list_unbalanced_edges(mesh: Mesh) -> list[tuple[int, int]]:
    """Edges that faces use more often in one direction than in the other."""
    welds = np.arange(len(mesh.positions)) if mesh.welds is None else mesh.welds
    uses: Counter[tuple[int, int]] = Counter()
    for faces in (welds[mesh.triangles], welds[mesh.quads]):
        for k in range(faces.shape[1]):
            uses.update(zip(faces[:, k - 1].tolist(), faces[:, k].tolist(), strict=True))
    return [(a, b) for (a, b), count in uses.items() if uses[b, a] != count]


@given(
    placed_polylines(), st.integers(3, 20), st.sampled_from(["triangles", "quads"]), st.booleans()
)
def test_no_face_at_a_corner_has_zero_area(
    placed: tuple[FloatArray, float], sides: int, faces: Faces, weld: bool
) -> None:
    """And tubes are closed: faces use each edge equally often in both directions."""
    points, scale = placed
    curve, radius = BsplineCurve(points, 1), 0.2 * scale
    tube = TubeSurface(curve, np.array([radius]), sides=sides)
    pointed_tube = TubeSurface(curve, np.array([radius, 0.0]), sides=sides, caps=False)
    ribbon = RibbonSurface(curve, np.array([radius]), facing=np.array([1.0, 1, 0]))
    pointed_ribbon = RibbonSurface(curve, np.array([radius, 0.0]), facing=np.array([1.0, 1, 0]))
    surfaces: tuple[SweptSurface, ...] = (tube, pointed_tube, ribbon, pointed_ribbon)
    for surface in surfaces:
        mesh = build(surface.lower(), MeshOptions((2, 1), faces=faces, weld=weld))
        assert find_areas(mesh).min() > 1e-13 * radius**2
        if weld and surface is tube:
            assert list_unbalanced_edges(mesh) == []
            assert mesh.report.boundary_edges == 0


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("sides", [3, 4, 6, 12, 16, 50])
def test_readers_of_stl_find_a_closed_tube(sides: int, turned: bool) -> None:
    """Readers merge corners with equal bits, and drop triangles that then have no area."""
    turn = Rotation.from_rotvec([1.0, 2.0, 0.5]).as_matrix() if turned else np.eye(3)
    tube = TubeSurface(BsplineCurve(ZIGZAG @ turn.T, 1), np.array([0.25]), sides=sides)
    mesh = build(tube.lower(), MeshOptions((3, 1)), is_float32=True)
    solid = trimesh.load(io.BytesIO(encode_stl(mesh, EncodeOptions())), file_type="stl")
    assert isinstance(solid, trimesh.Trimesh)
    assert len(solid.faces) == len(mesh.triangles)
    assert solid.area_faces.min() > 0
    assert solid.is_watertight


@pytest.mark.parametrize("axes", [[0, 1, 2], [2, 0, 1]])
@pytest.mark.parametrize("scale", [1.0, 1e-7, 12345.0])
def test_a_tube_as_wide_as_its_bend_has_one_vertex_at_the_centre(
    scale: float, axes: list[int]
) -> None:
    """A quarter of a circle of radius 1, in a tube of radius 1: its inside is one point."""
    corner = np.array([[1.0, 0, 0], [1, 1, 0], [0, 1, 0]])[:, axes] * scale
    arc = BezierCurve(corner, np.array([1, math.sqrt(0.5), 1]))
    mesh = build(TubeSurface(arc, np.array([scale]), sides=4).lower(), MeshOptions((8, 1)))
    at_centre = np.abs(mesh.positions).max(axis=1) < 1e-9 * scale
    assert mesh.welds is not None
    assert len(np.unique(mesh.welds[at_centre])) == 1
    assert find_areas(mesh).min() > 1e-6 * scale**2
    assert list_unbalanced_edges(mesh) == []


def test_a_repeated_point_of_a_curve_adds_no_faces() -> None:
    points = np.array([[0.1, 0, 0], [2, 0, 0], [3, 2, 0]])
    twice = TubeSurface(BsplineCurve(points[[0, 1, 1, 2, 2]], 1), np.array([0.1]))
    once = TubeSurface(BsplineCurve(points, 1), np.array([0.1]))
    meshes = [build(tube.lower(), MeshOptions((3, 1))) for tube in (once, twice)]
    assert len(meshes[0].triangles) == len(meshes[1].triangles)
    cquads = [encode_oogl(mesh, EncodeOptions(oogl="cquad")) for mesh in meshes]
    assert len(cquads[0].splitlines()) == len(cquads[1].splitlines())


@pytest.mark.parametrize("repeats", [0, 1, 3])
def test_a_ribbon_that_gets_narrower_at_a_repeated_point_has_no_faces_there(repeats: int) -> None:
    points = np.array([[0.1, 0, 0], *[[2, 0, 0]] * repeats, [2, 0, 0], [3, 0, 0]])
    ribbon = RibbonSurface(BsplineCurve(points, 1), np.array([0.4, 0.1]))
    mesh = build(ribbon.lower(), MeshOptions((3, 1)))
    assert find_areas(mesh).min() > 1e-3
    assert len(mesh.triangles) == 12


def test_a_closed_curve_of_one_division_has_no_faces() -> None:
    loop = BezierCurve(np.array([[0.0, 0, 0], [3, 0, 1], [0, 3, 0], [0, 0, 0]]))
    for surface in (RibbonSurface(loop, np.array([0.1])), TubeSurface(loop, np.array([0.1]))):
        assert len(build(surface.lower(), MeshOptions((1, 1))).triangles) == 0
        assert find_areas(build(surface.lower(), MeshOptions((2, 1)))).min() > 1e-3
