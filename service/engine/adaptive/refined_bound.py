"""Refined bounds of parts of the surface that are not proved to be near their own triangles.

Where the parametrisation is very uneven, the surface over a triangle of places may be near the mesh
but beside the triangle with those corners. Such a part is cut into four at the middles of its
edges. Each quarter is certified against the triangle of the part, or else against those beside it:
any triangle of the mesh will do (`service.engine.bounds.certificate`). The bound of the part is the
largest bound of its quarters.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.drafts.draft import Draft
from service.engine.bounds.certificate import certify
from service.engine.bounds.faces import SPAN
from service.engine.bounds.parts import Parts

CLOSE = 1.5
"""A part is tried if its bound is at most this factor above the allowed deviation."""

FEW = 64
"""Quarters up to which all four triangles are tried at once: a step takes as long for one part as
for a hundred."""

QUARTERS = np.array(
    [
        [[2, 0, 0], [1, 1, 0], [1, 0, 1]],
        [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
        [[1, 0, 1], [0, 1, 1], [0, 0, 2]],
        [[1, 1, 0], [0, 1, 1], [1, 0, 1]],
    ]
)
"""Corners of the four quarters of a triangle, in halves of barycentric coordinates."""


def refine_bounds(draft: Draft, rows: Ints) -> tuple[FloatArray, Bools]:
    """Bounds (m,) of the parts over these triangles, and whether they meet the goal."""
    triangles, samples = draft.triangles, draft.samples
    corners = triangles.corners[rows]
    places = np.stack([samples.u[corners], samples.v[corners]], axis=2)
    # Parts in one patch, halved at whole places: then their quarters cover them exactly.
    inner = places.max(axis=1) <= (places.min(axis=1) // SPAN + 1) * SPAN
    even = QUARTERS.reshape(12, 3) @ places % 2 == 0
    cut = (inner.all(axis=1) & even.all(axis=(1, 2))).nonzero()[0]
    places = (QUARTERS @ places[cut, np.newaxis] // 2).reshape(-1, 3, 2)
    face = samples.face[corners[cut, 0]].repeat(4)
    host = triangles.host[rows[cut]].repeat(4)
    # The triangle itself, and those beside it, against which only quarters that fail are measured.
    hosts = np.column_stack([host, triangles.beside[host]])
    quarters = np.full(hosts.shape, np.inf)
    for columns in [slice(0, 4)] if len(host) <= FEW else [slice(0, 1), slice(1, 4)]:
        is_open = (quarters[:, :1] == np.inf) & (hosts[:, columns] >= 0)
        row, column = is_open.nonzero()
        column += columns.start
        if len(row):
            quarters[row, column] = _certify_against(
                draft, face[row], places[row], hosts[row, column]
            )
    own, others = quarters[:, 0], quarters[:, 1:].min(axis=1)
    bounds = np.full(len(rows), np.inf)
    bounds[cut] = np.where(own < np.inf, own, others).reshape(-1, 4).max(axis=1)
    return bounds, bounds < np.inf


def _certify_against(draft: Draft, face: Ints, places: Ints, host: Ints) -> FloatArray:
    """Bounds of triangles of places (m, 3, 2), each against one of the mesh; inf: it fails."""
    task, triangles = draft.task, draft.triangles
    task.limits.spend(task.estimate_work(face, places))
    is_own = np.zeros(len(face), dtype=bool)
    parts = Parts(face, places, triangles.vertices[host], triangles.across[host], is_own)
    bounds = certify(task.patch_nets, task.faces, parts, draft.samples.positions, task.goal)
    return np.where(bounds.deviation <= bounds.allowed, bounds.deviation, np.inf)
