"""How large, and how long, a result may become."""

from dataclasses import dataclass

from service.errors import Issue, TooLarge


@dataclass(frozen=True, slots=True)
class Limits:
    """The largest result that is computed: vertices, bytes of one answer, points of a query.

    `max_multiplications` is the most that the method `de_casteljau`, a query, a curve, or what is
    swept along curves may take: seconds.
    """

    max_vertices: int = 4_500_000
    max_bytes: int = 256 << 20
    max_points: int = 250_000
    max_multiplications: int = 5_000_000_000

    def check_bytes(self, most: int, message: str, where: str) -> None:
        """Refuses an answer that may have more bytes than are allowed; `where` asked for it."""
        if most > self.max_bytes:
            needed = f"at most {self.max_bytes}"
            raise TooLarge(Issue("too_many_bytes", message, where, f"up to {most} bytes", needed))

    def check_effort(self, count: int, message: str, where: str, instead: str) -> None:
        """Refuses what may take too long; `instead` is what would take less."""
        if count > self.max_multiplications:
            needed = f"at most {self.max_multiplications}; {instead}"
            got = f"up to {count} multiplications"
            raise TooLarge(Issue("too_costly", message, where, got, needed))


DEFAULT_LIMITS = Limits()
