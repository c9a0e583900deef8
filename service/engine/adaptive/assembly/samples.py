"""The samples of a triangulation as parameters of patches, one for every side of a knot line.

A place on a knot line inside a face belongs to the patches on both sides of it. Where the surface
has a crease there, it has two normals: so triangles on different sides get samples of their own,
which become one vertex again where their normals agree. A triangle that spans several patches
takes, at each of its corners, the patch into which it goes from there.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, IndexArray, Ints
from service.engine.adaptive.triangulation import Triangulation
from service.engine.bounds.faces import SPAN, Faces


@dataclass(frozen=True, eq=False, slots=True)
class Samples:
    """N places of patches.

    Attributes
    ----------
    patch : ndarray of int, shape (N,)
        Numbers of patches in the model.
    u, v : ndarray of float64, shape (N,)
        Their own parameters, in [0, 1]; exact.
    vertex : ndarray of int, shape (N,)
        The vertex of the triangulation that each sample is.
    """

    patch: Ints
    u: FloatArray
    v: FloatArray
    vertex: Ints


def samples_of(faces: Faces, made: Triangulation) -> tuple[Samples, IndexArray]:
    """Samples that occur in triangles, and the triangles as (T, 3) of them."""
    spans = faces.spans[made.face]
    below = np.zeros(made.triangles.shape, dtype=np.intp)
    for axis, at in enumerate((made.u, made.v)):
        inner = (at % SPAN == 0) & (at > 0) & (at < spans[:, axis] * SPAN)
        if inner.any():
            below |= _goes_down(at, made.triangles, inner).astype(np.intp) << axis
    # Four numbers for each sample: in which of the patches around it.
    key = made.triangles * 4 + below
    used = np.zeros(4 * len(made.face), dtype=bool)
    used[key] = True
    kept = used.nonzero()[0]
    number = np.cumsum(used, dtype=np.uint32) - np.uint32(1)
    row, side = kept // 4, kept % 4
    span_u, u = _within(made.u[row], side & 1, spans[row, 0])
    span_v, v = _within(made.v[row], side >> 1, spans[row, 1])
    face = made.face[row]
    patch = faces.first[face] + span_u * faces.stride[face] + span_v
    return Samples(patch, u, v, made.vertex[row]), number[key]


def _goes_down(at: Ints, triangles: Ints, inner: Bools) -> Bools:
    """Whether a triangle lies before the knot line on which its corner is, (T, 3)."""
    places = at[triangles]
    before: Bools = inner[triangles] & (places.sum(axis=1, keepdims=True) < 3 * places)
    return before


def _within(at: Ints, below: Ints, spans: Ints) -> tuple[Ints, FloatArray]:
    """Span and parameter of places along one direction; the last span has its end, too."""
    span = np.minimum(at // SPAN, spans - 1) - below
    return span, (at - span * SPAN) / SPAN
