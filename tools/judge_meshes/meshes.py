"""Meshes of many kinds, made from those of the service: decimated, displaced, and with holes."""

from collections.abc import Callable, Mapping
from io import BytesIO
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracles.topology import weld_by_position
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.given_mesh import GivenMesh
from service.surface.sizes import SurfaceKind

Array: TypeAlias = NDArray[np.float64]
Rows: TypeAlias = NDArray[np.int64]
Random: TypeAlias = np.random.Generator

COLLAPSES = 0.3
"""The share of the vertices that the collapse of edges removes."""


def mesh_surface(surface: SurfaceKind, options: MeshOptions) -> GivenMesh:
    """The mesh of the service, in float64; triangles without area are left out."""
    content = np.load(BytesIO(bytes(render(surface, options, BY_NAME["npz"]))))
    return drop_points(content["vertices"].astype(np.float64), content["faces"].astype(np.int64))


def mesh_by_tolerance(surface: SurfaceKind, relative: float) -> GivenMesh:
    """The mesh of the service by tolerance."""
    accuracy = Accuracy(relative_tolerance=relative)
    return mesh_surface(surface, MeshOptions(accuracy=accuracy, normals=False))


def mesh_by_resolution(surface: SurfaceKind, divisions: int) -> GivenMesh:
    """The mesh of the service by resolution."""
    return mesh_surface(surface, MeshOptions(resolution=(divisions,) * 2, normals=False))


def drop_points(vertices: Array, faces: Rows) -> GivenMesh:
    """A mesh without the triangles that have a vertex twice."""
    distinct = (np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)
    return GivenMesh(np.array(vertices), np.array(faces[distinct]))


def get_size(mesh: GivenMesh) -> float:
    """The diagonal of the box."""
    return float(np.linalg.norm(np.ptp(mesh.positions, axis=0)))


def cluster(mesh: GivenMesh, rng: Random) -> GivenMesh:
    """Vertices in one cell of a lattice become one, at their mean (Rossignac and Borrel, 1993)."""
    cell = get_size(mesh) * 10 ** rng.uniform(-1.6, -0.7)
    keys = np.floor(mesh.positions / cell).astype(np.int64)
    _, row, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    row = row.ravel()
    means = (
        np.stack([np.bincount(row, x) for x in mesh.positions.T], axis=1) / counts[:, np.newaxis]
    )
    return drop_points(means, row[mesh.triangles])


def collapse(mesh: GivenMesh, rng: Random) -> GivenMesh:
    """Edges become points, one after the other, at one of their ends: the shortest of a few."""
    faces = weld_by_position(mesh.positions, mesh.triangles).astype(np.int64)
    target = np.arange(len(mesh.positions))
    for _ in range(int(COLLAPSES * len(mesh.positions))):
        if len(faces) < 8:
            break
        some = faces[rng.integers(0, len(faces), 12)]
        lengths = np.linalg.norm(mesh.positions[some[:, 0]] - mesh.positions[some[:, 1]], axis=1)
        a, b = some[lengths.argmin(), :2].tolist()
        target[b] = a
        faces = np.where(faces == b, a, faces)
        faces = faces[(np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)]
    return drop_points(mesh.positions, faces) if len(faces) else mesh


def add_noise(mesh: GivenMesh, rng: Random) -> GivenMesh:
    """Each vertex moved by a random vector."""
    reach = get_size(mesh) * 10 ** rng.uniform(-5, -2)
    noise = reach * rng.uniform(-1, 1, mesh.positions.shape)
    return GivenMesh(mesh.positions + noise, np.array(mesh.triangles))


def move_vertex(mesh: GivenMesh, rng: Random) -> GivenMesh:
    """One vertex moved far."""
    positions = np.array(mesh.positions)
    row = rng.choice(np.unique(mesh.triangles))
    positions[row] += get_size(mesh) * 10 ** rng.uniform(-2.5, -0.3) * draw_direction(rng)
    return GivenMesh(positions, np.array(mesh.triangles))


def draw_direction(rng: Random) -> Array:
    """A random unit vector."""
    vector = rng.normal(size=3)
    unit: Array = vector / np.linalg.norm(vector)
    return unit


def scale(mesh: GivenMesh, rng: Random) -> GivenMesh:
    """The mesh larger or smaller, about its middle."""
    middle = mesh.positions.mean(axis=0)
    factor = 1 + rng.choice([-1, 1]) * 10 ** rng.uniform(-5, -0.5)
    return GivenMesh(middle + factor * (mesh.positions - middle), np.array(mesh.triangles))


def translate(mesh: GivenMesh, rng: Random) -> GivenMesh:
    """The mesh moved, up to ten diagonals."""
    move = get_size(mesh) * 10 ** rng.uniform(-5, 1) * draw_direction(rng)
    return GivenMesh(mesh.positions + move, np.array(mesh.triangles))


def cut_holes(mesh: GivenMesh, rng: Random) -> GivenMesh:
    """The mesh without a part of its triangles."""
    kept = rng.random(len(mesh.triangles)) > rng.choice([0.02, 0.5])
    kept[rng.integers(len(kept))] = True
    return GivenMesh(np.array(mesh.positions), np.array(mesh.triangles[kept]))


def scatter(mesh: GivenMesh, rng: Random) -> GivenMesh:
    """Triangles without common vertices, in another order."""
    order = rng.permutation(len(mesh.triangles))
    positions = mesh.positions[mesh.triangles[order]].reshape(-1, 3)
    return GivenMesh(positions, np.arange(len(positions)).reshape(-1, 3))


CHANGES: Mapping[str, Callable[[GivenMesh, Random], GivenMesh]] = MappingProxyType(
    {
        "clustered": cluster,
        "collapsed": collapse,
        "noisy": add_noise,
        "one vertex moved": move_vertex,
        "scaled": scale,
        "translated": translate,
        "with holes": cut_holes,
        "scattered": scatter,
    }
)
"""Changes of a mesh by name."""
