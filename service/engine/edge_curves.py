"""Distinct edges, as curves."""

from dataclasses import dataclass

from service.bases.arrays import Bools, FloatArray, Ints


@dataclass(frozen=True, eq=False, slots=True)
class EdgeCurves:
    """Distinct edges of one degree n: Bézier curves in their canonical direction.

    `ids` (E,), `points` (E, n+1, 3), `weights` (E, n+1) or None; the largest weight of each is 1.
    `turned` (E,) tells which edges count their samples against that direction; None if none does.
    """

    ids: Ints
    points: FloatArray
    weights: FloatArray | None
    turned: Bools | None = None

    def take(self, chosen: Bools) -> "EdgeCurves":
        """Some of the edges, as `chosen` (E,) tells; mostly all."""
        if chosen.all():
            return self
        weights = None if self.weights is None else self.weights[chosen]
        turned = None if self.turned is None else self.turned[chosen]
        return EdgeCurves(self.ids[chosen], self.points[chosen], weights, turned)
