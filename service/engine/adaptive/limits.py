"""Limits of one mesh: of the depth of division, of the number of triangles, and of the work."""

from dataclasses import dataclass, field
from math import inf

from service.bases.arrays import Ints
from service.cancellation import checkpoint
from service.errors import InvalidRequest, Issue, TooLarge, count_nouns


@dataclass(slots=True)
class Effort:
    """The work of one request, approximately in multiplications.

    Attributes
    ----------
    limit : float
        The limit of all work.
    spent : float
        Work done.
    reserve : float
        Work that the mesh being built must leave for the next ones.
    """

    limit: float = inf
    spent: float = 0.0
    reserve: float = 0.0

    def spend(self, work: float) -> None:
        """Add to the work spent; raise `TooLarge` beyond the limit, `Cancelled` if cancelled.

        Work beyond the limit is not added, because it is not done.
        """
        checkpoint()
        if self.spent + work > self.limit - self.reserve:
            raise TooLarge(
                Issue(
                    "too_costly",
                    "A mesh with this tolerance takes more work than one request may take.",
                    "/tolerance",
                    f"more than {self.limit:.3g} multiplications",
                    "a greater tolerance",
                )
            )
        self.spent += work

    def reserve_rest(self, work: float) -> None:
        """Reserve the rest of the limit, except for this amount of work."""
        self.reserve = max(self.limit - self.spent - work, 0.0)


@dataclass(slots=True)
class MeshLimits:
    """Limits of one mesh: its number of triangles, and its work."""

    triangles: float = inf
    effort: Effort = field(default_factory=Effort)

    def spend(self, work: float) -> None:
        """Add to the work spent, as `Effort.spend` does."""
        self.effort.spend(work)

    def count(self, triangles: int) -> None:
        """Raise `TooLarge` if this lower bound of the number of triangles exceeds the limit."""
        if triangles > self.triangles:
            raise TooLarge(
                Issue(
                    "too_many_triangles",
                    "A mesh with this tolerance has more triangles than the limit.",
                    "/tolerance",
                    f"more than {count_nouns(round(self.triangles), 'triangles')}",
                    "a greater tolerance, or a greater limit",
                )
            )


class SidePieces:
    """Counts the pieces of the sides of faces, once for each side, and limits the triangles.

    A face with k pieces on its border has at least k − 2 triangles.
    """

    def __init__(self, faces: int, most: int) -> None:
        self.triangles, self._limits = -2 * faces, MeshLimits(most)

    def add(self, uses: Ints) -> None:
        """Count n more pieces; `uses` (n,) has the number of sides that have each piece."""
        self.triangles += int(uses.sum())
        self._limits.count(self.triangles)


def build_depth_error() -> InvalidRequest:
    """The error for a tolerance that would need cells smaller than `cells.SHORTEST`."""
    return InvalidRequest(
        Issue(
            "tolerance_too_small",
            "The tolerance needs more divisions than double precision can tell apart.",
            "/tolerance",
            "a smaller tolerance",
            "a greater tolerance",
        )
    )
