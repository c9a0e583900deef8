"""Divided faces for tests of the certificate, and sampled distances of their parts from
triangles."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from oracles.distance import measure_distances
from service.engine.bounds.certificate import PartBounds, certify
from service.engine.bounds.clip import Parts
from service.engine.bounds.faces import SPAN, Faces
from service.engine.bounds.goal import Goal
from service.engine.nets.patch_nets import PatchNets

Array = NDArray[np.float64]
Index = NDArray[np.intp]
GOAL = Goal(1.0)


def divide_face(u: Index, v: Index) -> tuple[Index, Index, Index]:
    """A face divided at places: places (V, 2), triangles (T, 3), vertices across edges (T, 3)."""
    a, b = np.meshgrid(u, v, indexing="ij")
    number = np.arange(a.size).reshape(a.shape)
    one, two = number[:-1, :-1].ravel(), number[1:, :-1].ravel()
    three, four = number[:-1, 1:].ravel(), number[1:, 1:].ravel()
    corners = np.concatenate(
        [np.stack([one, two, three], axis=1), np.stack([two, four, three], axis=1)]
    )
    return np.stack([a.ravel(), b.ravel()], axis=1), corners, find_across(corners)


def find_across(corners: Index) -> Index:
    """The vertex opposite each edge, of the other triangle that has it; -1 if there is none."""
    opposite = {(t[k], t[(k + 1) % 3]): t[(k + 2) % 3] for t in corners.tolist() for k in range(3)}
    rows = [[opposite.get((t[(k + 1) % 3], t[k]), -1) for k in range(3)] for t in corners.tolist()]
    return np.array(rows, dtype=np.intp)


def evaluate_places(patch_nets: PatchNets, faces: Faces, places: Index | Array) -> Array:
    """Points of face 0 at places (V, 2), which need not be whole numbers."""
    span = np.minimum((places // SPAN).astype(np.intp), faces.spans[:, 0] - 1)
    patch = faces.first[0] + span[:, 0] * faces.stride[0] + span[:, 1]
    t = (places - span * SPAN) / SPAN
    return patch_nets.evaluate_points(patch, t[:, 0], t[:, 1])


def build_parts(places: Index, corners: Index, across: Index) -> Parts:
    """Parts of face 0, one for each triangle, which is the reference triangle of its part."""
    face = np.zeros(len(corners), dtype=np.intp)
    is_own = np.ones(len(corners), dtype=bool)
    return Parts(face, places[corners].transpose(1, 2, 0), corners.T, across.T, is_own)


def measure_deviations(
    patch_nets: PatchNets, faces: Faces, parts: Parts, positions: Array, divisions: int = 12
) -> Array:
    """The largest distances (m,) from samples of parts to the nearest triangle.

    The triangles are the reference triangle of the part and its neighbours.
    """
    weights, points = sample_parts(patch_nets, faces, parts, divisions)
    count = len(weights)
    result = measure_distances(points, np.repeat(positions[parts.reference.T], count, axis=0))
    for k in range(3):
        edge, across = parts.reference[[k, (k + 1) % 3]].T, parts.across[k]
        # Where there is no neighbour, the edge itself is measured instead.
        neighbour = np.column_stack([edge, np.where(across >= 0, across, edge[:, 0])])
        result = np.minimum(
            result, measure_distances(points, np.repeat(positions[neighbour], count, axis=0))
        )
    furthest: Array = result.reshape(-1, count).max(axis=1)
    return furthest


def sample_parts(
    patch_nets: PatchNets, faces: Faces, parts: Parts, divisions: int
) -> tuple[Array, Array]:
    """Barycentric samples (n, 3), and the points of the surface there, part by part (m n, 3)."""
    weights = np.array(
        [(divisions - i - j, i, j) for i in range(divisions + 1) for j in range(divisions + 1 - i)]
    )
    places = weights @ parts.corners.transpose(2, 0, 1).astype(np.float64) / divisions
    return weights / divisions, evaluate_places(patch_nets, faces, places.reshape(-1, 2))


def measure_reference_distances(
    patch_nets: PatchNets, faces: Faces, parts: Parts, positions: Array, divisions: int = 12
) -> Array:
    """The largest distances (m,) of samples of parts from the points of the reference triangles
    that have the same barycentric coordinates."""
    weights, points = sample_parts(patch_nets, faces, parts, divisions)
    gap = points.reshape(-1, len(weights), 3) - weights @ positions[parts.reference.T]
    furthest: Array = np.linalg.norm(gap, axis=2).max(axis=1)
    return furthest


def build_face(rows: int = 1, columns: int = 1) -> Faces:
    """One face of rows × columns patches, which are all patches of the model."""
    return Faces(np.array([0]), np.array([columns]), np.array([[rows], [columns]]))


def check_bounds(
    patch_nets: PatchNets, faces: Faces, parts: Parts, positions: Array, goal: Goal = GOAL
) -> tuple[PartBounds, Array]:
    """The bounds, after checking that no sample exceeds them, and the sampled distances."""
    bounds = certify(patch_nets, faces, parts, positions, goal)
    result = measure_deviations(patch_nets, faces, parts, positions)
    assert (result <= bounds.deviation).all(), (result - bounds.deviation).max()
    return bounds, result


def divide_evenly(count: int, spans: int = 1) -> Index:
    """Places along a face that divide it equally."""
    return np.array([k * spans * SPAN // count for k in range(count + 1)])


def draw_places(rng: np.random.Generator, count: int, spans: int = 1) -> Index:
    """Random places along a face that divide it unevenly."""
    inner = np.sort(rng.choice(np.arange(1, 1000), count - 1, replace=False))
    places = np.concatenate([[0], inner * (spans * SPAN // 1000), [spans * SPAN]])
    assert all(a < b for a, b in pairwise(places.tolist()))
    return places


def drop_neighbours(parts: Parts) -> Parts:
    return replace(parts, across=np.full_like(parts.across, -1))
