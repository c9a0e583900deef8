"""Limits of one request: the size of its result, its memory and its work."""

import sys
from dataclasses import dataclass, replace

from service.errors import Issue, TooLarge


@dataclass(frozen=True, slots=True)
class Limits:
    """The most that one request may take.

    Attributes
    ----------
    max_vertices, max_bytes : int
        Vertices and bytes of a result.
    max_points : int
        Points of a query.
    max_multiplications : int
        Multiplications of the method `de_casteljau`, a query, a curve, or a sweep along curves:
        some seconds of work. A mesh by tolerance may take twice as many.
    max_patches : int
        Bézier patches of a lowered surface.
    max_memory : int
        Bytes of memory, the response included.
    """

    max_vertices: int = 4_500_000
    max_bytes: int = 256 << 20
    max_points: int = 250_000
    max_multiplications: int = 5_000_000_000
    max_patches: int = 1_000_000
    max_memory: int = sys.maxsize

    def check_bytes(self, most: int, message: str, where: str) -> None:
        """Refuses a response of more bytes than are allowed; `where` points to the cause."""
        if most > self.max_bytes:
            needed = f"at most {self.max_bytes}"
            raise TooLarge(Issue("too_many_bytes", message, where, f"up to {most} bytes", needed))

    def check_effort(self, count: int, message: str, where: str, instead: str) -> None:
        """Refuses work that may take too long; `instead` names requests that take less."""
        if count > self.max_multiplications:
            needed = f"at most {self.max_multiplications}; {instead}"
            got = f"up to {count} multiplications"
            raise TooLarge(Issue("too_costly", message, where, got, needed))

    def check_memory(self, most: int, what: str, where: str, instead: str) -> None:
        """Refuses work that may take too much memory.

        `what` names the work, `instead` names requests that take less.
        """
        if most > self.max_memory:
            message = f"{what} would take more memory than this service has for one request."
            needed = f"at most {self.max_memory}; {instead}"
            raise TooLarge(Issue("too_much_memory", message, where, f"up to {most} bytes", needed))


DEFAULT_LIMITS = Limits()


def check_count(count: int, most: int, unit: str, issue: Issue) -> None:
    """Refuses a count above `most` with the issue, to which it adds `got` and `needed`."""
    if count > most:
        raise TooLarge(replace(issue, got=f"{count} {unit}", needed=f"at most {most}"))
