"""Columns of responses for points on patches, which queries find: parameters, patches, normals."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from service.bases.arrays import AnyArray, FloatArray, Ints
from service.engine.connectivity.incidence import triangular_patches
from service.engine.evaluation.normals import evaluate_scattered_normals
from service.engine.vectors import cross, dot, length
from service.surface.lowered import Domain, PatchModel

Columns: TypeAlias = dict[str, AnyArray]

MIN_SINE = 1e-4
"""The normal is computed as a limit if the sine of the angle between S_u and S_v is at most
MIN_SINE, or if |S_u × S_v|, in coordinates of the nets, is at most MIN_SINE²."""


def surface_columns(
    model: PatchModel, patch: Ints, local: FloatArray, du: FloatArray, dv: FloatArray
) -> Columns:
    """The arrays `uv`, `patch` and `normals` of a response, for points on patches of a model.

    `local` (m, 2) are the parameters of the points in their patches, (s, t) on triangles; `du` and
    `dv` (3, m) are partials there. Normals that these do not give precisely are limits.
    """
    columns: Columns = {}
    if model.domains:
        columns["uv"], number = in_domains(model.domains, patch, local)
        if len(model.domains) > 1:
            columns["patch"] = number
    else:
        columns |= {
            "patch": patch if model.request_numbers is None else model.request_numbers[patch],
            "uv": local,
        }
    u, v = local.T
    # `evaluate_scattered_normals` takes triangles as patches with s = u (1 − v) and t = v.
    if triangular_patches(model.batches).any():
        is_triangle = triangular_patches(model.batches)[patch]
        width_of_row = np.where(is_triangle & (v < 1), 1 - v, 1.0)
        u = np.minimum(u / width_of_row, 1.0)
    with np.errstate(all="ignore"):
        products = cross(du, dv)
        lengths = length(products)
        normals = np.ascontiguousarray((products / lengths).T)
        is_precise = lengths > MIN_SINE * np.sqrt(dot(du, du) * dot(dv, dv))
        is_precise &= lengths > MIN_SINE**2
    if len(rows := np.flatnonzero(~is_precise)):
        normals[rows], _ = evaluate_scattered_normals(model.batches, patch[rows], u[rows], v[rows])
    return columns | {"normals": normals}


def in_domains(
    domains: Sequence[Domain], patch: Ints, local: FloatArray
) -> tuple[FloatArray, Ints]:
    """Convert parameters (m, 2) of patches to those of parametric surfaces with these domains.

    Returns the parameters (m, 2), and the numbers (m,) of the surfaces.
    """
    first_patches = np.array([domain.first for domain in domains])
    order = np.argsort(first_patches)
    surface_numbers = order[np.searchsorted(first_patches[order], patch, side="right") - 1]
    uv = np.empty(local.shape)
    for k in np.unique(surface_numbers).tolist():
        domain, rows = domains[k], np.flatnonzero(surface_numbers == k)
        # The patches of a domain are numbered span by span, with v first.
        spans = np.divmod(patch[rows] - domain.first, len(domain.v) - 1)
        for axis, (knots, span) in enumerate(zip((domain.u, domain.v), spans, strict=True)):
            t, low, high = local[rows, axis], knots[span], knots[span + 1]
            uv[rows, axis] = np.where(t == 1, high, low + t * (high - low))
    return uv, surface_numbers
