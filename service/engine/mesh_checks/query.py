"""A query of a check: how narrow its intervals are, and whether its result lists distances."""

from dataclasses import dataclass

RELATIVE_TOLERANCE, MIN_RELATIVE_TOLERANCE, MAX_RELATIVE_TOLERANCE = 0.1, 0.01, 0.5
"""The default width of an interval as a share of its upper end, and the least and the largest that
a request may ask for."""


@dataclass(frozen=True, slots=True)
class CheckQuery:
    """How exactly a mesh is judged.

    Attributes
    ----------
    relative_tolerance : float
        The largest width of each of the two intervals, as a share of its upper end.
    distances : bool
        Whether the result has the mesh as it was read, and the distance of each vertex.
    """

    relative_tolerance: float = RELATIVE_TOLERANCE
    distances: bool = False
