"""Places of meshes lead to the parameters at which the surface has the points of the mesh."""

import numpy as np
import pytest

from service.bases.arrays import Ints
from service.engine.bounds.goal import Goal
from service.engine.evaluation.normals import group_by_batch
from service.engine.mesh.mesh import Mesh
from service.engine.mesh.places import SurfacePlaces
from service.engine.meshers import build_mesher
from service.engine.options import MeshOptions
from service.engine.pictures.parts import PicturePart, list_parts
from service.engine.points.jets import evaluate_jets
from service.engine.scenes.placing import place_normals, place_points
from service.engine.stored_positions import Storage
from service.surface.batches import TrianglePatches
from service.surface.examples.catalogue import find
from tests.strategies import Array

EXAMPLES = ("utah-teapot", "octahedral-sphere", "bspline-ring", "nurbs-goblet", "tea-service",
            "pipe-tee", "crossed-holes", "plate-with-holes")  # fmt: skip


def build_parts(name: str) -> tuple[list[PicturePart], float, float]:
    """The parts of a picture of an example, its tolerance and its diagonal."""
    options = MeshOptions(places=True, curvatures=True)
    mesher = build_mesher(find(name).surface().lower(), options, Storage(), has_nodes=True)
    diagonal = mesher.model.diagonal
    return list(list_parts(mesher.build_mesh(Goal(1e-3 * diagonal), 100_000))), 1e-3, diagonal


def evaluate(places: SurfacePlaces, corners: Ints, weights: Array) -> Array:
    """Points of the surface at the parameters of points of triangles, before placing."""
    patch, u, v = places.locate(corners, weights)
    points = np.empty((len(patch), 3))
    for batch, first, rows in group_by_batch(places.model.batches, patch):
        s = u[rows] * (1 - v[rows]) if isinstance(batch, TrianglePatches) else u[rows]
        points[rows] = evaluate_jets(batch, patch[rows] - first, s, v[rows], 0).partials[0]
    return points


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_surface_at_a_place_is_near_the_point_of_its_triangle(name: str) -> None:
    parts, tolerance, diagonal = build_parts(name)
    rng = np.random.default_rng(1)
    for part in parts:
        mesh: Mesh = part.mesh
        corners = mesh.triangles[rng.integers(0, len(mesh.triangles), 300)].astype(np.intp)
        assert mesh.places is not None
        # At corners: the vertex itself. Between: near, as parameters are interpolated, too.
        for weights, limit in (
            (np.eye(3)[rng.integers(0, 3, 300)].T, 1e-6),
            (rng.dirichlet(np.ones(3), 300).T, 40 * tolerance),
        ):
            points = place_points(evaluate(mesh.places, corners, weights), part.matrix)
            on_triangles = sum(
                weights[k][:, None] * part.positions[corners[:, k]] for k in range(3)
            )
            assert np.linalg.norm(points - on_triangles, axis=1).max() <= limit * diagonal


@pytest.mark.parametrize("name", EXAMPLES)
def test_normals_at_corners_are_those_of_the_vertices(name: str) -> None:
    """Also of copies that are mirrored or scaled; faces may be reversed."""
    for part in build_parts(name)[0]:
        mesh = part.mesh
        assert mesh.normals is not None
        # A little inside: on a knot line the surface may have a crease.
        triangle = np.arange(len(mesh.triangles))
        weights = np.repeat([[1 - 2e-7], [1e-7], [1e-7]], len(triangle), axis=1)
        normals = part.find_normals(triangle, weights)
        expected = place_normals(mesh.normals[mesh.triangles[:, 0]], part.matrix)
        side = np.sign(np.einsum("md,md->m", normals, expected))[:, None]
        np.testing.assert_allclose(side * normals, expected, atol=1e-4)


@pytest.mark.parametrize("name", EXAMPLES)
def test_curvatures_at_corners_are_those_of_the_vertices(name: str) -> None:
    """The sign of the mean curvature is that for the normals of the vertices."""
    for part in build_parts(name)[0]:
        mesh = part.mesh
        triangle = np.arange(len(mesh.triangles))
        weights = np.repeat([[1 - 2e-9], [1e-9], [1e-9]], len(triangle), axis=1)
        for (_, rows), mean in zip(mesh.attributes[:2], (False, True), strict=True):
            found = part.find_curvatures(triangle, weights, mean=mean)
            expected = rows[mesh.triangles[:, 0]].ravel()
            known = np.isfinite(found) & np.isfinite(expected)
            assert known.mean() > 0.9
            scale = np.abs(expected[known]).max()
            close = np.abs(found - expected)[known] <= 1e-3 * (scale + np.abs(expected[known]))
            assert close.mean() > 0.9  # patches that meet may have different curvatures
