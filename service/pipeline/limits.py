"""How large, and how long, a result may become."""

import sys
from dataclasses import dataclass, replace

from service.errors import Issue, TooLarge


@dataclass(frozen=True, slots=True)
class Limits:
    """The largest result that is computed: vertices, bytes of one response, points of a query.

    `max_patches` are those that a surface may become; `max_memory` are the bytes that one piece of
    work may take, its response included. `max_multiplications` is the most that the method
    `de_casteljau`, a query, a curve, or a sweep along curves may take: some seconds; a mesh by
    tolerance may take twice as many.
    """

    max_vertices: int = 4_500_000
    max_bytes: int = 256 << 20
    max_points: int = 250_000
    max_multiplications: int = 5_000_000_000
    max_patches: int = 1_000_000
    max_memory: int = sys.maxsize

    def check_bytes(self, most: int, message: str, where: str) -> None:
        """Refuses a response of more bytes than are allowed; `where`: the pointer of the cause."""
        if most > self.max_bytes:
            needed = f"at most {self.max_bytes}"
            raise TooLarge(Issue("too_many_bytes", message, where, f"up to {most} bytes", needed))

    def check_effort(self, count: int, message: str, where: str, instead: str) -> None:
        """Refuses what may take too long; `instead` is what would take less."""
        if count > self.max_multiplications:
            needed = f"at most {self.max_multiplications}; {instead}"
            got = f"up to {count} multiplications"
            raise TooLarge(Issue("too_costly", message, where, got, needed))

    def check_memory(self, most: int, what: str, where: str, instead: str) -> None:
        """Refuses `what` may take too much memory; `instead` is what would take less."""
        if most > self.max_memory:
            message = f"{what} would take more memory than this service has for one request."
            needed = f"at most {self.max_memory}; {instead}"
            raise TooLarge(Issue("too_much_memory", message, where, f"up to {most} bytes", needed))


DEFAULT_LIMITS = Limits()


def check_count(count: int, most: int, unit: str, issue: Issue) -> None:
    """Refuses a count above `most`, as the issue says; it gets what was got and needed."""
    if count > most:
        raise TooLarge(replace(issue, got=f"{count} {unit}", needed=f"at most {most}"))
