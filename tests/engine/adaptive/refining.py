"""Triangulations of models in tests, and checks that hold for each of them."""

from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.drafts.draft import Triangulation
from service.engine.adaptive.refine import triangulate
from service.engine.bounds.faces import SPAN, Faces
from service.engine.bounds.goal import Goal
from service.engine.nets.patch_nets import PatchNets
from service.surface.lowered import PatchModel
from tests.engine.adaptive.bordering import build_border
from tests.strategies import Array

MOST = 200_000
"""Largest number of triangles, for tests that set no other limit."""


class Refined(NamedTuple):
    """The nets and faces of a model, the border of the faces, and their triangulation."""

    patch_nets: PatchNets
    faces: Faces
    border: Border
    triangulation: Triangulation

    def list_face_bytes(self, face: int) -> tuple[bytes, bytes]:
        """Places and positions of the triangles of one face, bit for bit, in their order."""
        built = self.triangulation
        corners = built.triangles[built.face[built.triangles[:, 0]] == face]
        places = np.stack([built.u[corners], built.v[corners]])
        return places.tobytes(), built.positions[built.vertex[corners]].tobytes()


def build_refined(
    model: PatchModel,
    goal: Goal,
    most: int = MOST,
    store: Callable[[Array], Array] = lambda positions: positions,
) -> Refined:
    """The triangulation of a model; `store` rounds positions as a format does."""
    result = build_border(model, goal, most)
    patch_nets = PatchNets.of(model)
    built = triangulate(patch_nets, result.faces, result.border, goal, store=store, most=most)
    return Refined(patch_nets, result.faces, result.border, built)


def check_refined(refined: Refined, tolerance: float) -> None:
    """Checks bounds, and the order of samples and of triangles; and, in whole numbers, that
    triangles cover faces exactly once."""
    _, faces, border, built = refined
    corners = built.triangles
    assert (built.bounds <= tolerance).all()
    assert (np.diff(built.face[corners[:, 0]]) >= 0).all()
    assert (built.face[corners] == built.face[corners[:, :1]]).all()
    places = sorted(zip(built.face.tolist(), built.u.tolist(), built.v.tolist(), strict=True))
    assert places == list(zip(built.face.tolist(), built.u.tolist(), built.v.tolist(), strict=True))
    assert len(set(places)) == len(places)
    u, v = built.u.astype(object), built.v.astype(object)
    a, b, c = corners.T
    twice_areas = (u[b] - u[a]) * (v[c] - v[a]) - (u[c] - u[a]) * (v[b] - v[a])
    assert (twice_areas > 0).all()
    # Triangles of which two corners are one vertex are left out. They occur beside a side that is
    # one point, and between two sides that are one edge: such faces are not covered completely.
    covered = np.bincount(built.face[a], twice_areas.astype(float), minlength=len(faces.first))
    twice_face_areas = 2.0 * faces.spans.prod(axis=0) * float(SPAN) ** 2
    assert (covered <= twice_face_areas * (1 + 1e-12)).all()
    simple = ~border.collapsed.any(axis=1) & ~_find_touching(border)
    for face in np.flatnonzero(simple):
        exact = sum(twice_areas[built.face[a] == face].tolist())
        assert exact == 2 * int(faces.spans[:, face].prod()) * SPAN**2
    check_edges(border, built)


def _find_touching(border: Border) -> np.ndarray:
    """Which faces (F,) have a vertex at two places of their sides."""
    result = []
    # The four corners of a face are entries of two sides each, so they are counted twice.
    for face in range(len(border.collapsed)):
        rows = [border.vertex[slice(*border.start[4 * face + s :][:2])] for s in range(4)]
        result.append(len(np.unique(np.concatenate(rows))) < sum(map(len, rows)) - 4)
    return np.array(result)


def check_edges(border: Border, triangulation: Triangulation) -> None:
    """Checks that an edge inside a face has two triangles, and one on the border one for each side.

    The samples on the sides are at all places of the border, and at no others.
    """
    vertices = triangulation.vertex[triangulation.triangles]
    used: Counter[tuple[int, int]] = Counter()
    for row in vertices.tolist():
        assert len(set(row)) == 3
        used.update((min(x, y), max(x, y)) for x, y in pairwise([*row, row[0]]))
    sides: Counter[tuple[int, int]] = Counter()
    for side in range(len(border.start) - 1):
        if not border.collapsed[side // 4, side % 4]:
            vertex = border.vertex[slice(*border.start[side : side + 2])].tolist()
            sides.update((min(x, y), max(x, y)) for x, y in pairwise(vertex))
    assert all(used[edge] == count for edge, count in sides.items())
    assert all(count == 2 for edge, count in used.items() if edge not in sides)
    for side in range(len(border.start) - 1):
        rows = slice(*border.start[side : side + 2])
        if not border.collapsed[side // 4, side % 4]:
            assert _find_places(triangulation, side) == set(border.at[rows].tolist())


def _find_places(triangulation: Triangulation, side: int) -> set[int]:
    """Places along a side at which there are samples."""
    is_in_face = triangulation.face == side // 4
    fixed, along = (
        (triangulation.u, triangulation.v) if side % 4 < 2 else (triangulation.v, triangulation.u)
    )
    limit = fixed[is_in_face].max() if side % 2 else 0
    return set(along[is_in_face & (fixed == limit)].tolist())
