"""The box of a part: it depends on its faces, not on the surfaces that carry them."""

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.row_batches import expand_runs, row_slices
from service.engine.nets.blossoms import restrict
from service.engine.trims.places import Places
from service.engine.vectors import project
from service.surface.placement import Box, find_box

CHUNK = 1 << 18
"""The most numbers in the nets that are restricted in one step."""


def find_part_box(places: Places, low: FloatArray, high: FloatArray, *points: FloatArray) -> Box:
    """The box about points, (…, 3) each, and the surfaces of faces over boxes of places.

    A surface counts with its nets restricted to its box. So equal faces on larger surfaces have
    equal boxes, but for rounding.

    Parameters
    ----------
    low, high : ndarray of float64, shape (F, 2)
        Least and greatest places of the parameter curves of each face, as from
        `service.engine.trims.spline_shapes.find_face_boxes`; faces whose box is not finite do not
        count.
    """
    faces = np.flatnonzero(np.isfinite(high - low).all(axis=1))
    begin, end = np.empty((2, 2, len(faces)), np.intp)
    for axis in range(2):
        begin[axis], end[axis] = places.find_spans(faces, axis, low[faces, axis], high[faces, axis])
    counts = end - begin + 1
    run, number = expand_runs(counts.prod(axis=0))
    face = faces[run]
    spans = begin[:, run] + np.array([number // counts[1, run], number % counts[1, run]])
    patch = places.first[face] + spans[0] * places.stride[face] + spans[1]
    corners = np.empty((2, 2, len(patch)))
    for axis in range(2):
        first, last = places.knots_at(face, axis, spans[axis])
        width = np.maximum(last - first, 1)
        for k, ends in enumerate((low, high)):
            corners[k, axis] = (ends[face, axis] - first) / width
    corners = np.minimum(np.maximum(corners, 0.0), 1.0)
    nets = places.surfaces.nets
    boxes = [np.concatenate([values.reshape(-1, 3) for values in points])]
    for group, rows in nets.split_by_group(patch):
        for chunk in row_slices(len(rows), 4 * group.values[..., 0].size, CHUNK):
            chosen = rows[chunk]
            net = group.items.take(nets.row[patch[chosen]], axis=0)
            net = project(restrict(net, corners[:, :, chosen]), -3)
            middles = nets.middles[:, patch[chosen]].T
            boxes += [net.min(axis=(2, 3)) + middles, net.max(axis=(2, 3)) + middles]
    return find_box(np.concatenate(boxes))
