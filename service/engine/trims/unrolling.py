"""Closed surfaces repeated beyond their domains, as far as parameter curves run."""

from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.bounds.faces import Faces
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.spans import Breaks
from service.engine.trims.surfaces import FaceSurfaces, build_nets
from service.surface.batches import Patches, TensorPatches
from service.surface.spline_tables import find_starts

SAME = 1e-9
"""Parameter curves that leave a period by at most this share of it stay in it."""


def unroll(closed: ClosedSurfaces, low: FloatArray, high: FloatArray) -> FaceSurfaces:
    """The surfaces over whole periods that contain [low, high], (F, 2) each, along closed axes.

    A surface that needs its own domain alone stays as it is.
    """
    surfaces = closed.surfaces
    used = np.isfinite(high - low) & closed.is_closed
    # Numbers of the first period, and of the one after the last.
    first, last = np.zeros((2, *low.shape))
    begin = (low - closed.low) / closed.period
    end = (high - closed.low) / closed.period
    first[used] = np.floor(begin[used] + SAME)
    last[used] = np.ceil(end[used] - SAME)
    # Whole periods: exactly those that are needed, at least one.
    turns = np.where(used, np.maximum(last - first, 1), 1).astype(np.intp)
    first = first.astype(np.intp)
    if (turns == 1).all() and not first.any():
        return surfaces
    faces, breaks = surfaces.faces, surfaces.breaks
    spans = faces.spans * turns.T
    # Faces in the order of their patches, so that each batch keeps its place.
    order = faces.first.argsort(kind="stable")
    face, number = expand_runs(spans.prod(axis=0)[order])
    face = order[face]
    k, m = np.divmod(number, spans[1, face])
    old = faces.first[face] + k % faces.spans[0, face] * faces.stride[face]
    old += m % faces.spans[1, face]
    new_first = np.empty_like(faces.first)
    new_first[order] = find_starts(spans.prod(axis=0)[order])[:-1]
    batches: list[Patches] = []
    offset = 0
    for batch in surfaces.model.batches:
        rows = old[(old >= offset) & (old < offset + batch.count)] - offset
        weights = None if batch.weights is None else batch.weights[rows]
        batches.append(TensorPatches(batch.points[rows], weights))
        offset += batch.count
    model, nets = build_nets(tuple(batches), surfaces.model.name, surfaces.errors)
    return replace(
        surfaces,
        model=model,
        nets=nets,
        faces=Faces(new_first, spans[1].copy(), spans),
        breaks=_repeat_breaks(breaks, first.ravel(), turns.ravel(), closed.period.ravel()),
    )


def _repeat_breaks(breaks: Breaks, first: Ints, turns: Ints, period: FloatArray) -> Breaks:
    """The breaks of each domain `turns` times, from its period number `first` on."""
    count = breaks.count * turns
    domain, number = expand_runs(count + 1)
    turn, inside = np.divmod(number, breaks.count[domain])
    # A break between two periods is the end of the first.
    is_end = (inside == 0) & (number > 0)
    turn, inside = turn - is_end, np.where(is_end, breaks.count[domain], inside)
    values = breaks.values[breaks.first[domain] + inside]
    values = values + (first[domain] + turn) * period[domain]
    return Breaks(values, count, find_starts(count + 1)[:-1])
