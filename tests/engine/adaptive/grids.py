"""Triangulations for tests: every span is a regular grid; equal positions are one vertex."""

from dataclasses import dataclass

import numpy as np

from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.drafts.draft import Triangulation
from service.engine.bounds.faces import SPAN, Faces, find_faces
from service.engine.connectivity.seams import find_seams
from service.engine.nets.patch_nets import PatchNets
from service.surface.lowered import PatchModel

SAME = 1e-9
"""Positions nearer than this, relative to the largest coordinate, become one vertex."""


@dataclass(frozen=True)
class Regular:
    """The faces of a model, their sides, and triangles with made-up bounds 1/8, 2/8, 3/8, …"""

    faces: Faces
    border: Border
    triangulation: Triangulation


def build_regular(model: PatchModel, divisions: int = 2, *, per_face: bool = False) -> Regular:
    """Divides each span of each face into divisions × divisions cells of two triangles.

    With `per_face`, each face, not each span, has this number of cells, which may cross knot lines.
    """
    faces = find_faces(model, find_seams(model.batches))
    patch_nets = PatchNets.of(model)
    places, triangles, owners, sides = [], [], [], []
    count = 0
    for owner, (n_u, n_v) in enumerate(faces.spans.T.tolist()):
        rows, columns = (divisions, divisions) if per_face else (n_u * divisions, n_v * divisions)
        at_u = np.arange(rows + 1) * (n_u * SPAN) // rows
        at_v = np.arange(columns + 1) * (n_v * SPAN) // columns
        number = count + np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
        places.append(np.stack(np.meshgrid(at_u, at_v, indexing="ij"), axis=-1).reshape(-1, 2))
        a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
        triangles.append(np.stack([a, b, d], axis=-1).reshape(-1, 3))
        triangles.append(np.stack([b, c, d], axis=-1).reshape(-1, 3))
        owners.append(np.full(number.size, owner))
        sides += [
            (number[0], at_v),
            (number[-1], at_v),
            (number[:, 0], at_u),
            (number[:, -1], at_u),
        ]
        count += number.size
    at, face = np.concatenate(places), np.concatenate(owners)
    points = evaluate_points(patch_nets, faces, face, at)
    size = max(float(np.abs(points).max()), 1.0)
    keys = np.round(points / (SAME * size)).astype(np.int64)
    _, first, vertex = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    vertex = vertex.ravel()
    lines = [vertex[number] for number, _ in sides]  # the vertices of each side
    starts = np.cumsum([0, *(len(line) for line in lines)])
    collapsed = np.array([bool((line == line[0]).all()) for line in lines]).reshape(-1, 4)
    entries = np.concatenate([at for _, at in sides]), np.concatenate(lines)
    border = Border.of(faces, starts, entries, points[first], collapsed)
    corners = np.concatenate(triangles)
    # At poles, triangles of which two corners are one vertex are left out.
    vertices = vertex[corners]
    kept = corners[(vertices != np.roll(vertices, 1, axis=1)).all(axis=1)]
    bounds = (1 + np.arange(len(kept))) / 8
    built = Triangulation(
        face=face,
        u=at[:, 0],
        v=at[:, 1],
        vertex=vertex,
        positions=points[first],
        triangles=kept,
        bounds=bounds,
        mesh_bounds=None,
    )
    return Regular(faces, border, built)


def evaluate_points(
    patch_nets: PatchNets, faces: Faces, face: np.ndarray, at: np.ndarray
) -> np.ndarray:
    """Points (N, 3) at places (N, 2) of faces (N,)."""
    span = np.minimum(at // SPAN, faces.spans.T[face] - 1)
    u, v = ((at - span * SPAN) / SPAN).T
    patch = faces.first[face] + span[:, 0] * faces.stride[face] + span[:, 1]
    return patch_nets.evaluate_points(patch, u, v)
