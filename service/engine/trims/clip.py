"""Triangles and segments of places, cut at the knot lines of their faces.

Proof in docs/proofs.md: "Pieces cover their parts".
"""

from service.bases.arrays import Ints
from service.engine.bounds.clip import PatchPieces
from service.engine.trims.places import Places


def clip_triangles(places: Places, face: Ints, corners: Ints) -> PatchPieces:
    """Pieces of triangles of places (3, 2, m), each over one patch."""
    raise NotImplementedError


def clip_segments(places: Places, face: Ints, ends: Ints) -> PatchPieces:
    """Pieces of segments of places (2, 2, m): triangles whose last two corners are equal.

    A segment from A to B with A = B is one piece.
    """
    raise NotImplementedError
