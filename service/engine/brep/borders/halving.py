"""Pieces of edges halved, and samples inserted into them; what is known stays."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.brep.borders.edge_bounds import bound_edge_pieces
from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.prepared import PreparedBrep


def halve_pieces(
    prepared: PreparedBrep, samples: EdgeSamples, pieces: Ints
) -> tuple[EdgeSamples, Ints]:
    """Halve pieces, given in any order and maybe repeatedly.

    Returns
    -------
    samples : EdgeSamples
    source : ndarray of int, shape (T,)
        The old number of each sample; −1 for new samples.
    """
    pieces = np.unique(pieces)
    low, high = samples.parameters[pieces], samples.parameters[pieces + 1]
    middle = low + (high - low) / 2
    proper = (low < middle) & (middle < high)
    return insert_samples(prepared, samples, pieces[proper], middle[proper])


def insert_samples(
    prepared: PreparedBrep, samples: EdgeSamples, pieces: Ints, parameters: FloatArray
) -> tuple[EdgeSamples, Ints]:
    """Insert samples inside pieces; both are in ascending order. The result is as above."""
    at = pieces + 1
    source = np.insert(np.arange(len(samples.edges)), at, -1)
    edges = np.insert(samples.edges, at, samples.edges[pieces])
    new_parameters = np.insert(samples.parameters, at, parameters)
    bounds = np.insert(samples.bounds, at, samples.bounds[pieces])
    known = samples.positions[samples.vertices][source]
    known[source < 0] = np.nan
    renewed = EdgeSamples.number(
        prepared,
        edges=edges,
        parameters=new_parameters,
        bounds=bounds,
        is_point=samples.is_point,
        ends=samples.ends,
        known=known,
    )
    new = (source < 0).nonzero()[0]
    changed = np.unique(np.concatenate([new - 1, new]))
    changed = changed[~samples.is_point[edges[changed]]]
    if len(changed):
        chords = renewed.positions[
            np.stack([renewed.vertices[changed], renewed.vertices[changed + 1]], axis=1)
        ]
        renewed.bounds[changed] = bound_edge_pieces(
            prepared.curves,
            prepared.edge_curves[edges[changed]],
            new_parameters[changed],
            new_parameters[changed + 1],
            chords,
        )
    return renewed, source
