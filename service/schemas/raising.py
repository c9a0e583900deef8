"""How far nets are raised until their weights are positive, and why some cannot be."""

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from service.bases import knots as knot
from service.bases import triangle
from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein
from service.bases.extraction import extract_bezier_points
from service.bases.raising import (
    BezierDirection,
    Degrees,
    Direction,
    Raising,
    SplineDirection,
    count_net_points,
    find_degrees,
)
from service.bases.row_batches import row_slices
from service.errors import InvalidRequest, Issue, count_nouns
from service.schemas.document import DocumentLimits
from service.schemas.validation import Path, to_refusal
from service.surface.checks import MAX_WEIGHT_RATIO
from service.surface.knots import Knots, build_knot_vector, check_bezier_points, validate_knots

SAMPLES = np.linspace(0.0, 1.0, 9)
"""Parameters along each direction of a patch at which the weight function is looked at."""

SAMPLE_BLOCK = 1 << 16
"""The most samples at once."""

Least: TypeAlias = tuple[float, str]
"""The least of some values of a weight function, and its place."""


def plan_net(
    weights: FloatArray,
    directions: Sequence[Direction],
    limits: DocumentLimits,
    *,
    corners: Sequence[Path],
    look: Callable[[], Least],
    copies: int = 1,
    others: int = 0,
    largest: float | None = None,
) -> Raising:
    """How a net is raised until its weights are positive.

    Parameters
    ----------
    weights : ndarray of float64
        Of one net, or along the first axis of many.
    directions : sequence of Direction
        Of arrays (…, 1), which are the weights with one axis more.
    corners : sequence of paths
        For each weight of a corner that is 0 or negative, its path in the document.
    look : callable
        Finds the least of some values of the weight function, and its place as a text.
    copies : int
        How many nets there will be, with those that need not be raised themselves.
    others : int
        The number of control points of other patches of the surface.
    largest : float, optional
        The largest weight of the surface; by default, of these nets.

    Raises
    ------
    ValidationError
        A weight of a corner is not positive, or the weight function vanishes, or the net would have
        too high a degree or too many control points.
    """
    start = tuple(direction.degree for direction in directions)
    if (weights > 0).all():
        return Raising(directions, start)
    if corners:
        raise to_refusal((path, _corner_issue()) for path in corners)
    # A weight that is positive by rounding alone would be refused after dividing.
    highest_weight = float(weights.max()) if largest is None else largest
    floor = max(highest_weight * (1 + 2.0**-20) / MAX_WEIGHT_RATIO, float(np.finfo(float).tiny))
    least, place = look()
    if least < floor:
        raise to_refusal([((), _vanishing_issue(least, place))])

    def fits(degrees: Degrees) -> bool:
        count = copies * count_net_points(directions, degrees) + others
        return count <= limits.max_control_points

    values, highest = weights[..., np.newaxis], limits.max_degree
    degrees, is_enough = find_degrees(values, directions, floor, highest, fits)
    if not is_enough and min(degrees) < highest:
        raise to_refusal([((), _size_issue(degrees, limits))])
    if not is_enough:
        raise to_refusal([((), _degree_issue(least, place, limits))])
    return Raising(directions, degrees)


def least_of_patches(nets: FloatArray, numbers: Sequence[int] = ()) -> Least:
    """The least of some values of the weight function of Bézier patches (P, p+1, q+1).

    `numbers` are those of the patches in the document, if it has many.
    """
    value, number, (u, v) = _sample(nets)
    of_patch = f" of patch {numbers[number]}" if numbers else ""
    return value, f"u = {u:.4g}, v = {v:.4g}{of_patch}"


def least_of_triangles(nets: FloatArray, numbers: Sequence[int] = ()) -> Least:
    """`least_of_patches` of triangles (P, K)."""
    value, number, (u, t) = _sample(triangle.tensor_net(nets[..., np.newaxis])[..., 0])
    of_patch = f" of patch {numbers[number]}" if numbers else ""
    s = u * (1 - t)
    return value, f"r, s, t = {1 - s - t:.4g}, {s:.4g}, {t:.4g}{of_patch}"


def least_of_curve(weights: FloatArray) -> Least:
    """`least_of_patches` of one Bézier curve (n+1,)."""
    value, _, place = _sample(weights[np.newaxis, :, np.newaxis])
    return value, f"t = {place[0]:.4g}"


def _sample(nets: FloatArray) -> tuple[float, int, tuple[float, float]]:
    """The least sampled value, the number of its patch, and its parameters, from 0 to 1."""
    basis_u, basis_v = (bernstein(length - 1, SAMPLES) for length in nets.shape[1:])
    least = (np.inf, 0, (0.0, 0.0))
    for block in row_slices(len(nets), len(SAMPLES) ** 2, SAMPLE_BLOCK):
        values = np.einsum("ai,pij,bj->pab", basis_u, nets[block], basis_v)
        number, i, j = np.unravel_index(int(values.argmin()), values.shape)
        found = float(values.min()), block.start + int(number), (SAMPLES.item(i), SAMPLES.item(j))
        least = min(least, found)
    return least


def plan_spline(
    weights: FloatArray,
    knots: Sequence[Knots],
    degrees: Sequence[int],
    field: str,
    limits: DocumentLimits,
) -> Raising:
    """`plan_net` of a B-spline in one direction or two; `field` has the weights in the document."""
    counts, directions, vectors = weights.shape, list[SplineDirection](), list[FloatArray]()
    is_curve = len(counts) == 1
    points_pointer = "/control_points" if is_curve else "/control_net"
    try:
        for axis, (each, degree) in enumerate(zip(knots, degrees, strict=True)):
            where = "/knots" if is_curve else f"/knots/{axis}"
            valid = validate_knots(each, counts[axis], degree, where, points_pointer)
            vectors.append(build_knot_vector(valid, counts[axis], degree))
            is_periodic = isinstance(valid, str) and valid == "periodic"
            directions.append(SplineDirection(axis, degree, vectors[-1], is_periodic))
        check_bezier_points(tuple(vectors), tuple(degrees), points_pointer)
    except InvalidRequest as error:
        raise to_refusal(((), issue) for issue in error.issues) from None
    is_clamped = [
        bool(u[1] == u[p] and u[-2] == u[-1 - p]) for u, p in zip(vectors, degrees, strict=True)
    ]
    return plan_net(
        weights,
        directions,
        limits,
        corners=[(field, *index) for index in find_corners(weights, is_clamped)],
        look=lambda: _least_of_spline(weights, directions),
    )


def raised_knots(raising: Raising, knots: Sequence[Knots]) -> tuple[Knots, ...]:
    """The knots of a raised spline; a direction that is not raised keeps its own."""
    return tuple(
        each.raise_knots(degree)
        if isinstance(each, SplineDirection) and degree > each.degree
        else own
        for each, degree, own in zip(raising.directions, raising.degrees, knots, strict=True)
    )


def _least_of_spline(weights: FloatArray, directions: Sequence[SplineDirection]) -> Least:
    """`least_of_patches` of the spans of a spline whose Bézier weights are not all positive."""
    nets = weights if weights.ndim == 2 else weights[:, np.newaxis]
    for axis, each in enumerate(directions):
        if each.is_periodic:
            nets = knot.wrap_points(nets, each.degree, axis)
    nets = extract_bezier_points(nets[..., np.newaxis], directions[0].knots, directions[0].degree)[
        0
    ]
    # The axes are span along u, p + 1, columns, 1: columns become spans along v and q + 1.
    if len(directions) == 2:
        nets = np.moveaxis(nets, 2, 0)
        nets = extract_bezier_points(nets, directions[1].knots, directions[1].degree)[0]
        nets = nets.transpose(2, 0, 3, 1, 4)
    else:
        nets = nets[:, np.newaxis]
    spans, patches = nets.shape[:2], nets.reshape(-1, *nets.shape[2:4])
    wrong = np.flatnonzero((patches <= 0).any(axis=(1, 2)))
    if not len(wrong):
        return float(weights.max()), ""
    value, number, place = _sample(patches[wrong])
    texts = []
    for each, name, span, local in zip(
        directions,
        "uv" if len(directions) == 2 else "t",
        np.unravel_index(wrong[number], spans),
        place,
        strict=False,
    ):
        low, high = knot.breaks(each.knots, each.degree)[int(span) : int(span) + 2]
        texts.append(f"{name} = {low + local * (high - low):.4g}")
    return value, ", ".join(texts)


def bezier_directions(shape: Sequence[int], first_axis: int = 0) -> list[BezierDirection]:
    """The directions of Bézier nets with these numbers of control points."""
    return [BezierDirection(axis, n - 1) for axis, n in enumerate(shape, first_axis)]


def find_corners(
    weights: FloatArray, is_end: Sequence[bool] | None = None
) -> list[tuple[int, ...]]:
    """The indices of those corners of a net at which the weight is not positive.

    `is_end` says for each direction whether its first and its last control point are ends of the
    surface; by default they are.
    """
    if is_end is not None and not all(is_end):
        return []
    ends = np.ix_(*((0, n - 1) for n in weights.shape))
    numbers = np.arange(weights.size).reshape(weights.shape)[ends].ravel()
    wrong = np.unique(numbers[weights.ravel()[numbers] <= 0])
    return [tuple(map(int, np.unravel_index(k, weights.shape))) for k in wrong]


def _corner_issue() -> Issue:
    return Issue(
        "weight_not_positive",
        "The weight of a corner is positive: with weight 0 the surface has no end there.",
        "",
        "zero or less at a corner",
        "a number above 0",
    )


def _vanishing_issue(value: float, place: str) -> Issue:
    return Issue(
        "weight_not_positive",
        "The weighted mean of the weights must be positive everywhere: where it is 0 the surface "
        "goes to infinity.",
        "",
        f"{value:.3g} at {place}",
        "weights whose function is positive on the whole surface; or the surface in pieces without "
        "this place",
    )


def _degree_issue(value: float, place: str, limits: DocumentLimits) -> Issue:
    return Issue(
        "degree_too_high",
        f"The weights would be positive only in a degree above {limits.max_degree}: their function "
        "comes near to 0 within a short way.",
        "",
        f"a weight function that is {value:.3g} at {place}",
        "the surface in pieces, split near there: pieces need a lower degree",
    )


def _size_issue(degrees: Sequence[int], limits: DocumentLimits) -> Issue:
    return Issue(
        "too_many_control_points",
        "Until all weights are positive, the surface would have more control points than this "
        "service takes.",
        "",
        "a degree above " + " × ".join(map(str, degrees)),
        f"at most {count_nouns(limits.max_control_points, 'control points')}",
    )
