"""Volumes and centroids of closed surfaces as intervals.

    V = ⅓ Σ ∫∫ (S − o) · N        c = o + ¼ Σ ∫∫ (S − o) ((S − o) · N) / V        N = S_u × S_v

over all patches. The formulas are true for any origin o; with the middle of the box about the
control points as origin the numbers are small. V is positive if normals point outwards. The
intervals include the errors of lowering, placing and joining, and every other closing of the gaps
that joining closed.

Proof in docs/proofs.md: "Volumes by Gauss's theorem".
"""

from typing import TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.engine.measures.cells import UPWARDS
from service.engine.measures.integrals import estimate
from service.engine.measures.joined_surface import JoinedSurface
from service.engine.measures.patch_cells import bound_growth, group_cells
from service.engine.measures.precision import REMAINDER_SHARE, integrate
from service.engine.measures.values import Interval, MeasureQuery
from service.engine.nets.query_nets import surface_nets

Solid: TypeAlias = tuple[Interval | None, tuple[Interval, ...] | None]
"""Volume and centroid; (None, None) for an open surface."""


def measure_solids(
    joined: JoinedSurface,
    is_whole_closed: bool,
    closed_parts: Bools,
    areas: tuple[list[Interval], float],
    query: MeasureQuery,
) -> list[Solid]:
    """The volume and centroid of the whole surface, and then of each part.

    They are None for an open surface or part. `areas` are the areas of the surface and of each
    part, and their unit of length in model units.
    """
    is_closed = np.concatenate([[is_whole_closed], closed_parts])
    if not is_closed.any():
        return [(None, None)] * len(is_closed)
    nets = surface_nets(joined.model.batches)
    # If only some parts are closed, only their patches are integrated.
    patches = None if is_whole_closed else closed_parts[joined.part]
    groups = group_cells(nets, joined.point_error + 2 * joined.moved, patches)
    # The flux is Σ ∫∫ (S − o) · N = 3 V, and the moment Σ ∫∫ (S − o) ((S − o) · N) = 4 ∫ x − o dV.
    (flux, *_), rounding = estimate(groups, "flux")
    diagonal = nets.diagonal / nets.scale
    # The remainders may be at most the tolerance times these scales. Then the error of V is at most
    # REMAINDER_SHARE · tolerance · V. The error of the centroid is at most
    # (3/16 + REMAINDER_SHARE / 2) · tolerance · diagonal, if the centroid is at most half a
    # diagonal from the origin.
    scales = abs(flux) * np.array([REMAINDER_SHARE, diagonal / 4])
    integrals = integrate(groups, "flux", scales, rounding, query)
    # Column 0 is the whole surface, column k + 1 part k. Row 0 is the flux, the rest the moment.
    sums, errors = integrals.over_parts(joined.part, len(closed_parts))
    # All cells have the same error.
    point_error, growth = float(groups[0].point_error[0]), bound_growth(groups)
    sizes, scale = areas
    # The largest areas while control points move, in units of the nets.
    largest = np.array([size.high for size in sizes]) * (scale / nets.scale) ** 2 + growth
    # What moved points change at most; |x − o| is at most the diagonal.
    errors[0] += 3 * point_error * largest
    errors[1] += 4 * point_error * largest * (diagonal + point_error)
    return [
        find_solid(sums[:, k], errors[:, k] * UPWARDS, nets.origin, nets.scale)
        if has_volume
        else (None, None)
        for k, has_volume in enumerate(is_closed.tolist())
    ]


def find_solid(sums: FloatArray, errors: FloatArray, origin: FloatArray, scale: float) -> Solid:
    """Volume and centroid from the flux and the moment about the origin of nets, (4,).

    `errors` (2,) are those of the flux and of the moment. Coordinates of the model are origin +
    scale · (coordinates of the nets); the scale is a power of two.
    """
    flux, *moment = sums.tolist()
    error, moment_error = errors.tolist()
    volume = Interval.about(flux / 3, error / 3, scale**3)
    min_flux = abs(flux) - error
    if min_flux <= 0:
        return volume, None
    centroid = []
    for value, start in zip(moment, origin.tolist(), strict=True):
        # One coordinate of the centroid, in the coordinates of the nets.
        local = 0.75 * value / flux
        # For the exact flux F and moment G, and the computed f and g:
        # |G / F − g / f| ≤ (|G − g| + |g / f| |F − f|) / |F|
        error_of_local = (0.75 * moment_error + abs(local) * error) / min_flux * UPWARDS
        error_of_local += 2.0**-50 * abs(local)  # the rounding of `local` itself
        coordinate = start + local * scale
        # 2^-52 is for the rounding of this sum. The product is exact: the scale is a power of two.
        error_of_coordinate = error_of_local * scale + 2.0**-52 * abs(coordinate)
        centroid.append(Interval.about(coordinate, error_of_coordinate))
    return volume, tuple(centroid)
