"""Triangles in meshes: counts, seams with triangles and grids in any orientation, closed solids."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oracles import triangles
from oracles.topology import count_topology, volume, weld_by_position
from service.engine.connectivity.seams import find_seams
from service.engine.mesh.mesh import Mesh
from service.engine.options import Faces, MeshOptions
from service.engine.plans.patterns import TriangleShape, build_faces
from service.engine.tessellate import predict_size, tessellate
from service.surface.lowered import PatchModel
from tests.engine.meshing import (
    build_mesh,
    check_sound,
    check_upright,
    check_winding,
    find_topology,
    to_triangles,
)
from tests.strategies import (
    ROTATIONS,
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
    """Checks that the sizes that `predict_size` predicts are not exceeded."""
    vertices, triangle_count, quads = predict_size(model, options)
    assert len(mesh.positions) <= vertices
    assert len(mesh.triangles) <= triangle_count
    assert len(mesh.quads) <= quads


def check_borders_by_positions(mesh: Mesh) -> None:
    """Checks that welding by the bits of positions gives the borders that the mesh reports."""
    loops = weld_by_position(mesh.positions, to_triangles(mesh))
    result, reported = count_topology(loops), find_topology(mesh)
    assert (result.boundary, result.non_manifold) == (reported.boundary, reported.non_manifold)


@given(divisions, kinds)
def test_the_pattern_tiles_the_triangle(count: int, kind: Faces) -> None:
    """The pattern has R² triangles of equal area, counter-clockwise and without gaps.

    Keys are (i, j, k), the powers of r, s and t.
    """
    result, quads = build_faces(TriangleShape(count), kind)
    assert (len(result), len(quads)) == (count**2, 0)
    places = [(Fraction(j, count), Fraction(k, count)) for _, j, k in triangles.keys(count)]
    double_areas = []
    for loop in result.tolist():
        (ax, ay), (bx, by), (cx, cy) = (places[i] for i in loop)
        double_areas.append((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
    assert set(double_areas) == {Fraction(1, count**2)}
    shape = count_topology(result.tolist())
    assert (shape.euler, shape.components, shape.boundary) == (1, 1, 3 * count)
    assert (shape.non_manifold, shape.misoriented) == (0, 0)
    # Faces are listed row by row: the highest row of a face never decreases.
    rows = [max(places[i][1] for i in loop) for loop in result.tolist()]
    assert rows == sorted(rows)


@given(triangle_heights(), resolutions, kinds, st.booleans())
def test_one_triangle_has_the_documented_order_of_vertices(
    net: Array, resolution: tuple[int, int], kind: Faces, is_float32: bool
) -> None:
    """R is the larger number of divisions: (R+1)(R+2)/2 vertices, row by row, and R² triangles."""
    model, count = build_mixed_model([net]), max(resolution)
    options = MeshOptions(resolution, faces=kind, uvs=True)
    mesh = tessellate(model, options, is_float32=is_float32)
    check_sound(mesh)
    check_upright(mesh)
    vertices = (count + 1) * (count + 2) // 2
    assert (len(mesh.positions), len(mesh.triangles), len(mesh.quads)) == (vertices, count**2, 0)
    assert predict_size(model, options) == (vertices, count**2, 0)
    assert (mesh.grids, mesh.welds) == ((), None)
    assert mesh.uvs is not None
    uvs = np.array([(j, k) for _, j, k in triangles.keys(count)]) / count
    np.testing.assert_array_equal(mesh.uvs, uvs.astype(mesh.uvs.dtype))
    assert mesh.report.boundary_edges == 3 * count
    assert mesh.report.poles_repaired == 0


def build_neighbours(net: Array, second_net: Array) -> tuple[Array, Array]:
    """Two triangles over the halves of a square that share the side from (n, 0) to (0, n)."""
    n = triangles.find_degree(len(net))
    second = second_net.copy()
    second[:, :2] = n - second[:, :2]
    keys = triangles.keys(n)
    row = {key: number for number, key in enumerate(keys)}
    for number, (i, j, k) in enumerate(keys):
        if i == 0:
            # (0, j, k) of the first triangle and (0, k, j) of the second are at x = j, y = k.
            second[row[0, k, j]] = net[number]
    return net, second


@given(st.data(), st.integers(0, 2), st.integers(0, 2), resolutions, st.booleans())
def test_triangles_weld_along_any_of_their_sides(
    data: st.DataObject,
    first_symmetry: int,
    second_symmetry: int,
    resolution: tuple[int, int],
    is_rational: bool,
) -> None:
    """The mesh has one component without cracks, and all faces are counter-clockwise from above."""
    pair_symmetries = first_symmetry, second_symmetry  # rotations, which keep the normals
    degree = st.just(data.draw(st.integers(1, 4)))
    pair = build_neighbours(
        data.draw(triangle_heights(degree)), data.draw(triangle_heights(degree))
    )
    nets = [
        triangles.apply_symmetry(net, symmetry)
        for net, symmetry in zip(pair, pair_symmetries, strict=True)
    ]
    weights = None
    if is_rational:
        pair_weights = [data.draw(weights_like(net)) for net in pair]
        keys = triangles.keys(triangles.find_degree(len(pair[0])))
        row = {key: number for number, key in enumerate(keys)}
        for number, (i, j, k) in enumerate(keys):
            if i == 0:
                # The weights are equal up to a factor; multiplying changes their last digits.
                pair_weights[1][row[0, k, j]] = 3 * pair_weights[0][number]
        weights = [
            triangles.apply_symmetry(w, symmetry)
            for w, symmetry in zip(pair_weights, pair_symmetries, strict=True)
        ]
    model = build_mixed_model(nets, weights)
    mesh = tessellate(model, MeshOptions(resolution))
    check_sound(mesh)
    check_upright(mesh)
    check_prediction(model, mesh, MeshOptions(resolution))
    check_borders_by_positions(mesh)
    count = max(resolution)
    # The two triangles have together the vertices of a grid over the square.
    assert mesh.report.vertices == (count + 1) ** 2
    assert (find_topology(mesh).boundary, find_topology(mesh).components) == (4 * count, 1)


def join_below(grid: Array, triangle: Array) -> Array:
    """A triangle below a grid: its side t = 0 has the points of the grid's side v = 0."""
    lower_net = triangle.copy()
    lower_net[:, 1] = -lower_net[:, 1]
    n = len(grid) - 1
    # Now s decreases along x, so that the normal still points up. The first n + 1 points are those
    # with t = 0, so they are the points of the grid's side in reverse order.
    lower_net = triangles.apply_symmetry(lower_net, 3)
    lower_net[: n + 1] = grid[::-1, 0]
    return lower_net


@given(st.data(), st.integers(0, 7), st.integers(0, 5), resolutions, kinds)
def test_any_side_of_a_triangle_welds_to_any_side_of_a_grid(
    data: st.DataObject,
    grid_symmetry: int,
    triangle_symmetry: int,
    resolution: tuple[int, int],
    kind: Faces,
) -> None:
    """The sides may have equal or opposite directions.

    If the grid has fewer divisions along its side than the triangle, a strip of triangles joins
    them.
    """
    n = data.draw(st.integers(1, 4))
    grid = data.draw(height_nets(degree=st.just(n)))
    triangle = join_below(grid, data.draw(triangle_heights(st.just(n))))
    nets = [
        apply_symmetry(grid, grid_symmetry),
        triangles.apply_symmetry(triangle, triangle_symmetry),
    ]
    if data.draw(st.booleans()):
        nets.reverse()
    model, options = build_mixed_model(nets), MeshOptions(resolution, faces=kind)
    mesh = tessellate(model, options)
    check_sound(mesh)
    check_upright(mesh)
    check_prediction(model, mesh, options)
    check_borders_by_positions(mesh)
    # Of the seven sides, five are open, and two are one edge.
    seams = find_seams(model.batches)
    edges = seams.edge[~seams.collapsed]
    assert sorted(np.bincount(edges)[np.unique(edges)].tolist()) == [1] * 5 + [2]
    assert find_topology(mesh).components == 1
    assert find_topology(mesh).non_manifold == 0


def build_prism(degree: int = 3) -> list[Array]:
    """A prism: its lid and its floor are triangles, its three sides are grids.

    The lid and the floor bulge outwards. The inner control points of the sides are nearer to the z
    axis than those of flat sides. The normals point outwards.
    """
    rng = np.random.default_rng(degree)
    corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0]])
    lid = np.array([np.array(key) / degree @ corners for key in triangles.keys(degree)])
    floor = triangles.apply_symmetry(lid, 3)  # a reflection: its normal points down
    is_inner = [min(key) > 0 for key in triangles.keys(degree)]
    lid = translate(lid, 0, 0, 2)
    lid[is_inner, 2] += rng.uniform(0.2, 0.5, sum(is_inner))
    floor[is_inner, 2] -= rng.uniform(0.2, 0.5, sum(is_inner))
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
    st.lists(st.sampled_from(ROTATIONS), min_size=3, max_size=3),
    st.lists(st.integers(0, 2), min_size=2, max_size=2),
    resolutions,
    kinds,
    st.booleans(),
)
def test_a_prism_of_triangles_and_grids_is_watertight(
    side_rotations: list[int],
    triangle_rotations: list[int],
    resolution: tuple[int, int],
    kind: Faces,
    is_float32: bool,
) -> None:
    """Its Euler characteristic is 2 for all parametrizations and resolutions of its patches."""
    lid, *sides, floor = build_prism()
    nets = [triangles.apply_symmetry(lid, triangle_rotations[0])]
    nets += [
        apply_symmetry(side, rotation) for side, rotation in zip(sides, side_rotations, strict=True)
    ]
    nets += [triangles.apply_symmetry(floor, triangle_rotations[1])]
    model, options = build_mixed_model(nets), MeshOptions(resolution, faces=kind)
    mesh = tessellate(model, options, is_float32=is_float32)
    check_sound(mesh)
    check_prediction(model, mesh, options)
    shape = find_topology(mesh)
    assert mesh.report.watertight
    assert (shape.euler, shape.components, shape.misoriented) == (2, 1, 0)
    check_borders_by_positions(mesh)
    assert volume(mesh.positions, to_triangles(mesh)) > 0


def build_tetrahedron() -> list[Array]:
    """Four flat triangles whose normals point outwards."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    return [points[list(face)] for face in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))]


@pytest.mark.parametrize("count", range(1, 6))
def test_a_tetrahedron_keeps_its_creases(count: int) -> None:
    """It has 4 R² faces; a position has two normals on an edge, three at a corner."""
    mesh = build_mesh(build_mixed_model(build_tetrahedron()), resolution=(count, count))
    check_sound(mesh)
    check_winding(mesh)
    shape = find_topology(mesh)
    assert (shape.euler, shape.faces, mesh.report.watertight) == (2, 4 * count**2, True)
    assert shape.vertices == 2 * count**2 + 2
    assert len(mesh.positions) == 4 * (count + 1) * (count + 2) // 2
    assert volume(mesh.positions, mesh.triangles) == pytest.approx(1 / 6, rel=1e-15)
    # Without normals, all vertices at one position are welded.
    without_normals = build_mesh(
        build_mixed_model(build_tetrahedron()), resolution=(count, count), normals=False
    )
    assert len(without_normals.positions) == shape.vertices
    separate_mesh = build_mesh(
        build_mixed_model(build_tetrahedron()), resolution=(count, count), weld=False
    )
    check_sound(separate_mesh)
    components = find_topology(separate_mesh).components
    assert (separate_mesh.report.boundary_edges, components) == (12 * count, 4)


@given(st.lists(st.sampled_from(range(3)), max_size=3), resolutions, st.booleans(), st.booleans())
def test_collapsed_sides_leave_no_faces_without_area(
    sides: list[int], resolution: tuple[int, int], weld: bool, is_float32: bool
) -> None:
    """No face has two vertices at one position, and the report is right."""
    net = np.array([(j, k, j * k + j) for _, j, k in triangles.keys(4)], dtype=float)
    for side in sides:
        # The sides 0, 1 and 2 are s = 0, r = 0 and t = 0.
        is_on_side = np.array([key[(1, 0, 2)[side]] == 0 for key in triangles.keys(4)])
        net[is_on_side] = net[is_on_side][0]
    mesh = build_mesh(
        build_mixed_model([net]), resolution=resolution, weld=weld, is_float32=is_float32
    )
    check_sound(mesh)
    if len(set(sides)) == 1 and weld:
        # Along the collapsed side, one triangle of each division has no area and is omitted.
        count = max(resolution)
        assert len(mesh.triangles) == count**2 - count


def test_a_triangle_whose_sides_are_one_edge_is_a_cone() -> None:
    """The sides s = 0 and r = 0 are one curve from the apex to the rim, so the rim is closed."""
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
        check_sound(mesh)
        # With two divisions, the mesh is two triangles with the same corners, so it has no border.
        assert mesh.report.boundary_edges == (0 if count == 2 else count)


def test_the_control_net_overlay_of_a_triangle_has_all_segments() -> None:
    """A net of degree 4 has 15 points and 10 upright triangles, with 3 segments each."""
    net = np.array([(j, k, j * k) for _, j, k in triangles.keys(4)], dtype=float)
    grid = np.zeros((2, 3, 3))
    grid[..., 0], grid[..., 1] = [[7], [8]], [0, 1, 2]
    mesh = build_mesh(build_mixed_model([net, grid]), overlays=("control_net", "boundary"))
    net_overlay, boundary = mesh.overlays
    np.testing.assert_array_equal(net_overlay.positions, np.concatenate([net, grid.reshape(-1, 3)]))
    row = {key: number for number, key in enumerate(triangles.keys(4))}
    expected = set()
    for i, j, k in triangles.keys(3):
        a, b, c = row[i + 1, j, k], row[i, j + 1, k], row[i, j, k + 1]
        expected |= {frozenset((a, b)), frozenset((b, c)), frozenset((c, a))}
    result = [frozenset(pair) for pair in net_overlay.segments.tolist()]
    # The triangle has 30 segments, and the 2 × 3 net of the grid has 7.
    assert len(set(result)) == len(result) == 30 + 7
    assert {pair for pair in result if max(pair) < 15} == expected
    assert net_overlay.cells is None  # the quads of nets, which only grids have
    assert len(boundary.segments) == 7 * 16  # seven sides, each with the default of 16 divisions
    (grid_overlay,) = build_mesh(build_mixed_model([grid]), overlays=("control_net",)).overlays
    assert grid_overlay.cells is not None
