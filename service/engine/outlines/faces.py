"""The faces of a surface of patches: each B-spline, and each patch that is no part of one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases import knots as knot
from service.bases.affine_combination import combine
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.blossoms import find_refinement, raise_knots
from service.cancellation import checkpoint
from service.surface.batches import Patches, TrianglePatches
from service.surface.lowered import PatchModel, SplineNet
from service.surface.spline_tables import SurfaceTable

ENDS = np.array([0.0, 1.0])
"""The parameters at which a single patch begins and ends."""


@dataclass(frozen=True, eq=False, slots=True)
class Spline:
    """A clamped tensor-product B-spline: degrees, knots, net (n, m, 3), and weights (n, m)."""

    degree: tuple[int, int]
    knots: tuple[FloatArray, FloatArray]
    points: FloatArray
    weights: FloatArray | None


@dataclass(frozen=True, eq=False, slots=True)
class OutlineFaces:
    """F faces, each with a grid of patches of a model.

    Attributes
    ----------
    rows, columns : ndarray of int, shape (F,)
        Numbers of patches along u and along v.
    first : ndarray of int, shape (F,)
        Patch (k, l) of a face has the number `first` + k · `columns` + l.
    splines : tuple of Spline
        F of them; those of triangles have degree (n, n) and are a point along v = 1.
    breaks : tuple of pairs of ndarray
        For each face the parameters at which patches begin and end, along u and along v.
    """

    rows: Ints
    columns: Ints
    first: Ints
    splines: tuple[Spline, ...]
    breaks: tuple[tuple[FloatArray, FloatArray], ...]

    def table(self) -> SurfaceTable:
        """The splines as columns."""
        splines = self.splines
        counts = np.array([spline.points.shape[:2] for spline in splines], np.intp)
        weights = [np.ones(s.points.shape[:2]) if s.weights is None else s.weights for s in splines]
        return SurfaceTable(
            np.array([spline.degree for spline in splines], np.intp),
            counts,
            np.concatenate([spline.points.reshape(-1, 3) for spline in splines]),
            np.concatenate([each.ravel() for each in weights]),
            np.array([s.weights is not None for s in splines]),
            np.concatenate([vector for spline in splines for vector in spline.knots]),
        )


def find_faces(model: PatchModel) -> OutlineFaces:
    """The faces of a model, in the order of its parts."""
    domains = {d.first: d for d in model.domains if d.net is not None and _is_continuous(d.net)}
    is_single = np.ones(model.patch_count, bool)
    for first, domain in domains.items():
        is_single[first : first + domain.patch_count] = False
    patches = _list_patches(model.batches, is_single)
    order = np.arange(model.patch_count) if model.sequence is None else model.sequence
    splines, breaks, shapes, firsts = [], [], [], []
    # A spline takes the place of its first patch.
    for first in order.tolist():
        if is_single[first]:
            splines.append(patches[first])
            breaks.append((ENDS, ENDS))
        elif first in domains:
            domain = domains[first]
            assert domain.net is not None
            splines.append(_clamp(domain.net))
            breaks.append((domain.u, domain.v))
        else:
            continue
        firsts.append(first)
        shapes.append([len(values) - 1 for values in breaks[-1]])
    rows, columns = np.array(shapes, np.intp).T
    return OutlineFaces(rows, columns, np.array(firsts, np.intp), tuple(splines), tuple(breaks))


def _list_patches(batches: Sequence[Patches], is_chosen: Bools) -> dict[int, Spline]:
    """The chosen patches as splines of one span, by number."""
    patches: dict[int, Spline] = {}
    first = 0
    for batch in batches:
        chosen = np.flatnonzero(is_chosen[first : first + batch.count])
        if len(chosen):
            checkpoint()
            own = batch.take(chosen)
            tensor = own.to_tensor() if isinstance(own, TrianglePatches) else own
            p, q = tensor.degree
            knots = np.repeat(ENDS, p + 1), np.repeat(ENDS, q + 1)
            for row, number in enumerate((chosen + first).tolist()):
                weights = None if tensor.weights is None else tensor.weights[row]
                patches[number] = Spline(tensor.degree, knots, tensor.points[row], weights)
        first += batch.count
    return patches


def _is_continuous(net: SplineNet) -> bool:
    """Whether no knot inside the domain has a multiplicity above the degree."""
    for knots, degree in zip(net.knots, net.degree, strict=True):
        inner = knots[degree + 1 : len(knots) - degree - 1]
        if len(inner) > degree and (inner[degree:] == inner[:-degree]).any():
            return False
    return True


def _clamp(net: SplineNet) -> Spline:
    """The spline over its domain alone, with clamped knots: the same points and parameters."""
    points, weights = net.points, net.weights
    knots = []
    for axis, (vector, degree) in enumerate(zip(net.knots, net.degree, strict=True)):
        if net.is_periodic[axis]:
            points = knot.wrap_points(points, degree, axis)
            weights = None if weights is None else knot.wrap_points(weights, degree, axis)
        low, high = knot.domain(vector, degree)
        target = raise_knots(vector, degree, degree, low, high)
        knots.append(target)
        if np.array_equal(target, vector):
            continue
        index, shares = find_refinement(vector, degree, target, degree)
        points = points.swapaxes(0, axis)
        weights = None if weights is None else weights.swapaxes(0, axis)
        points, weights = combine(points, weights, index, shares)
        if net.is_periodic[axis]:
            # Both ends are the same curve, and must stay so after rounding.
            points[-1] = points[0]
            if weights is not None:
                weights[-1] = weights[0]
        points = np.ascontiguousarray(points.swapaxes(0, axis))
        weights = None if weights is None else np.ascontiguousarray(weights.swapaxes(0, axis))
    return Spline(net.degree, (knots[0], knots[1]), points, weights)
