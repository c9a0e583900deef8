"""Makes meshes for tests, and checks properties that every mesh has."""

from typing import Any

import numpy as np

from oracles.topology import Topology, count_topology, winding_agreement
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.surface.examples.catalogue import find
from service.surface.lowered import Model
from tests.strategies import Array, build_model
from tools.building import build


def build_mesh(
    source: str | Model | list[Array], *, is_float32: bool = False, **options: Any
) -> Mesh:
    """The mesh of an example, a model, or a list of control nets (p+1, q+1, 3) of patches."""
    if isinstance(source, str):
        source = find(source).surface().lower()
    elif isinstance(source, list):
        source = build_model(source)
    return build(source, MeshOptions(**options), is_float32=is_float32)


def list_faces(mesh: Mesh) -> list[list[int]]:
    """Triangles, then quads, as lists of vertex numbers."""
    faces: list[list[int]] = mesh.triangles.tolist() + mesh.quads.tolist()
    return faces


def find_first_vertices(mesh: Mesh) -> np.ndarray:
    """For each vertex, the first vertex at its position; without `welds`, the vertex itself."""
    return np.arange(len(mesh.positions)) if mesh.welds is None else mesh.welds


def find_topology(mesh: Mesh) -> Topology:
    """The topology of the surface; vertices with one entry in `welds` count as one vertex."""
    first_vertex = find_first_vertices(mesh).tolist()
    return count_topology([[first_vertex[i] for i in face] for face in list_faces(mesh)])


def to_triangles(mesh: Mesh) -> np.ndarray:
    """All faces as triangles; quads are split from their second to their fourth corner."""
    quads = mesh.quads
    return np.concatenate([mesh.triangles, quads[:, (0, 1, 3)], quads[:, (1, 2, 3)]])


def check_sound(mesh: Mesh) -> None:
    """Checks values, faces and report of a mesh; no face may have two vertices at one position."""
    check_values(mesh)
    shape = find_topology(mesh)
    assert shape.degenerate == 0
    _check_report(mesh, shape)


def check_values(mesh: Mesh) -> None:
    """Checks what is true of every mesh: shapes, dtypes, unit normals, welds and parts."""
    count = len(mesh.positions)
    assert mesh.positions.shape == (count, 3)
    assert np.isfinite(mesh.positions).all()
    for faces, corners in ((mesh.triangles, 3), (mesh.quads, 4)):
        assert faces.dtype == np.uint32
        assert faces.shape[1:] == (corners,)
        assert faces.max(initial=0) < count
    if mesh.report.triangles + mesh.report.quads and mesh.welds is not None:
        # If no face uses a vertex, no face uses any vertex at its position.
        used = np.union1d(mesh.triangles, mesh.quads)
        unused = np.setdiff1d(np.arange(count), used)
        assert not np.isin(mesh.welds[unused], mesh.welds[used]).any()
    _check_attributes(mesh, count)
    _check_welds(mesh)
    _check_parts(mesh)


def _check_attributes(mesh: Mesh, count: int) -> None:
    """Checks the shapes of normals and texture coordinates, and that normals are unit vectors."""
    if mesh.normals is not None:
        assert mesh.normals.shape == (count, 3)
        assert mesh.normals.dtype == mesh.positions.dtype
        lengths = np.linalg.norm(mesh.normals.astype(float), axis=1)
        assert np.abs(lengths - 1).max(initial=0) < 4 * np.finfo(mesh.normals.dtype).eps
    if mesh.uvs is not None:
        assert mesh.uvs.shape == (count, 2)
        assert np.isfinite(mesh.uvs).all()


def _check_welds(mesh: Mesh) -> None:
    """Checks that `welds` names the first vertex at each position, which has equal bits."""
    if mesh.welds is None:
        return
    assert mesh.welds.shape == (len(mesh.positions),)
    np.testing.assert_array_equal(mesh.welds[mesh.welds], mesh.welds)
    assert (mesh.welds <= np.arange(len(mesh.welds))).all()
    # Positions are compared bit for bit, so that a welded model has no cracks in any viewer.
    assert mesh.positions[mesh.welds].tobytes() == mesh.positions.tobytes()


def _check_parts(mesh: Mesh) -> None:
    """Checks that the parts are consecutive runs of all faces."""
    for which, faces in (("triangles", mesh.triangles), ("quads", mesh.quads)):
        runs = [getattr(part, which) for part in mesh.parts]
        ends = [0, *(last for _, last in runs)]
        assert [first for first, _ in runs] == ends[:-1]
        assert ends[-1] == len(faces)


def _check_report(mesh: Mesh, shape: Topology) -> None:
    """Checks that the report has the counts and the bounds of the mesh."""
    report = mesh.report
    positions = len(mesh.positions) if mesh.welds is None else len(np.unique(mesh.welds))
    assert report.vertices == positions
    assert (report.triangles, report.quads) == (len(mesh.triangles), len(mesh.quads))
    assert report.boundary_edges == shape.boundary
    assert report.watertight == (shape.boundary == 0 == shape.non_manifold)
    stored = mesh.positions.astype(float) + mesh.origin
    np.testing.assert_array_equal(report.bounds_min, stored.min(axis=0))
    np.testing.assert_array_equal(report.bounds_max, stored.max(axis=0))


def check_upright(mesh: Mesh) -> None:
    """Checks that each face of a graph over the plane z = 0 faces the same way as its normals.

    A face is counter-clockwise seen from above if the normals of its corners point up, else seen
    from below.
    """
    assert mesh.normals is not None
    faces = to_triangles(mesh)
    a, b, c = (mesh.positions[faces[:, k]] for k in range(3))
    up = np.sign(np.cross(b - a, c - a)[:, 2])
    np.testing.assert_array_equal(np.sign(mesh.normals[faces, 2]), np.stack([up] * 3, axis=1))


def check_winding(mesh: Mesh) -> None:
    """Checks that every face is counter-clockwise about the mean of the normals of its corners.

    Use it for fine meshes only: a coarse mesh may fail, although nothing is wrong with it.
    """
    assert mesh.normals is not None
    assert winding_agreement(mesh.positions, mesh.normals, to_triangles(mesh)).min() > 0
