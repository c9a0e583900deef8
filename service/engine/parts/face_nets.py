"""Nets of the faces of a brep: the spans of surfaces, restricted to the boxes of the regions.

So a surface that is far larger than its face makes no question slow, and its nets have the digits
of the face.

Proof in docs/proofs.md: "Nets of a part".
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.brep.prepared import PreparedBrep
from service.engine.evaluation.normals import group_by_batch
from service.engine.nets.blossoms import restrict
from service.engine.trims.places import SIZE
from service.engine.vectors import UNIT, Items

SLIVER = 2.0
"""A box that reaches into a span by at most this number of margins does not need its net."""


@dataclass(frozen=True, eq=False, slots=True)
class FaceSpans(Items):
    """m spans of surfaces of faces, each with its part in the box of the face.

    Attributes
    ----------
    face : ndarray of int, shape (m,)
    patch : ndarray of int, shape (m,)
        The patch of the span in the model of the surfaces.
    low, high : ndarray of float64, shape (2, m)
        The part, in parameters of the surface.
    begin, end : ndarray of float64, shape (2, m)
        The part, in parameters of the patch.
    shift : ndarray of float64, shape (2, m)
        By how much rounding may move parameters of the patch.
    """

    face: Ints
    patch: Ints
    low: FloatArray
    high: FloatArray
    begin: FloatArray
    end: FloatArray
    shift: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class FaceNets:
    """The nets of m spans, of one degree.

    Attributes
    ----------
    spans : FaceSpans
    values : ndarray of float64, shape (m, 3 or 4, p+1, q+1)
        About the middles; homogeneous if rational.
    middles : ndarray of float64, shape (3, m)
        Model coordinates.
    sizes : ndarray of float64, shape (m,)
        The largest absolute coordinate of the whole nets about their middles.
    errors : ndarray of float64, shape (m,)
        How far points may be from the surfaces of the request, at equal parameters.
    """

    spans: FaceSpans
    values: FloatArray
    middles: FloatArray
    sizes: FloatArray
    errors: FloatArray


def find_boxes(prepared: PreparedBrep) -> tuple[FloatArray, FloatArray]:
    """The boxes [low, high], (F, 2) each, of the loops of faces, in the domains of the surfaces.

    They are infinite for faces without loops.
    """
    regions, surfaces = prepared.regions, prepared.surfaces
    margins = (regions.places.extent / SIZE) * regions.margins[:, np.newaxis]
    is_empty = ~np.isfinite(regions.high - regions.low)
    low = np.maximum(regions.low + margins, surfaces.low)
    high = np.minimum(regions.high - margins, surfaces.high)
    return np.where(is_empty, np.inf, low), np.where(is_empty, -np.inf, high)


def find_slivers(prepared: PreparedBrep) -> Bools:
    """Whether the box of each face, (F,), reaches into spans that have no net (`SLIVER`)."""
    low, high = find_boxes(prepared)
    inner_low, inner_high = _shrink_boxes(prepared, low, high)
    breaks = prepared.surfaces.breaks
    faces = np.flatnonzero(np.isfinite(high - low).all(axis=1))
    domain = (2 * faces[:, np.newaxis] + np.arange(2)).ravel()
    has_slivers = np.zeros(len(low), bool)
    for is_high, pair in enumerate(((low, inner_low), (high, inner_high))):
        spans = [
            breaks.find_spans(domain, ends[faces].ravel(), before=bool(is_high)) for ends in pair
        ]
        has_slivers[faces] |= (spans[0] != spans[1]).reshape(-1, 2).any(axis=1)
    return has_slivers


def restrict_faces(prepared: PreparedBrep) -> Iterator[FaceNets]:
    """The nets of all faces with loops, degree by degree.

    Whole spans keep their control points, so that neighbours share the points of a side.
    """
    surfaces, nets = prepared.surfaces, prepared.surfaces.nets
    spans = _list_spans(prepared)
    is_whole = ((spans.begin == 0.0) & (spans.end == 1.0)).all(axis=0)
    for batch, first, rows in group_by_batch(surfaces.model.batches, spans.patch):
        chosen = spans.take(rows[is_whole[rows]])
        if not len(chosen.face):
            continue
        row = chosen.patch - first
        weights = None if batch.weights is None else batch.weights[row]
        values = to_homogeneous(batch.points[row], weights)
        none, errors = np.zeros((3, len(row))), surfaces.errors[chosen.face]
        sizes = np.abs(batch.points[row]).max(axis=(1, 2, 3), initial=0.0)
        yield FaceNets(chosen, values.transpose(0, 3, 1, 2), none, sizes, errors)
    for group, rows in nets.split_by_group(spans.patch):
        chosen = spans.take(rows[~is_whole[rows]])
        if not len(chosen.face):
            continue
        row = nets.row[chosen.patch]
        values = restrict(group.items.take(row, axis=0), np.stack([chosen.begin, chosen.end]))
        sizes = nets.sizes[chosen.patch]
        errors = 8 * UNIT * (sum(group.degree) + 4) * sizes + surfaces.errors[chosen.face]
        errors += (group.partial_bounds[:, row] * chosen.shift).sum(axis=0)
        yield FaceNets(chosen, values, nets.middles[:, chosen.patch], sizes, errors)


def _shrink_boxes(
    prepared: PreparedBrep, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Boxes (F, 2) smaller by `SLIVER` margins on all sides, but no smaller than a point."""
    regions = prepared.regions
    margin = SLIVER * regions.margins[:, np.newaxis] * (regions.places.extent / SIZE)
    is_empty = ~np.isfinite(high - low)
    middle = np.where(is_empty, 0.0, low + np.where(is_empty, 0.0, high - low) / 2)
    return np.minimum(low + margin, middle), np.maximum(high - margin, middle)


def _list_spans(prepared: PreparedBrep) -> FaceSpans:
    """The spans that the boxes of regions touch, face after face."""
    surfaces = prepared.surfaces
    low, high = find_boxes(prepared)
    faces = np.flatnonzero(np.isfinite(high - low).all(axis=1))
    inner_low, inner_high = (ends[faces] for ends in _shrink_boxes(prepared, low, high))
    low, high = low[faces], np.maximum(low, high)[faces]
    breaks = surfaces.breaks
    domain = 2 * faces[:, np.newaxis] + np.arange(2)
    begin = breaks.find_spans(domain.ravel(), inner_low.ravel()).reshape(-1, 2)
    end = breaks.find_spans(domain.ravel(), inner_high.ravel(), before=True).reshape(-1, 2)
    count = np.maximum(end - begin, 0) + 1
    run, number = expand_runs(count.prod(axis=1))
    face = faces[run]
    span = begin[run] + np.stack(np.divmod(number, count[run, 1]), axis=1)
    at = breaks.first[domain[run]] + span
    first, last = breaks.values[at], breaks.values[at + 1]
    width = last - first
    part_low, part_high = np.maximum(low[run], first), np.minimum(high[run], last)
    ends = [np.clip((values - first) / width, 0.0, 1.0) for values in (part_low, part_high)]
    largest = np.maximum(np.abs(first), np.abs(last))
    return FaceSpans(
        face,
        surfaces.faces.first[face] + span[:, 0] * surfaces.faces.stride[face] + span[:, 1],
        np.ascontiguousarray(part_low.T),
        np.ascontiguousarray(part_high.T),
        # So that 1 − t is exact, too.
        np.ascontiguousarray(1.0 - (1.0 - ends[0].T)),
        np.ascontiguousarray(1.0 - (1.0 - ends[1].T)),
        np.ascontiguousarray((16 * UNIT * (1.0 + largest / width)).T),
    )
