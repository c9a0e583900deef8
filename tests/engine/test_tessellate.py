"""Meshes of models: the counts of the teapot, exactness, winding, precision, determinism."""

import hashlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles import exact
from oracles.topology import count_topology, weld_by_position
from service.engine.mesh.mesh import Mesh
from service.surface.batches import TensorPatches
from service.surface.lowered import PatchModel
from tests.engine.meshing import (
    build_mesh,
    check_sound,
    check_upright,
    check_values,
    check_winding,
    find_topology,
    list_faces,
)
from tests.strategies import (
    Array,
    build_model,
    degenerate_nets,
    height_nets,
    resolutions,
    weighted_nets,
)
from tools.examples import UNTRIMMED, lower_patches


@pytest.mark.slow
@pytest.mark.parametrize(
    ("weld", "faces", "is_float32"),
    [(True, "triangles", False), (True, "quads", True), (False, "triangles", True)],
)
@pytest.mark.parametrize("example", UNTRIMMED)
def test_every_example_is_sound(example: str, weld: bool, faces: str, is_float32: bool) -> None:
    """Welded or not, with triangles or quads, in either precision."""
    mesh = build_mesh(example, is_float32=is_float32, weld=weld, faces=faces, resolution=(5, 5))
    check_sound(mesh)
    check_winding(mesh)
    assert mesh.positions.dtype == (np.float32 if is_float32 else np.float64)


@pytest.mark.parametrize("is_float32", [False, True])
def test_the_welded_teapot_has_the_known_counts(is_float32: bool) -> None:
    """8257 positions, 256 boundary edges on 16 open borders, four components, all manifold.

    The default resolution is (16, 16): a patch has 256 quads, each split into two triangles.

    The handle touches the body in one point. Handle and body have different normals there, so this
    position has two vertices.
    """
    mesh = build_mesh("utah-teapot", is_float32=is_float32)
    shape = find_topology(mesh)
    assert mesh.report.vertices == shape.vertices == 8257
    assert len(build_mesh("utah-teapot", is_float32=is_float32, normals=False).positions) == 8257
    assert mesh.welds is not None
    (repeated_vertex,) = np.flatnonzero(mesh.welds != np.arange(8258)).tolist()
    np.testing.assert_allclose(mesh.positions[repeated_vertex], (-2, 0, 0.9), rtol=1e-7)
    assert (shape.boundary, shape.non_manifold, shape.misoriented) == (256, 0, 0)
    assert shape.components == 4
    # The 16 quads at each of the eight poles have two equal corners: they are one triangle each.
    assert len(mesh.triangles) == 32 * 512 - 8 * 16
    assert mesh.report.boundary_edges == 256
    assert not mesh.report.watertight
    assert mesh.report.patches == 32


def test_teapot_has_no_cracks_by_position() -> None:
    """Vertices are compared by the bits of their positions, without `welds` and the report."""
    for resolution in ((16, 16), (3, 7), (1, 1), (5, 4)):
        mesh = build_mesh("utah-teapot", weld=False, resolution=resolution)
        welded = build_mesh("utah-teapot", resolution=resolution)
        result = count_topology(weld_by_position(welded.positions, welded.triangles))
        assert result == find_topology(welded)
        # With one division, the two halves of the handle lie on each other, with the same faces.
        assert result.non_manifold == 0 or resolution == (1, 1)
        assert len(mesh.positions) == 32 * (resolution[0] + 1) * (resolution[1] + 1)


def test_the_teapot_has_triangles_instead_of_quads_only_at_poles() -> None:
    """32 patches of 16 × 16 faces; 16 of these are triangles at each of the eight poles."""
    mesh = build_mesh("utah-teapot", faces="quads")
    assert (len(mesh.quads), len(mesh.triangles)) == (32 * 256 - 8 * 16, 8 * 16)
    assert mesh.report.vertices == 8257
    assert find_topology(mesh).boundary == 256


def test_the_teapot_keeps_its_parts() -> None:
    """Each patch has 4 × 4 quads of two triangles; those at a pole are one triangle."""
    mesh = build_mesh("utah-teapot", resolution=(4, 4))
    patches = {"rim": 4, "body": 8, "handle": 4, "spout": 4, "lid": 8, "bottom": 4}
    assert [part.name for part in mesh.parts] == list(patches)
    for part in mesh.parts:
        # Four patches of the lid and of the bottom have a pole.
        omitted = 4 * 4 if part.name in ("lid", "bottom") else 0
        assert part.triangles[1] - part.triangles[0] == patches[part.name] * 32 - omitted


@given(weighted_nets(height_nets()), resolutions)
def test_grids_list_the_vertex_of_each_sample(
    net_and_weights: tuple[Array, Array | None], resolution: tuple[int, int]
) -> None:
    """Vertex `grids[0][0, i, j]` has the position, normal and parameters of sample (i, j)."""
    net, weights = net_and_weights
    model = build_model([net], None if weights is None else [weights])
    mesh = build_mesh(model, resolution=resolution, uvs=True)
    check_sound(mesh)
    (grid,) = mesh.grids
    assert grid.shape == (1, resolution[0] + 1, resolution[1] + 1)
    expected = exact.positions(net, weights, resolution)
    np.testing.assert_allclose(mesh.positions[grid[0]], expected, atol=1e-13)
    assert mesh.uvs is not None
    u, v = (np.arange(r + 1) / r for r in resolution)
    np.testing.assert_array_equal(
        mesh.uvs[grid[0]], np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    )
    assert mesh.normals is not None
    normals = exact.normals(net, weights, resolution)  # NaN where du × dv is 0
    assert np.nanmax(np.abs(mesh.normals[grid[0]] - normals)) < 1e-9


@given(height_nets(), resolutions, st.sampled_from(["triangles", "quads"]))
def test_a_single_patch_has_the_documented_order_of_vertices_and_faces(
    net: Array, resolution: tuple[int, int], faces: str
) -> None:
    """Sample (i, j) is vertex i (Rv+1) + j, and faces are counter-clockwise about the normal.

    `check_upright` checks the latter.
    """
    mesh = build_mesh([net], resolution=resolution, faces=faces)
    ru, rv = resolution
    index = np.arange((ru + 1) * (rv + 1)).reshape(ru + 1, rv + 1)
    np.testing.assert_array_equal(mesh.grids[0][0], index)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    if faces == "quads":
        expected = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
        np.testing.assert_array_equal(mesh.quads, expected)
        assert len(mesh.triangles) == 0
    else:
        # Triangles are equal if they have the same corners in the same order, from any corner on.
        result = {tuple(np.roll(t, -int(np.argmin(t)))) for t in mesh.triangles.tolist()}
        halves = [np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, d), (b, c, d))]
        assert result == {
            tuple(np.roll(t, -int(np.argmin(t)))) for t in np.concatenate(halves).tolist()
        }
        assert len(mesh.triangles) == 2 * ru * rv
    shape = find_topology(mesh)
    assert (shape.boundary, shape.euler) == (2 * (ru + rv), 1)
    check_sound(mesh)
    check_upright(mesh)


@given(degenerate_nets(), resolutions, st.booleans())
def test_degenerate_nets_make_usable_meshes(
    net: Array, resolution: tuple[int, int], is_float32: bool
) -> None:
    """Nets with collapsed edges, or with equal points only: indices are in range, normals have unit
    length, and no number is NaN."""
    check_values(build_mesh([net], resolution=resolution, is_float32=is_float32))


@pytest.mark.parametrize("offset", [1e5, 1e6, -3e7])
@pytest.mark.parametrize("example", ["utah-teapot", "sphere", "tveit"])
def test_large_coordinates_have_a_local_origin(example: str, offset: float) -> None:
    """Far from zero, the rounding of float32 positions is still small relative to the extent."""
    model = lower_patches(example)
    (batch,) = model.batches
    far_batch = TensorPatches(batch.points + offset, batch.weights)
    far_model = PatchModel("far", (far_batch,), model.parts)
    mesh, double_mesh = build_mesh(far_model, is_float32=True), build_mesh(far_model)
    assert np.abs(mesh.origin).min() > 0
    assert double_mesh.origin.tolist() == [0, 0, 0]
    extent = np.ptp(double_mesh.positions, axis=0).max()
    assert np.abs(mesh.positions).max() <= extent
    error = np.abs(mesh.positions.astype(float) + mesh.origin - double_mesh.positions)
    assert error.max() < 2e-7 * extent
    assert mesh.normals is not None
    assert double_mesh.normals is not None
    assert np.abs(mesh.normals - double_mesh.normals).max() < 1e-6
    check_sound(mesh)


def compute_digest(mesh: Mesh) -> str:
    """A hash of the main arrays and the report of a mesh."""
    arrays = [mesh.positions, mesh.normals, mesh.triangles, mesh.quads, mesh.uvs, mesh.welds]
    content = b"".join(b"-" if a is None else a.tobytes() for a in arrays)
    return hashlib.sha256(content + repr(mesh.report).encode()).hexdigest()


def test_the_same_request_gives_the_same_bytes() -> None:
    """Meshes that were built before have no effect."""
    digests = [
        compute_digest(build_mesh("cone", uvs=True)),
        compute_digest(build_mesh("utah-teapot", is_float32=True)),
    ]
    # A mesh of another shape in between changes the contents of caches and work arrays.
    build_mesh("torus", resolution=(33, 2))
    second_digests = [
        compute_digest(build_mesh("cone", uvs=True)),
        compute_digest(build_mesh("utah-teapot", is_float32=True)),
    ]
    assert digests == second_digests


def test_a_surface_with_uvs_stays_watertight() -> None:
    """A position on a seam has several vertices with different (u, v), which `welds` joins."""
    mesh = build_mesh("sphere", uvs=True, resolution=(5, 5))
    check_sound(mesh)
    assert len(mesh.positions) > find_topology(mesh).vertices
    assert find_topology(mesh).watertight


@pytest.mark.parametrize("name", ["control_net", "boundary"])
def test_overlays_are_lines_beside_the_faces(name: str) -> None:
    """The faces stay the same; segments are pairs of positions of the overlay."""
    mesh = build_mesh("tveit", overlays=(name,), resolution=(4, 4))
    (overlay,) = mesh.overlays
    assert overlay.name == name
    assert overlay.segments.max() < len(overlay.positions)
    assert (overlay.segments[:, 0] != overlay.segments[:, 1]).all()
    assert list_faces(mesh) == list_faces(build_mesh("tveit", resolution=(4, 4)))


def test_the_control_net_overlay_has_all_segments_and_cells_of_the_net() -> None:
    """16 points, 12 segments along v, 12 along u, and 9 cells (i,j) (i,j+1) (i+1,j+1) (i+1,j)."""
    net = lower_patches("tveit").batches[0].points[0]
    (overlay,) = build_mesh("tveit", overlays=("control_net",)).overlays
    np.testing.assert_array_equal(overlay.positions, net.reshape(-1, 3))
    edges = {frozenset(s) for s in overlay.segments.tolist()}
    assert edges == {frozenset((4 * i + j, 4 * i + j + 1)) for i in range(4) for j in range(3)} | {
        frozenset((4 * i + j, 4 * i + 4 + j)) for i in range(3) for j in range(4)
    }
    assert overlay.cells is not None
    assert overlay.cells.tolist() == [
        [4 * i + j, 4 * i + j + 1, 4 * i + j + 5, 4 * i + j + 4] for i in range(3) for j in range(3)
    ]


def test_the_boundary_overlay_runs_along_the_borders() -> None:
    """One patch with 5 × 3 divisions: 16 segments; all points are border samples of the mesh."""
    mesh = build_mesh("bourke-1111", overlays=("boundary",), resolution=(5, 3))
    (overlay,) = mesh.overlays
    assert len(overlay.segments) == 16
    grid = mesh.grids[0][0]
    border = np.concatenate([grid[0], grid[-1], grid[:, 0], grid[:, -1]])
    samples = {row.tobytes() for row in mesh.positions[border]}
    assert {row.tobytes() for row in overlay.positions[np.unique(overlay.segments)]} == samples
