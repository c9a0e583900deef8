"""Where the parameters of a query lie: on which patch, and at which parameters of its own."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.errors import MAX_ISSUES, InvalidRequest, Issue, pointer
from service.surface.lowered import PatchModel


@dataclass(frozen=True, eq=False, slots=True)
class Places:
    """m parameters, each on a patch of the model.

    Attributes
    ----------
    patch : ndarray of int, shape (m,)
        In the numbering across all batches.
    local : ndarray of float64, shape (m, 2)
        Parameters of the patch, in [0, 1].
    widths : ndarray of float64, shape (m, 2)
        How far the patch reaches in the parameters of the surface.
    """

    patch: Ints
    local: FloatArray
    widths: FloatArray


def locate(model: PatchModel, uv: FloatArray, patch: Ints | None) -> Places:
    """The places of parameters uv (m, 2), of the surface or, where it has no domain, of patches.

    At a knot the patch that begins there counts, at the end of the domain the last one.

    Parameters
    ----------
    patch : ndarray of int, shape () or (m,), optional
        Numbers of patches as the request has them; not needed where there is but one.

    Raises
    ------
    InvalidRequest
        `outside_domain` and whatever is wrong with the numbers, pointing into the request.
    """
    if model.domain is None:
        numbers = _numbers(model, len(uv), patch)
        unit = np.array([0.0, 1.0])
        _check_inside(uv, (unit, unit))
        return Places(numbers, uv, np.ones(uv.shape))
    if patch is not None:
        raise InvalidRequest(
            Issue(
                "unexpected_patch",
                "The parameters are those of the whole surface, which tell the patch.",
                "/patch",
                "patch numbers",
                "none for this kind of surface",
            )
        )
    knots = model.domain.u, model.domain.v
    _check_inside(uv, knots)
    spans, local, widths = zip(
        *(_span(uv[:, k], line) for k, line in enumerate(knots)), strict=True
    )
    return Places(
        spans[0] * (len(knots[1]) - 1) + spans[1], np.stack(local, 1), np.stack(widths, 1)
    )


def _span(t: FloatArray, knots: FloatArray) -> tuple[Ints, FloatArray, FloatArray]:
    """The span of each parameter, the parameter within it, and its width."""
    span = np.searchsorted(knots[1:-1], t, side="right")
    widths = knots[span + 1] - knots[span]
    return span, (t - knots[span]) / widths, widths


def _check_inside(uv: FloatArray, knots: tuple[FloatArray, FloatArray]) -> None:
    low, high = (np.array([line[end] for line in knots]) for end in (0, -1))
    places = np.argwhere(~((uv >= low) & (uv <= high)))[:MAX_ISSUES]
    if len(places):
        raise InvalidRequest(
            *(
                Issue(
                    "outside_domain",
                    "The parameter lies outside the surface.",
                    "/uv" + pointer(place),
                    f"{uv[tuple(place)]:.6g}",
                    f"{low[place[1]]:.6g} to {high[place[1]]:.6g}",
                )
                for place in places.tolist()
            )
        )


def _numbers(model: PatchModel, count: int, patch: Ints | None) -> Ints:
    """The patch of each of `count` points, in the numbering of the model."""
    if patch is None:
        if model.patch_count > 1:
            raise InvalidRequest(
                Issue(
                    "missing_field",
                    "The surface has several patches, and parameters of their own for each.",
                    "/patch",
                    "nothing",
                    "a patch number, or one for every point",
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
    places = np.argwhere((patch < 0) | (patch >= model.patch_count))[:MAX_ISSUES]
    if len(places):
        raise InvalidRequest(
            *(
                Issue(
                    "index_out_of_range",
                    "Patches are numbered from 0, in the order of the request.",
                    "/patch" + pointer(place),
                    str(patch[tuple(place)]),
                    f"0 to {model.patch_count - 1}",
                )
                for place in places.tolist()
            )
        )
    asked = np.broadcast_to(patch, count).astype(np.intp)
    if model.order is None:
        return asked
    row = np.empty(model.patch_count, dtype=np.intp)
    row[model.order] = np.arange(model.patch_count)
    return row[asked]
