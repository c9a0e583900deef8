"""Converts the parameters of a query to patches and their local parameters."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.connectivity.incidence import triangular_patches
from service.errors import MAX_ISSUES, InvalidRequest, Issue, format_number, pointer
from service.surface.lowered import PatchModel

END_ROUNDING = 2.0**-49
"""A parameter outside of a domain by at most this part of the domain's larger end, 8 units in the
last place, is the end of the domain: `k * step` may exceed it by a rounding."""

SAME_SUM = 1e-9
"""The largest difference of the sum of three barycentric coordinates from 1; it allows for rounding
by clients."""


@dataclass(frozen=True, eq=False, slots=True)
class ParameterPoints:
    """m places, each on a patch of the model.

    Attributes
    ----------
    patch : ndarray of int, shape (m,)
        Numbers of patches, counted over all batches.
    local : ndarray of float64, shape (m, 2)
        Parameters (u, v) of the patch, in [0, 1]; (s, t) on a triangle.
    widths : ndarray of float64, shape (m, 2)
        The widths of the patch along u and v, in parameters of the surface.
    """

    patch: Ints
    local: FloatArray
    widths: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class PointsQuery:
    """The parameters at which a surface is evaluated, and the order of derivatives.

    Attributes
    ----------
    places : ndarray of float64, shape (m, 2) or (m, 3)
        Parameters (u, v) of the surface or, if it has no domain, of patches; or barycentric
        coordinates (r, s, t) on triangles.
    patch : ndarray of int, shape () or (m,), or None
        Numbers in the request: of surfaces or, in a model without domains, of patches. Not needed
        for a single one.
    order : 0, 1 or 2
        The order of the derivatives.
    """

    places: FloatArray
    patch: Ints | None
    order: int

    @property
    def field(self) -> str:
        """The name of the request's field that has the parameters."""
        return "uv" if self.places.shape[1] == 2 else "barycentric"


def locate(model: PatchModel, query: PointsQuery) -> ParameterPoints:
    """Find the patch and the local parameters of each place of a query.

    A knot belongs to the patch that begins there, and the end of the domain to the last patch, with
    parameters that exceed it by a few roundings. Barycentric coordinates are divided by their sum.
    A surface that has one domain has no patch numbers.

    Raises
    ------
    InvalidRequest
        `unexpected_patch`, `outside_domain`, or an error of the patch numbers, with a pointer into
        the request.
    """
    if model.domain is not None and query.patch is not None:
        raise InvalidRequest(
            Issue(
                "unexpected_patch",
                "The parameters of the surface already determine the patch.",
                "/patch",
                "patch numbers",
                "none for this kind of surface",
            )
        )
    request_numbers = find_patch_numbers(len(model.domains) or model.patch_count, query)
    patch = _find_first_patches(model)[request_numbers]
    check_coordinates(triangular_patches(model.batches)[patch], query)
    if query.field == "barycentric":
        local = normalize_sums(query.places)[:, 1:]
        return ParameterPoints(patch, local, np.ones(local.shape))
    if not model.domains:
        local = round_to_ends(query.places, np.zeros(2), np.ones(2))
        check_inside(local, np.zeros(2), np.ones(2))
        return ParameterPoints(patch, local, np.ones(local.shape))
    local, widths = np.empty(query.places.shape), np.empty(query.places.shape)
    for number in np.unique(request_numbers).tolist():
        rows, domain = np.flatnonzero(request_numbers == number), model.domains[number]
        knots, uv = (domain.u, domain.v), query.places[rows]
        low, high = (np.array([axis_knots[end] for axis_knots in knots]) for end in (0, -1))
        uv = round_to_ends(uv, low, high)
        check_inside(uv, low, high, rows)
        (k, u, wu), (m, v, wv) = (_find_spans(uv[:, i], knots[i]) for i in range(2))
        patch[rows] += k * (len(domain.v) - 1) + m
        local[rows], widths[rows] = np.stack([u, v], axis=1), np.stack([wu, wv], axis=1)
    return ParameterPoints(patch, local, widths)


def _find_first_patches(model: PatchModel) -> Ints:
    """The number in the model of the first patch of each surface or of each patch of a request."""
    if model.domains:
        return np.array([domain.first for domain in model.domains])
    if model.request_numbers is None:
        return np.arange(model.patch_count)
    # `model.request_numbers` has, for each patch of the model, its number in the request.
    patches = np.empty(model.patch_count, dtype=np.intp)
    patches[model.request_numbers] = np.arange(model.patch_count)
    return patches


def normalize_sums(places: FloatArray) -> FloatArray:
    """Barycentric coordinates (m, 3) divided by their sum; refuses invalid coordinates.

    A coordinate below 0 by a few roundings becomes 0.
    """
    total = places.sum(axis=1)
    is_inside = (places >= -END_ROUNDING).all(axis=1) & (np.abs(total - 1) <= SAME_SUM)
    if not is_inside.all():
        raise InvalidRequest(
            *(
                Issue(
                    "outside_domain",
                    "The place lies outside the triangle.",
                    f"/barycentric/{row}",
                    f"least number {places[row].min():.6g}, sum {total[row]:.10g}",
                    "three numbers of at least 0, sum 1",
                )
                for row in np.flatnonzero(~is_inside)[:MAX_ISSUES].tolist()
            )
        )
    places = np.maximum(places, 0.0)
    normalized: FloatArray = places / places.sum(axis=1)[:, np.newaxis]
    return normalized


def check_coordinates(is_triangle: Bools, query: PointsQuery) -> None:
    """Refuses barycentric coordinates on tensor patches, and (u, v) on triangles.

    `is_triangle` (m,) says for each place whether its patch is a triangle.
    """
    refused_rows = np.flatnonzero(is_triangle != (query.field == "barycentric"))
    if len(refused_rows):
        raise InvalidRequest(
            Issue(
                "wrong_parameters",
                "Places on a triangle are barycentric; places on all other patches are uv.",
                f"/{query.field}/{refused_rows[0]}",
                query.field,
                "uv" if query.field == "barycentric" else "barycentric",
            )
        )


def _find_spans(t: FloatArray, knots: FloatArray) -> tuple[Ints, FloatArray, FloatArray]:
    """The span of each parameter, the local parameter within the span, and the span's width."""
    span = np.searchsorted(knots[1:-1], t, side="right")
    widths = knots[span + 1] - knots[span]
    return span, (t - knots[span]) / widths, widths


def round_to_ends(uv: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """(u, v) (m, 2); parameters that a few roundings led out of domains become their ends.

    `low` and `high` are the ends of the domains, (2,) or (m, 2) each.
    """
    slack = END_ROUNDING * np.maximum(np.abs(low), np.abs(high))
    nearest = np.clip(uv, low, high)
    rounded: FloatArray = np.where(np.abs(uv - nearest) <= slack, nearest, uv)
    return rounded


def check_inside(
    uv: FloatArray, low: FloatArray, high: FloatArray, rows: Ints | None = None
) -> None:
    """Refuses (u, v) (m, 2) outside of domains with these ends: (2,) or (m, 2) each.

    `rows` has for each row of `uv` its number in the request; None if both are the same.
    """
    # Each index is a pair: the row, and 0 for u or 1 for v.
    outside = np.argwhere(~((uv >= low) & (uv <= high)))[:MAX_ISSUES]
    if len(outside):
        lows, highs = np.broadcast_to(low, uv.shape), np.broadcast_to(high, uv.shape)
        raise InvalidRequest(
            *(
                Issue(
                    "outside_domain",
                    "The parameter lies outside the surface.",
                    "/uv" + pointer((row if rows is None else int(rows[row]), axis)),
                    format_number(uv[row, axis]),
                    f"{format_number(lows[row, axis])} to {format_number(highs[row, axis])}",
                )
                for row, axis in outside.tolist()
            )
        )


def find_patch_numbers(number_count: int, query: PointsQuery) -> Ints:
    """For each place, the number of its surface or patch, which is below `number_count`."""
    count, patch = len(query.places), query.patch
    if patch is None:
        if number_count > 1:
            raise InvalidRequest(
                Issue(
                    "missing_field",
                    "The surface has several patches, and each patch has its own parameters.",
                    "/patch",
                    "nothing",
                    "one patch number, or a patch number for each point",
                )
            )
        return np.zeros(count, dtype=np.intp)
    if patch.ndim and len(patch) != count:
        raise InvalidRequest(
            Issue(
                "wrong_length",
                "There must be one patch number for all points, or one for each.",
                "/patch",
                f"{len(patch)} patch numbers",
                f"{count}, or a single number",
            )
        )
    refused = np.argwhere((patch < 0) | (patch >= number_count))[:MAX_ISSUES]
    if len(refused):
        raise InvalidRequest(
            *(
                Issue(
                    "index_out_of_range",
                    "Patches are numbered from 0, in the order of the request.",
                    "/patch" + pointer(index),
                    str(patch[tuple(index)]),
                    f"0 to {number_count - 1}",
                )
                for index in refused.tolist()
            )
        )
    return np.broadcast_to(patch, count).astype(np.intp)
