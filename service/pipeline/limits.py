"""Limits of one request: the size of its result, its memory and its work."""

import sys
from dataclasses import dataclass, replace

from service.errors import Issue, TooLarge


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of one request.

    Attributes
    ----------
    max_vertices, max_bytes : int
        The most vertices, and the most bytes, of a result.
    max_points : int
        The most points or rays of a query; closest points and rays have a lower limit of their own.
    max_multiplications : int
        The most multiplications for the method `de_casteljau`, for points, measures or sections,
        for a curve, or for a sweep along a curve; they take some seconds. A mesh by tolerance may
        take twice this number.
    max_patches : int
        The most Bézier patches of a lowered surface.
    max_memory : int
        The most bytes of memory, including the response.
    max_placed_faces : int
        The most faces of breps, if those of equal members of a group count each.
    max_mesh_faces : int
        The most faces of breps in a mesh, each surface of a group once: by the time of a request.
    """

    max_vertices: int = 4_500_000
    max_bytes: int = 256 << 20
    max_points: int = 250_000
    max_multiplications: int = 5_000_000_000
    max_patches: int = 1_000_000
    max_memory: int = sys.maxsize
    max_mesh_faces: int = sys.maxsize
    max_placed_faces: int = 1_000_000

    def check_bytes(
        self, byte_bound: int, where: str, message: str = "The response could become too large."
    ) -> None:
        """Refuse a response that may have more than `max_bytes` bytes.

        `where` is the JSON pointer to the cause.
        """
        if byte_bound > self.max_bytes:
            raise TooLarge(
                Issue(
                    "too_many_bytes",
                    message,
                    where,
                    f"up to {byte_bound} bytes",
                    f"at most {self.max_bytes}",
                )
            )

    def check_effort(self, count: int, message: str, where: str, instead: str) -> None:
        """Refuse work that may need more than `max_multiplications` multiplications.

        `where` is the JSON pointer to the cause; `instead` names requests that take less time.
        """
        if count > self.max_multiplications:
            raise TooLarge(
                Issue(
                    "too_costly",
                    message,
                    where,
                    f"up to {count} multiplications",
                    f"at most {self.max_multiplications}; {instead}",
                )
            )

    def check_memory(self, byte_bound: int, what: str, where: str, instead: str) -> None:
        """Refuse work that may take more than `max_memory` bytes.

        `what` names the work, `where` is the JSON pointer to the cause, and `instead` names
        requests that take less memory.
        """
        if byte_bound > self.max_memory:
            raise TooLarge(
                Issue(
                    "too_much_memory",
                    f"{what} would take more memory than this service has for one request.",
                    where,
                    f"up to {byte_bound} bytes",
                    f"at most {self.max_memory}; {instead}",
                )
            )


DEFAULT_LIMITS = Limits()


def check_count(count: int, max_count: int, unit: str, issue: Issue) -> None:
    """Refuse a count above `max_count`; the texts `got` and `needed` are added to the issue."""
    if count > max_count:
        raise TooLarge(replace(issue, got=f"{count} {unit}", needed=f"at most {max_count}"))


def check_items(code: str, count: int, max_count: int, where: str) -> None:
    """Refuse a query of more than `max_count` items; `code` is `too_many_` and their name."""
    items = code.removeprefix("too_many_")
    message = f"The query has more {items} than this service computes at once."
    check_count(count, max_count, items, Issue(code, message, where))
