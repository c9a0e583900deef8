"""Which points of patches lie on open sides: on edges that no other patch has.

The sides are those of the joined model, as in meshes and measures: sides that are equal up to
rounding are one edge, and so are a side and the pieces of other sides beside it.
"""

from itertools import product
from typing import Literal, TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.connectivity.incidence import triangular_patches
from service.engine.connectivity.seams import Seams
from service.engine.joining.join import join
from service.engine.points.surface_columns import in_domains
from service.engine.signs.signs import WELD_TOLERANCE
from service.surface.lowered import Domain, PatchModel
from service.surface.multipatch import surfaces_of

Beside: TypeAlias = Literal["left", "right"]
BESIDE: tuple[Beside, ...] = ("left", "right")

MAX_GAP = 1e-12
"""A point counts as on a side of its patch if its parameters are at most this far from the side."""


def find_open_sides(
    model: PatchModel,
    patch: Ints,
    local: FloatArray,
    joined: tuple[PatchModel, Seams] | None = None,
) -> Bools:
    """Whether points with the parameters `local` (m, 2) lie on an open side of their patch (m,).

    `joined` is the result of `join`, if it is known.
    """
    is_open = np.zeros(len(patch), bool)
    rows = np.flatnonzero(_find_sides(model, patch, local).any(axis=1))
    if not len(rows):
        return is_open
    patch, local = patch[rows], local[rows]
    joined_model, seams = joined or join(model, WELD_TOLERANCE)
    # A side is open if its edge has no other side.
    open_sides = (seams.sides_per_edge[seams.edge] == 1) & ~seams.collapsed
    if joined_model.patch_count == model.patch_count:
        is_open[rows] = (_find_sides(model, patch, local) & open_sides[patch]).any(axis=1)
        return is_open
    uv, surface = in_domains(surfaces_of(model), patch, local)
    surfaces = surfaces_of(joined_model)
    # A point on a line between two pieces is on both.
    for along_u, along_v in product(BESIDE, repeat=2):
        patch, local = _find_pieces(surfaces, surface, uv, (along_u, along_v))
        on_sides = _find_sides(joined_model, patch, local)
        is_open[rows] |= (on_sides & open_sides[patch]).any(axis=1)
    return is_open


def _find_sides(model: PatchModel, patch: Ints, local: FloatArray) -> Bools:
    """On which sides of their patches points lie, (m, 4)."""
    u, v = local.T
    gaps = np.stack([u, 1 - u, v, 1 - v], axis=1)
    # The sides 0, 1 and 2 of a triangle are s = 0, s + t = 1 and t = 0; it has no side 3.
    is_triangle = triangular_patches(model.batches)[patch]
    gaps[is_triangle, 1] = (1 - u - v)[is_triangle]
    gaps[is_triangle, 3] = 1.0
    return np.asarray(gaps <= MAX_GAP)


def _find_pieces(
    surfaces: tuple[Domain, ...], surface: Ints, uv: FloatArray, beside: tuple[Beside, Beside]
) -> tuple[Ints, FloatArray]:
    """The patches (m,), and the parameters in them (m, 2), of points of surfaces.

    `beside` says for u and for v which patch has a point between two: on its left or right.
    """
    patch, local = np.empty(len(surface), np.intp), np.empty(uv.shape)
    for number in np.unique(surface).tolist():
        domain, rows = surfaces[number], np.flatnonzero(surface == number)
        spans = []
        for axis, (knots, side) in enumerate(zip((domain.u, domain.v), beside, strict=True)):
            t = uv[rows, axis]
            span = np.searchsorted(knots, t, side=side) - 1
            span = np.clip(span, 0, len(knots) - 2)
            local[rows, axis] = (t - knots[span]) / (knots[span + 1] - knots[span])
            spans.append(span)
        patch[rows] = domain.first + spans[0] * (len(domain.v) - 1) + spans[1]
    return patch, local
