"""Faces: rectangles of patches that are divided as one surface, across their knot lines."""

from dataclasses import dataclass

from service.bases.arrays import Ints

DEPTH = 30
"""A knot span is 2^DEPTH units long, the least length there is: all places are whole numbers."""

SPAN = 1 << DEPTH


@dataclass(frozen=True, eq=False, slots=True)
class Faces:
    """F faces. Span (k, l) of face f is patch `first[f] + k stride[f] + l` of the model.

    A place of a face is a pair of whole numbers (u, v), 0 ≤ u ≤ n_u SPAN, 0 ≤ v ≤ n_v SPAN:
    u // SPAN is the span and u % SPAN / SPAN the patch's own parameter. Triangular patches are
    faces of one span, as tensor patches of which the side v = 1 is one point.

    Attributes
    ----------
    first, stride : ndarray of int, shape (F,)
    spans : ndarray of int, shape (F, 2)
        n_u and n_v.
    """

    first: Ints
    stride: Ints
    spans: Ints
