"""Poles: edges that are one point of space get samples where the triangles beside them need some.

At a pole all places of a side of the surface are one point. Samples there have one vertex, but
different places, so that triangles beside the pole are long and few.
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.brep.edges import EdgeSamples
from service.engine.brep.prepared import PreparedBrep
from service.engine.brep.sampling import insert_samples

NEAR = 2.0
"""Units of places: points nearer than this to the line of a pole are on it, and those nearer to a
sample are left out."""


def split_poles(
    prepared: PreparedBrep, samples: EdgeSamples, faces: Ints, places: Ints
) -> tuple[EdgeSamples, Ints] | None:
    """Insert samples of poles at points of their faces, such as the corners of leaves.

    Parameters
    ----------
    faces : ndarray of int, shape (n,)
        The face of each point, in ascending order.
    places : ndarray of int, shape (n, 2)

    Returns
    -------
    samples : EdgeSamples
    source : ndarray of int, shape (T,)
        The old number of each sample; −1 for new samples. None if no sample is new.
    """
    coedges = prepared.is_degenerate[prepared.coedge_edges].nonzero()[0]
    if not len(coedges):
        return None
    ranges = prepared.edge_ranges[prepared.coedge_edges[coedges]]
    ends = prepared.pcurves.evaluate(coedges.repeat(2), ranges.ravel()).reshape(-1, 2, 2)
    run = ends[:, 1] - ends[:, 0]
    axis = np.abs(run).argmax(axis=1)
    rows = np.arange(len(coedges))
    width = run[rows, axis]
    owner = prepared.coedge_faces[coedges]
    begin, end = (np.searchsorted(faces, owner, side=side) for side in ("left", "right"))
    pole, point = expand_runs(end - begin, begin)
    along, across = axis[pole], 1 - axis[pole]
    offset = places[point, along] - ends[pole, 0, along]
    aside = np.abs(places[point, across] - ends[pole, 0, across])
    share = offset / np.where(width != 0, width, 1.0)[pole]
    inset = NEAR / np.maximum(np.abs(width), 1.0)[pole]
    on_pole = (aside < NEAR) & (share > inset) & (share < 1.0 - inset) & (width != 0)[pole]
    chosen = on_pole.nonzero()[0]
    pole, share, inset = pole[chosen], share[chosen], inset[chosen]
    parameters = ranges[pole, 0] + share * (ranges[pole, 1] - ranges[pole, 0])
    edges = prepared.coedge_edges[coedges[pole]]
    least = inset * (ranges[pole, 1] - ranges[pole, 0])
    return _insert(prepared, samples, edges, parameters, least)


def _insert(
    prepared: PreparedBrep,
    samples: EdgeSamples,
    edges: Ints,
    parameters: FloatArray,
    least: FloatArray,
) -> tuple[EdgeSamples, Ints] | None:
    """Insert samples of edges, in any order, that are at least `least` (m,) from others."""
    order = np.lexsort((parameters, edges))
    edges, parameters, least = edges[order], parameters[order], least[order]
    new = np.ones(len(edges), bool)
    new[1:] = (np.diff(edges) != 0) | (np.diff(parameters) > least[1:])
    edges, parameters, least = edges[new], parameters[new], least[new]
    # The piece of each: the last sample of the edge before it.
    merged = np.lexsort(
        (np.concatenate([samples.parameters, parameters]), np.concatenate([samples.edges, edges]))
    )
    is_old = merged < len(samples.edges)
    before = np.maximum.accumulate(np.where(is_old, merged, 0))
    pieces = np.empty(len(edges), np.intp)
    pieces[merged[~is_old] - len(samples.edges)] = before[~is_old]
    apart = parameters - samples.parameters[pieces] > least
    apart &= samples.parameters[pieces + 1] - parameters > least
    if not apart.any():
        return None
    return insert_samples(prepared, samples, pieces[apart], parameters[apart])
