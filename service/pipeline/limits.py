"""How large, and how long, a result may become."""

from dataclasses import dataclass


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


DEFAULT_LIMITS = Limits()
