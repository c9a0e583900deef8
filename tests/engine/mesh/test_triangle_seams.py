"""Triangles in meshes: counts, seams with triangles and grids in any orientation, closed solids."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.engine.mesh.mesh_value import Mesh
from service.engine.mesh.patterns import TriangleShape, build_faces
from service.engine.mesh.seams import find_seams
from service.engine.options import Faces, MeshOptions
from service.engine.tessellate import predict_size, tessellate
from service.surface.lowered import PatchModel
from tests.engine.meshing import (
    build_mesh,
    check_sound,
    check_upright,
    check_values,
    check_winding,
    find_topology,
    to_triangles,
)
from tests.oracles import triangles
from tests.oracles.topology import count_topology, volume, weld_by_position
from tests.strategies import (
    Array,
    apply_symmetry,
    build_mixed_model,
    height_nets,
    resolutions,
    translate,
    triangle_heights,
    weights_like,
)

divisions = st.integers(1, 9)
kinds = st.sampled_from(["triangles", "quads"])


def check_prediction(model: PatchModel, mesh: Mesh, options: MeshOptions) -> None:
    """Sizes predicted before anything is computed are large enough."""
    vertices, flat, quads = predict_size(model, options)
    assert len(mesh.positions) <= vertices
    assert len(mesh.triangles) <= flat
    assert len(mesh.quads) <= quads


def check_closed_by_bits(mesh: Mesh) -> None:
    """Borders found by positions alone are those that the mesh reports."""
    loops = weld_by_position(mesh.positions, to_triangles(mesh))
    result, reported = count_topology(loops), find_topology(mesh)
    assert (result.boundary, result.non_manifold) == (reported.boundary, reported.non_manifold)


@given(divisions, kinds)
def test_the_pattern_tiles_the_triangle(count: int, kind: Faces) -> None:
    """R² triangles that are all counter-clockwise, without gaps; half of them point up."""
    result, quads = build_faces(TriangleShape(count), kind)
    assert (len(result), len(quads)) == (count**2, 0)
    places = [(Fraction(j, count), Fraction(k, count)) for _, j, k in triangles.keys(count)]
    areas = []
    for loop in result.tolist():
        (ax, ay), (bx, by), (cx, cy) = (places[i] for i in loop)
        areas.append((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
    assert set(areas) == {Fraction(1, count**2)}
    shape = count_topology(result.tolist())
    assert (shape.euler, shape.components, shape.boundary) == (1, 1, 3 * count)
    assert (shape.non_manifold, shape.misoriented) == (0, 0)
    # By rows: the highest sample of a face never falls.
    rows = [max(places[i][1] for i in loop) for loop in result.tolist()]
    assert rows == sorted(rows)


@given(triangle_heights(), resolutions, kinds, st.booleans())
def test_one_triangle_is_the_rows_of_the_conventions(
    net: Array, resolution: tuple[int, int], kind: Faces, single: bool
) -> None:
    """(R+1)(R+2)/2 vertices in the order of the samples, R² triangles; R is the larger number."""
    model, count = build_mixed_model([net]), max(resolution)
    options = MeshOptions(resolution, faces=kind, uvs=True)
    mesh = tessellate(model, options, single=single)
    check_sound(mesh)
    check_upright(mesh)
    each = (count + 1) * (count + 2) // 2
    assert (len(mesh.positions), len(mesh.triangles), len(mesh.quads)) == (each, count**2, 0)
    assert predict_size(model, options) == (each, count**2, 0)
    assert (mesh.grids, mesh.welds) == ((), None)
    assert mesh.uvs is not None
    uvs = np.array([(j, k) for _, j, k in triangles.keys(count)]) / count
    np.testing.assert_array_equal(mesh.uvs, uvs.astype(mesh.uvs.dtype))
    assert mesh.report.boundary_edges == 3 * count
    assert mesh.report.poles_repaired == 0


def build_neighbours(net: Array, other: Array) -> tuple[Array, Array]:
    """Two triangles over the halves of a square that share the side from (n, 0) to (0, n)."""
    n = triangles.find_degree(len(net))
    second = other.copy()
    second[:, :2] = n - second[:, :2]
    keys = triangles.keys(n)
    row = {key: number for number, key in enumerate(keys)}
    for number, (i, j, k) in enumerate(keys):
        if i == 0:
            # (0, j, k) of the first lies at x = j, y = k; so does (0, k, j) of the second.
            second[row[0, k, j]] = net[number]
    return net, second


@given(st.data(), st.integers(0, 2), st.integers(0, 2), resolutions, st.booleans())
def test_triangles_weld_however_they_are_turned(
    data: st.DataObject, first: int, second: int, resolution: tuple[int, int], rational: bool
) -> None:
    """Any side joins any side: the mesh is one piece without cracks, and all faces look up."""
    degree = st.just(data.draw(st.integers(1, 4)))
    pair = build_neighbours(
        data.draw(triangle_heights(degree)), data.draw(triangle_heights(degree))
    )
    nets = [
        triangles.apply_symmetry(net, way) for net, way in zip(pair, (first, second), strict=True)
    ]
    weights = None
    if rational:
        drawn = [data.draw(weights_like(net)) for net in pair]
        keys = triangles.keys(triangles.find_degree(len(pair[0])))
        row = {key: number for number, key in enumerate(keys)}
        for number, (i, j, k) in enumerate(keys):
            if i == 0:
                # Weights are equal up to a factor that changes their last digits.
                drawn[1][row[0, k, j]] = 3 * drawn[0][number]
        weights = [
            triangles.apply_symmetry(w, way) for w, way in zip(drawn, (first, second), strict=True)
        ]
    model = build_mixed_model(nets, weights)
    mesh = tessellate(model, MeshOptions(resolution))
    check_sound(mesh)
    check_upright(mesh)
    check_prediction(model, mesh, MeshOptions(resolution))
    check_closed_by_bits(mesh)
    count = max(resolution)
    assert mesh.report.vertices == (count + 1) ** 2
    assert (find_topology(mesh).boundary, find_topology(mesh).components) == (4 * count, 1)


def join_below(grid: Array, triangle: Array) -> Array:
    """The triangle below a grid; its side t = 0 has the points of the side v = 0 of the grid."""
    below = triangle.copy()
    below[:, 1] = -below[:, 1]
    n = len(grid) - 1
    # Turned over: s must fall along x for the normal to stay up.
    below = triangles.apply_symmetry(below, 3)
    below[: n + 1] = grid[::-1, 0]
    return below


@given(st.data(), st.integers(0, 7), st.integers(0, 5), resolutions, kinds)
def test_triangles_weld_to_grids_however_both_are_turned(
    data: st.DataObject, symmetry: int, way: int, resolution: tuple[int, int], kind: Faces
) -> None:
    """Each of three sides joins each of four, in both directions; the coarser grid gets a strip."""
    n = data.draw(st.integers(1, 4))
    grid = data.draw(height_nets(degree=st.just(n)))
    below = join_below(grid, data.draw(triangle_heights(st.just(n))))
    nets = [apply_symmetry(grid, symmetry), triangles.apply_symmetry(below, way)]
    if data.draw(st.booleans()):
        nets.reverse()
    model, options = build_mixed_model(nets), MeshOptions(resolution, faces=kind)
    mesh = tessellate(model, options)
    check_sound(mesh)
    check_upright(mesh)
    check_prediction(model, mesh, options)
    check_closed_by_bits(mesh)
    seams = find_seams(model.batches)
    lines = seams.edge[~seams.collapsed]
    assert sorted(np.bincount(lines)[np.unique(lines)].tolist()) == [1] * 5 + [2]
    assert find_topology(mesh).components == 1
    assert find_topology(mesh).non_manifold == 0


def build_prism(degree: int = 3) -> list[Array]:
    """A prism between two flat triangles, its three sides grids, its lid and floor triangles.

    Everything bulges in its middle; the normals point outwards.
    """
    rng = np.random.default_rng(degree)
    corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0]])
    lid = np.array([np.array(key) / degree @ corners for key in triangles.keys(degree)])
    floor = triangles.apply_symmetry(lid, 3)
    inside = [min(key) > 0 for key in triangles.keys(degree)]
    lid = translate(lid, 0, 0, 2)
    lid[inside, 2] += rng.uniform(0.2, 0.5, sum(inside))
    floor[inside, 2] -= rng.uniform(0.2, 0.5, sum(inside))
    sides = []
    for k in range(3):
        begin, end = corners[k], corners[(k + 1) % 3]
        t, h = np.arange(degree + 1.0)[:, None, None] / degree, np.array([0, 1.0, 2])[:, None]
        side = (1 - t) * begin + t * end + h * np.array([0, 0, 1.0])
        side[1:-1, 1, :2] *= 0.9
        sides.append(side)
    return [lid, *sides, floor]


@settings(deadline=None)
@given(
    st.lists(st.integers(0, 3), min_size=3, max_size=3),
    st.lists(st.integers(0, 2), min_size=2, max_size=2),
    resolutions,
    kinds,
    st.booleans(),
)
def test_closed_solids_of_both_kinds_are_watertight(
    grids: list[int], ends: list[int], resolution: tuple[int, int], kind: Faces, single: bool
) -> None:
    """Euler's characteristic 2, however the patches are turned and divided."""
    lid, *sides, floor = build_prism()
    rotations = (0, 3, 5, 6)
    nets = [triangles.apply_symmetry(lid, ends[0])]
    nets += [apply_symmetry(side, rotations[k]) for side, k in zip(sides, grids, strict=True)]
    nets += [triangles.apply_symmetry(floor, ends[1])]
    model, options = build_mixed_model(nets), MeshOptions(resolution, faces=kind)
    mesh = tessellate(model, options, single=single)
    check_sound(mesh)
    check_prediction(model, mesh, options)
    shape = find_topology(mesh)
    assert mesh.report.watertight
    assert (shape.euler, shape.components, shape.misoriented) == (2, 1, 0)
    check_closed_by_bits(mesh)
    assert volume(mesh.positions, to_triangles(mesh)) > 0


def build_tetrahedron() -> list[Array]:
    """Four flat triangles, normals outward."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    return [points[list(face)] for face in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))]


@pytest.mark.parametrize("count", range(1, 6))
def test_a_tetrahedron_keeps_its_creases(count: int) -> None:
    """Four times R² faces; an edge has two normals, a corner three."""
    mesh = build_mesh(build_mixed_model(build_tetrahedron()), resolution=(count, count))
    check_sound(mesh)
    check_winding(mesh)
    shape = find_topology(mesh)
    assert (shape.euler, shape.faces, mesh.report.watertight) == (2, 4 * count**2, True)
    assert shape.vertices == 2 * count**2 + 2
    assert len(mesh.positions) == 4 * (count + 1) * (count + 2) // 2
    assert volume(mesh.positions, mesh.triangles) == pytest.approx(1 / 6, rel=1e-15)
    # Without normals all copies are welded; without welding none are.
    bare = build_mesh(
        build_mixed_model(build_tetrahedron()), resolution=(count, count), normals=False
    )
    assert len(bare.positions) == shape.vertices
    loose = build_mesh(
        build_mixed_model(build_tetrahedron()), resolution=(count, count), weld=False
    )
    check_sound(loose)
    assert (loose.report.boundary_edges, find_topology(loose).components) == (12 * count, 4)


@given(st.lists(st.sampled_from(range(3)), max_size=3), resolutions, st.booleans(), st.booleans())
def test_sides_in_a_point_leave_no_empty_faces(
    sides: list[int], resolution: tuple[int, int], weld: bool, single: bool
) -> None:
    """For any collapsed sides, no face has a position twice, and the report is right."""
    net = np.array([(j, k, j * k + j) for _, j, k in triangles.keys(4)], dtype=float)
    for side in sides:
        on = np.array([key[(1, 0, 2)[side]] == 0 for key in triangles.keys(4)])
        net[on] = net[on][0]
    mesh = build_mesh(build_mixed_model([net]), resolution=resolution, weld=weld, single=single)
    check_values(mesh)
    if len(set(sides)) < 2:
        check_sound(mesh)
    if len(set(sides)) == 1 and weld:
        count = max(resolution)
        assert len(mesh.triangles) == count**2 - count


def test_a_triangle_that_meets_itself_is_a_cone() -> None:
    """Sides s = 0 and r = 0 are one curve, from the apex down: the rim closes."""
    net = np.array(
        [
            *([1.0, 0, 0], [1, 2, 0], [-3, 0, 0], [1, -2, 0], [1, 0, 0]),
            *([0.75, 0, 1], [0, 1, 1], [0, -1, 1], [0.75, 0, 1]),
            *([0.5, 0, 2], [0, 0.5, 2], [0.5, 0, 2]),
            *([0.25, 0, 3], [0.25, 0, 3], [0, 0, 4]),
        ]
    )
    for count in (2, 3, 8):
        mesh = build_mesh(build_mixed_model([net]), resolution=(count, count))
        if count > 2:
            check_sound(mesh)
            assert mesh.report.boundary_edges == count
        assert find_topology(mesh).degenerate == 0


def test_the_control_net_is_drawn_with_all_its_small_triangles() -> None:
    """Fifteen points of degree 4: ten upright triangles of three segments each."""
    net = np.array([(j, k, j * k) for _, j, k in triangles.keys(4)], dtype=float)
    grid = np.zeros((2, 3, 3))
    grid[..., 0], grid[..., 1] = [[7], [8]], [0, 1, 2]
    mesh = build_mesh(build_mixed_model([net, grid]), overlays=("control_net", "boundary"))
    drawn, boundary = mesh.overlays
    np.testing.assert_array_equal(drawn.positions, np.concatenate([net, grid.reshape(-1, 3)]))
    row = {key: number for number, key in enumerate(triangles.keys(4))}
    expected = set()
    for i, j, k in triangles.keys(3):
        a, b, c = row[i + 1, j, k], row[i, j + 1, k], row[i, j, k + 1]
        expected |= {frozenset((a, b)), frozenset((b, c)), frozenset((c, a))}
    result = [frozenset(pair) for pair in drawn.segments.tolist()]
    assert len(set(result)) == len(result) == 30 + 7
    assert {pair for pair in result if max(pair) < 15} == expected
    assert drawn.cells is None
    assert len(boundary.segments) == 7 * 16
    (only,) = build_mesh(build_mixed_model([grid]), overlays=("control_net",)).overlays
    assert only.cells is not None
