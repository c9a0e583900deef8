"""When dividing has to stop: too deep, too many, too costly."""

from dataclasses import dataclass
from math import inf

from service.errors import InvalidRequest, Issue, TooLarge


@dataclass(slots=True)
class Budget:
    """What may be spent: triangles, and numbers that are worked on. The second runs down."""

    triangles: float = inf
    work: float = inf

    def spend(self, work: float) -> None:
        """Take work from the budget, or refuse."""
        self.work -= work
        if self.work < 0:
            raise TooLarge(
                Issue(
                    "too_costly",
                    "So fine a mesh takes more work than this service gives to one request.",
                    "/tolerance",
                    "more than the limit",
                    "a greater tolerance",
                )
            )

    def count(self, triangles: int) -> None:
        """Refuse what is certain to have so many triangles, if they are too many."""
        if triangles > self.triangles:
            raise TooLarge(
                Issue(
                    "too_many_triangles",
                    "So fine a mesh has more triangles than may be made.",
                    "/tolerance",
                    f"more than {self.triangles:.0f} triangles",
                    "a greater tolerance, or a greater limit",
                )
            )


def too_deep() -> InvalidRequest:
    """The places are too coarse for the tolerance."""
    return InvalidRequest(
        Issue(
            "tolerance_too_small",
            "The surface would have to be divided more often than numbers can tell its places.",
            "/tolerance",
            "a smaller one",
            "a greater tolerance",
        )
    )
