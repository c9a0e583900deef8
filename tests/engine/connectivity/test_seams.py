"""Seams: patches share the vertices of their common edges, for all parametrizations of patches."""

from collections import Counter
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles.deviation import measure_surface_to_mesh
from oracles.sheets import build_bezier_sheet
from service.bases.row_batches import unique_rows
from service.engine.connectivity.seams import find_seams
from service.engine.mesh.mesh import Mesh
from service.surface.batches import TensorPatches
from service.surface.lowered import Part, PatchModel
from tests.engine.meshing import (
    build_mesh,
    check_sound,
    check_upright,
    check_winding,
    find_first_vertices,
    find_topology,
    list_faces,
    to_triangles,
)
from tests.strategies import (
    ROTATIONS,
    Array,
    apply_symmetry,
    build_cube,
    build_model,
    height_nets,
    resolutions,
    split_models,
    translate,
    weights_like,
)
from tools.examples import lower_patches


def test_the_teapot_has_the_known_edges() -> None:
    """52 edges belong to two patches, 16 edges are open, and 8 sides are one point."""
    seams = find_seams(lower_patches("utah-teapot").batches)
    side_counts = np.bincount(seams.edge[~seams.collapsed])  # the number of sides of each edge
    assert (np.sum(side_counts == 2), np.sum(side_counts == 1)) == (52, 16)
    assert side_counts.max() == 2
    assert seams.collapsed.sum() == 8


@given(st.integers(0, 2**32 - 1))
def test_equal_rows_have_equal_numbers(seed: int) -> None:
    """The function also returns the first row with each number."""
    rows = np.random.default_rng(seed).integers(0, 3, (40, 3)).astype(float)
    first, number = unique_rows(rows)
    np.testing.assert_array_equal(rows[first][number], rows)
    assert len(first) == len(np.unique(rows, axis=0))
    for k, row in enumerate(first.tolist()):
        assert row == np.flatnonzero(number == k)[0]


def read_border_bits(mesh: Mesh) -> set[bytes]:
    """The positions of all border samples of all patches of a mesh made of grids."""
    result: set[bytes] = set()
    for batch in mesh.grids:
        for grid in batch:
            border = np.concatenate([grid[0], grid[-1], grid[:, 0], grid[:, -1]])
            result |= {row.tobytes() for row in mesh.positions[border]}
    return result


@given(split_models(), st.integers(1, 7))
def test_pieces_of_a_surface_weld_for_all_parametrizations(
    net_and_pieces: tuple[Array, list[Array]], divisions: int
) -> None:
    """Four quarters with reversed and exchanged parameters become one disc with smooth normals."""
    _, pieces = net_and_pieces
    mesh = build_mesh(pieces, resolution=(divisions, divisions))
    check_sound(mesh)
    check_upright(mesh)
    shape = find_topology(mesh)
    assert (shape.components, shape.euler, shape.boundary) == (1, 1, 8 * divisions)
    assert (shape.misoriented, shape.non_manifold) == (0, 0)
    # Every seam has one tangent plane, so each position has one vertex.
    assert len(mesh.positions) == shape.vertices == (2 * divisions + 1) ** 2
    assert mesh.welds is None


@given(split_models(oriented=False), resolutions)  # pieces may be upside down
def test_unequal_divisions_make_no_t_junctions(
    net_and_pieces: tuple[Array, list[Array]], resolution: tuple[int, int]
) -> None:
    """If neighbours divide a common edge differently, both take the larger number of divisions."""
    net, pieces = net_and_pieces
    low, high = net.min(axis=(0, 1)), net.max(axis=(0, 1))
    for faces in ("triangles", "quads"):
        mesh = build_mesh(pieces, resolution=resolution, faces=faces)
        check_sound(mesh)
        check_upright(mesh)
        shape = find_topology(mesh)
        assert (shape.components, shape.euler, shape.non_manifold) == (1, 1, 0)
        # Only the outer border is open, so the mesh has no crack inside.
        for a, b in list_open_edges(mesh):
            middle = (mesh.positions[a] + mesh.positions[b])[:2] / 2
            is_on_border = np.isclose(middle, low[:2]) | np.isclose(middle, high[:2])
            assert is_on_border.any()


def list_open_edges(mesh: Mesh) -> list[list[int]]:
    """The edges that only one face has, as pairs of first vertices at their positions."""
    loops = [find_first_vertices(mesh)[face].tolist() for face in list_faces(mesh)]
    uses = Counter(
        frozenset(ends) for loop in loops for ends in zip(loop, loop[1:] + loop[:1], strict=True)
    )
    return [sorted(edge) for edge, count in uses.items() if count == 1]


@given(
    st.sampled_from(["sphere", "torus", "cone", "cylinder"]),
    st.lists(st.sampled_from(ROTATIONS), min_size=16, max_size=16),
    st.tuples(st.integers(2, 7), st.integers(2, 7)),
    st.sampled_from(["triangles", "quads"]),
)
def test_quadrics_are_closed_for_all_parametrizations_of_their_patches(
    example: str, symmetries: list[int], resolution: tuple[int, int], faces: str
) -> None:
    """Neighbours with different parametrizations have unequal divisions, which strips connect.

    Strips occur at poles, at creases and at rational edges.
    """
    (batch,) = lower_patches(example).batches
    assert batch.weights is not None
    # No example has more than 16 patches; the remaining symmetries are not used.
    pieces = [apply_symmetry(net, k) for net, k in zip(batch.points, symmetries, strict=False)]
    weights = [apply_symmetry(net, k) for net, k in zip(batch.weights, symmetries, strict=False)]
    mesh = build_mesh(build_model(pieces, weights), resolution=resolution, faces=faces)
    check_sound(mesh)
    if min(resolution) > 2:  # with two divisions, a chord may cross the strip beside it
        check_winding(mesh)
    assert mesh.report.watertight
    assert find_topology(mesh).euler == (0 if example == "torus" else 2)


def test_a_shared_edge_takes_the_larger_number_of_divisions() -> None:
    """At a resolution of 2 × 5, one square has 2 divisions on the common edge, the other has 5."""
    plane = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]])
    # Along the edge x = 1, v varies in the first square (5 divisions), and u in the second square
    # (2 divisions).
    second_square = apply_symmetry(translate(plane, 1), 5)
    mesh = build_mesh([plane, second_square], resolution=(2, 5))
    check_sound(mesh)
    check_winding(mesh)
    on_edge = mesh.positions[mesh.positions[:, 0] == 1]
    np.testing.assert_allclose(np.sort(on_edge[:, 1]), np.arange(6) / 5, atol=1e-15)
    assert find_topology(mesh).euler == 1
    assert mesh.grids == ()  # the second square has a strip, which is not a grid


@given(split_models(), st.integers(1, 6))
def test_the_border_of_a_patch_has_the_same_bits_with_and_without_neighbours(
    net_and_pieces: tuple[Array, list[Array]], divisions: int
) -> None:
    """Therefore meshes of parts of a model fit together, also if each is computed separately."""
    _, pieces = net_and_pieces
    resolution = (divisions, divisions)
    bits_together = read_border_bits(build_mesh(pieces, resolution=resolution))
    bits_alone = [read_border_bits(build_mesh([piece], resolution=resolution)) for piece in pieces]
    assert set.union(*bits_alone) == bits_together


@given(height_nets(), st.data())
def test_seams_of_rational_pieces_weld(net: Array, data: st.DataObject) -> None:
    """The weights of the common edge are equal, or equal up to a factor."""
    weights = data.draw(weights_like(net))
    mirrored = net * (-1, 1, 1) + 2 * net[0, 0] * (1, 0, 0)
    # The mirror image shares the side u = 0 of the net. Reversed along u, its normals point up, and
    # this side is its side u = 1.
    for factor in (1.0, 2.0, 3.0):
        model = build_model([net, mirrored[::-1]], [weights, weights[::-1] * factor])
        # A crease angle of 0 keeps different normals on the edge; the positions are still equal.
        mesh = build_mesh(model, resolution=(4, 5), crease_angle=0)
        check_sound(mesh)
        shape = find_topology(mesh)
        assert (shape.components, shape.euler, shape.non_manifold) == (1, 1, 0)


def build_neighbours(count: int) -> tuple[Array, Array]:
    """Pairs of patches (count, 2, 3, 3, 3) that share an edge, and their weights.

    The weights of the common edge differ by a factor, so that rounding changes their last digits.
    """
    rng = np.random.default_rng(17)
    nets = rng.uniform(-1, 1, (count, 2, 3, 3, 3))
    nets[:, 1, 0] = nets[:, 0, -1]
    weights = rng.uniform(0.2, 5, (count, 2, 3, 3))
    weights[:, 1, 0] = weights[:, 0, -1]
    factors = np.ones((count, 2, 1, 1))
    factors[:, 1] = rng.uniform(0.1, 10, (count, 1, 1))
    return nets, weights * factors


def test_a_common_factor_of_weights_does_not_change_the_bits_of_the_seam() -> None:
    """Both patches, in both orders, have equal positions on the edge."""
    for nets, weights in zip(*build_neighbours(20), strict=True):
        result = []
        for order in ([0, 1], [1, 0]):
            mesh = build_mesh(
                build_model([nets[k] for k in order], [weights[k] for k in order]),
                resolution=(6, 6),
                weld=False,
            )
            # The edge is the last row of patch 0 and the first row of patch 1.
            sides = [mesh.grids[0][row][0 if k else -1] for row, k in enumerate(order)]
            result += [mesh.positions[side].tobytes() for side in sides]
        assert len(set(result)) == 1


def test_a_rational_edge_with_equal_weights_welds_to_a_polynomial_edge() -> None:
    """The patches are in two batches."""
    net = np.array([[[0.0, 0, 0], [0, 1, 2], [0, 2, 0]], [[1, 0, 0], [1, 1, 1], [1, 2, 0]]])
    weights = np.array([[1.0, 2, 1], [0.7, 0.7, 0.7]])
    polynomial_net = translate(net, 1)
    polynomial_net[0] = net[-1]
    model = PatchModel(
        "mixed",
        (TensorPatches(net[None], weights[None]), TensorPatches(polynomial_net[None])),
        (Part("mixed", 0, 2),),
    )
    mesh = build_mesh(model, resolution=(3, 6))
    check_sound(mesh)
    assert (find_topology(mesh).components, find_topology(mesh).euler) == (1, 1)


def test_edges_with_different_weights_do_not_weld() -> None:
    """Equal control points alone do not make one edge."""
    net = np.array([[[0.0, 0, 0], [0, 1, 2], [0, 2, 0]], [[1, 0, 0], [1, 1, 1], [1, 2, 0]]])
    mirrored = (net * (-1, 1, 1))[::-1]
    ones, changed_weights = np.ones((2, 3)), np.array([[1.0, 1, 1], [1, 3, 1]])
    # The default is 16 divisions; six sides are open if the patches share an edge, else eight.
    for weights, open_sides in (([ones, ones], 6), ([ones, changed_weights], 8)):
        mesh = build_mesh(build_model([net, mirrored], weights))
        assert find_topology(mesh).boundary == open_sides * 16


@given(st.lists(st.sampled_from(ROTATIONS), min_size=6, max_size=6), resolutions)
def test_a_cube_has_eight_corners_and_twelve_edges(
    symmetries: list[int], resolution: tuple[int, int]
) -> None:
    """Six bilinear patches with random parametrizations; normals point outwards."""
    patches = build_cube(symmetries)
    seams = find_seams(build_model(patches).batches)
    assert (len(seams.corner_points), len(np.unique(seams.edge))) == (8, 12)
    mesh = build_mesh(patches, resolution=resolution)
    # The 12 edges are creases: a corner has three normals, an inner sample of an edge two.
    assert mesh.welds is not None
    normals_of_position = np.bincount(mesh.welds)
    assert (normals_of_position.max(), np.sum(normals_of_position == 3)) == (3, 8)
    check_sound(mesh)
    check_winding(mesh)
    shape = find_topology(mesh)
    assert shape.watertight
    assert mesh.report.watertight
    assert shape.euler == 2


@pytest.mark.parametrize(("angle", "vertices"), [(0.05, 8), (0.2, 6)])
def test_the_crease_angle_decides_whether_normals_are_averaged(angle: float, vertices: int) -> None:
    """Two squares at an angle of 0.1 have a crease if the crease angle is smaller."""
    flat = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]])
    tilted = flat * (np.cos(0.1), 1, 1) + (1, 0, 0)
    tilted[1, :, 2] = np.sin(0.1)
    mesh = build_mesh([flat, tilted], resolution=(1, 1), crease_angle=angle)
    check_sound(mesh)
    assert len(mesh.positions) == vertices
    assert find_topology(mesh).vertices == 6


def build_band() -> Array:
    """The net of a band around the z axis, closed because its last row is its first row."""
    rows = [(1, 0), (1, 2), (-3, 2), (-3, -2), (1, -2), (1, 0)]
    return np.array([[[x, y, z] for z in (1.0, 0.0)] for x, y in rows], dtype=float)


@pytest.mark.parametrize("symmetry", range(8))
def test_a_patch_welds_with_itself(symmetry: int) -> None:
    """A closed band has no open seam, for all eight parametrizations."""
    mesh = build_mesh([apply_symmetry(build_band(), symmetry)], resolution=(12, 12))
    check_sound(mesh)
    check_winding(mesh)
    shape = find_topology(mesh)
    assert len(mesh.positions) == shape.vertices == 12 * 13
    assert (shape.boundary, shape.euler, shape.components) == (24, 0, 1)
    assert mesh.welds is None


def test_a_moebius_strip_has_one_border() -> None:
    """Both sides of the seam have the same direction, so the edges there are misoriented."""
    net = np.array(
        [
            [[1, 0, -1], [1, 0, 1]],
            [[1, 3, -1], [1, 3, 1]],
            [[-4, 2, -1], [-4, 2, 1]],
            [[-4, -2, 1], [-4, -2, -1]],
            [[1, -3, 1], [1, -3, -1]],
            [[1, 0, 1], [1, 0, -1]],
        ],
        dtype=float,
    )
    mesh = build_mesh([net], resolution=(20, 4))
    check_sound(mesh)
    shape = find_topology(mesh)
    assert (shape.euler, shape.boundary, shape.components) == (0, 40, 1)
    assert shape.misoriented == 4


def test_an_edge_of_three_patches_is_not_a_manifold() -> None:
    """Three pages of a book meet at the spine; the report says that the mesh is not watertight."""
    page = np.array([[[0.0, 0, 0], [0, 0, 1]], [[1, 0, 0], [1, 0, 1]]])
    pages = [page @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) for c, s in _list_directions(3)]
    mesh = build_mesh(pages, resolution=(3, 3))
    check_sound(mesh)
    shape = find_topology(mesh)
    assert (shape.non_manifold, shape.boundary) == (3, 27)
    assert not mesh.report.watertight


def _list_directions(count: int) -> list[tuple[float, float]]:
    """Unit vectors at equal angles, as pairs (cos, sin)."""
    return [(np.cos(2 * pi * k / count), np.sin(2 * pi * k / count)) for k in range(count)]


@pytest.mark.parametrize("faces", ["triangles", "quads"])
@pytest.mark.parametrize("divisions", [(2, 2), (3, 2)])
def test_a_pillow_is_closed(divisions: tuple[int, int], faces: str) -> None:
    """Two patches have all four sides in common.

    If the diagonal of a corner cell were the same in both, it would be an edge of four triangles.
    """
    front = np.stack([*np.meshgrid([0.0, 1, 2], [0.0, 1, 2], indexing="ij"), np.zeros((3, 3))], -1)
    back = front.copy()
    front[1, 1, 2], back[1, 1, 2] = 1, -1
    for parametrized_back in (back.swapaxes(0, 1), back[::-1, ::-1].swapaxes(0, 1), back[::-1]):
        mesh = build_mesh([front, parametrized_back], resolution=divisions, faces=faces)
        check_winding(mesh)
        check_sound(mesh)
        assert mesh.report.watertight
        assert find_topology(mesh).euler == 2
        result = measure_surface_to_mesh(
            [build_bezier_sheet(net) for net in (front, parametrized_back)],
            mesh.positions[to_triangles(mesh)],
            count=100,
        )
        assert result.distance <= (mesh.report.deviation_bound or 0) + result.rounding


@given(height_nets(degree=st.integers(1, 3)), st.integers(1, 4))
def test_neighbours_of_different_degree_across_the_common_edge_weld(net: Array, n: int) -> None:
    """They have the same degree along the common edge."""
    edge = net[-1:]
    cubic = np.concatenate([edge, translate(edge, 1), translate(edge, 2), translate(edge, 3, z=1)])
    model = build_model([net, cubic])
    mesh = build_mesh(model, resolution=(n, n + 1))
    check_sound(mesh)
    assert (find_topology(mesh).components, find_topology(mesh).euler) == (1, 1)


FOLDED = (
    [
        [[0, 0, 0], [1, 0, 0], [2, 0, 0]],
        [[1, 0, 0], [1, 1, 3], [2, 2, 1]],
        [[2, 0, 0], [3, 1, 2], [3, 3, 3]],
    ],
    [[[0, 0, 0], [1, 0, 0]], [[1, 0, 0], [1, 1, 1]]],
    [[[0, 0, 0], [0, 0, 0], [0, 0, 0]], [[1, 0, 0], [1, 0, 0], [1, 0, 0]]],
    [[[0, 0, 0], [0, 0, 0]], [[1, 0, 0], [1, 1, 0]]],
)
"""Two patches on which two sides that meet are one edge, a patch that is a line, and a patch with a
pole."""


@pytest.mark.parametrize("net", FOLDED)
@pytest.mark.parametrize("faces", ["triangles", "quads"])
@pytest.mark.parametrize("weld", [True, False])
@pytest.mark.parametrize("resolution", [(1, 1), (2, 2), (4, 4), (3, 5), (5, 1)])
def test_the_report_of_a_folded_patch_is_right(
    net: list[list[list[float]]], faces: str, weld: bool, resolution: tuple[int, int]
) -> None:
    """No face has two vertices at one position, and the counts of open edges are right."""
    check_sound(
        build_mesh([np.array(net, dtype=float)], faces=faces, weld=weld, resolution=resolution)
    )
