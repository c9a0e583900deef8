"""Refined bounds of parts of the surface that are not proved to be near their own triangles.

Where parameters run wild, the surface over a triangle of places is near the mesh, but beside the
triangle that has those corners. Such a part is cut into four at the middles of its edges, and each
quarter is certified against the triangle of the part, or else against those beside it: any triangle
of the mesh will do (`service.engine.bounds.certificate`). The bound of the part is the largest of
its quarters.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.draft import Draft
from service.engine.bounds.certificate import certify
from service.engine.bounds.faces import SPAN
from service.engine.bounds.parts import Parts

CLOSE = 1.5
"""Bounds of parts that are tried are at most so many times what is allowed."""

QUARTERS = np.array(
    [
        [[2, 0, 0], [1, 1, 0], [1, 0, 1]],
        [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
        [[1, 0, 1], [0, 1, 1], [0, 0, 2]],
        [[1, 1, 0], [0, 1, 1], [1, 0, 1]],
    ]
)
"""Corners of the four quarters of a triangle: shares of its own, in halves."""


def refine_bounds(draft: Draft, rows: Ints) -> tuple[FloatArray, Bools]:
    """Bounds of parts (m,), the triangles of places of these rows, and whether they pass."""
    corners = draft.corners[rows]
    places = np.stack([draft.u[corners], draft.v[corners]], axis=2)
    # Parts in one patch, halved at whole places: nothing is lost between their quarters.
    inner = places.max(axis=1) <= (places.min(axis=1) // SPAN + 1) * SPAN
    even = QUARTERS.reshape(12, 3) @ places % 2 == 0
    cut = (inner.all(axis=1) & even.all(axis=(1, 2))).nonzero()[0]
    places = (QUARTERS @ places[cut, np.newaxis] // 2).reshape(-1, 3, 2)
    face, host = draft.face[corners[cut, 0]].repeat(4), draft.host[rows[cut]].repeat(4)
    bounds, passed = _certify_against(draft, face, places, host)
    # Quarters that fail, and the triangles beside their own.
    beside = draft.beside[host]
    quarter, side = (~passed[:, np.newaxis] & (beside >= 0)).nonzero()
    others, near = _certify_against(draft, face[quarter], places[quarter], beside[quarter, side])
    bounds[~passed] = np.inf
    np.minimum.at(bounds, quarter[near], others[near])
    found = np.full(len(rows), np.inf)
    found[cut] = bounds.reshape(-1, 4).max(axis=1)
    return found, found < np.inf


def _certify_against(
    draft: Draft, face: Ints, places: Ints, host: Ints
) -> tuple[FloatArray, Bools]:
    """Bounds of triangles of places (m, 3, 2), each against one of the mesh; which pass."""
    task = draft.task
    task.budget.spend(task.estimate_work(face, places))
    own = np.zeros(len(face), dtype=bool)
    parts = Parts(face, places, draft.vertices[host], draft.across[host], own)
    bounds = certify(task.patch_nets, task.faces, parts, draft.positions, task.goal)
    return bounds.deviation, bounds.deviation <= bounds.allowed
