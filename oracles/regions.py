"""Regions of trimmed faces: which parameters are inside the loops of a face, by winding numbers.

A loop is a chain of pieces. A piece is the segment between two points and a radius, so that a part
of a parameter curve is within this radius of the segment. Straight pieces join curves where one
does not begin at the end of the one before. A place that no piece meets has the same winding number
about the curves as about the segments: curve and segment can be moved into each other within the
piece, which is convex. The winding number about the segments is computed in float64; where the
sign of a determinant is unsure, in rationals.

On a closed surface, copies of the loops are shifted by the period. A loop that runs around the
closed direction is completed to a polygon by the next loop in the opposite direction, or by the
border of the surface.
"""

from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracles.brep_documents import Array, Index, Net, read_surface
from oracles.coedges import iterate_coedges
from oracles.loop_chains import close_chains, list_pieces, measure_area

Bools: TypeAlias = NDArray[np.bool_]

ROUNDING = 2.0**-44
"""Radius that is added to each piece, as a share of the largest coordinate of the face."""

UNSURE = 2.0**-48
"""Determinants below this share of their terms are computed again in rationals."""

CLOSED = 1e-6
"""Share of the diagonal by which the two sides of a closed surface may differ."""


@dataclass(frozen=True, eq=False)
class Region:
    """The inside of the loops of a face.

    The pieces are in unit coordinates, (place − low) / size, so that the box of the loops is the
    unit square: `starts` and `ends` (n, 2), `radii` (n,). `box` (2, 2) has the lower and the upper
    corner of a rectangle that contains the inside, once if the surface is closed. A place is inside
    if its winding number about all segments plus `base` is 1 or more.
    """

    low: Array
    size: Array
    starts: Array
    ends: Array
    radii: Array
    box: Array
    base: int = 0

    def to_unit(self, places: Array) -> Array:
        """Parameters (..., 2) in unit coordinates."""
        unit: Array = (places - self.low) / self.size
        return unit

    def find_meetings(
        self, low: Array, high: Array, pairs: tuple[Index, Index] | None = None
    ) -> tuple[Index, Index]:
        """Pairs of a box and a piece that may meet: numbers of boxes (k,) and of pieces (k,).

        `low` and `high` (m, 2) are corners of boxes of parameters. Only `pairs` are tested, or else
        all pairs.
        """
        if pairs is None:
            box, piece = self._pair_boxes(low, high)
        else:
            box, piece = pairs
        a, b = self.to_unit(low), self.to_unit(high)
        middle, half = (a + b) / 2, (b - a) / 2
        start, along = self.starts[piece], (self.ends - self.starts)[piece]
        reach = half[box] + self.radii[piece][:, np.newaxis]
        offset = start + along / 2 - middle[box]
        meets: Bools = np.all(np.abs(offset) <= reach + np.abs(along) / 2, axis=1)
        # The axis across the segment.
        gap = np.abs(along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0])
        width = reach[:, 0] * np.abs(along[:, 1]) + reach[:, 1] * np.abs(along[:, 0])
        meets &= gap <= width * (1 + 1e-12) + 1e-300
        return box[meets], piece[meets]

    def _pair_boxes(self, low: Array, high: Array) -> tuple[Index, Index]:
        """Pairs of a box and a piece whose boxes meet."""
        more = self.radii[:, np.newaxis]
        first = np.minimum(self.starts, self.ends) - more
        last = np.maximum(self.starts, self.ends) + more
        a, b = self.to_unit(low), self.to_unit(high)
        block = max(1, 1_000_000 // max(1, len(first)))
        pairs = [
            np.nonzero(
                (first[:, 0] <= b[k : k + block, :1]) & (a[k : k + block, :1] <= last[:, 0])
                & (first[:, 1] <= b[k : k + block, 1:]) & (a[k : k + block, 1:] <= last[:, 1])
            )
            for k in range(0, len(low), block)
        ]  # fmt: skip
        boxes = [row + n * block for n, (row, _) in enumerate(pairs)]
        none = [np.empty(0, dtype=np.intp)]
        return np.concatenate(none + boxes), np.concatenate(none + [k for _, k in pairs])

    def find_inside(self, places: Array) -> tuple[Bools, Bools]:
        """Whether places (m, 2) are inside, and whether this is sure: no piece is at the place."""
        box, _ = self.find_meetings(places, places)
        is_sure = np.ones(len(places), bool)
        is_sure[box] = False
        return self.wind(places) + self.base >= 1, is_sure

    def wind(self, places: Array) -> Index:
        """Winding numbers (m,) of all segments about places (m, 2)."""
        points = self.to_unit(places)
        result = np.zeros(len(points), dtype=np.intp)
        block = max(1, 2_000_000 // max(1, len(self.starts)))
        for first in range(0, len(points), block):
            result[first : first + block] = self._wind(points[first : first + block])
        return result

    def _wind(self, points: Array) -> Index:
        y, low, high = points[:, 1, np.newaxis], self.starts[:, 1], self.ends[:, 1]
        upward, downward = (low <= y) & (y < high), (high <= y) & (y < low)
        row, k = np.nonzero(upward | downward)
        a, b, p = self.starts[k], self.ends[k], points[row]
        first, second = (
            (b[:, 0] - a[:, 0]) * (p[:, 1] - a[:, 1]),
            (p[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1]),
        )
        determinant = first - second
        sign = np.sign(determinant).astype(np.intp)
        for i in np.flatnonzero(np.abs(determinant) <= UNSURE * (np.abs(first) + np.abs(second))):
            sign[i] = find_turn(a[i], b[i], p[i])
        steps = np.where(upward[row, k], sign > 0, -(sign < 0).astype(np.intp))
        totals: Index = np.bincount(row, weights=steps, minlength=len(points)).astype(np.intp)
        return totals


def find_turn(a: Array, b: Array, p: Array) -> int:
    """The sign of the determinant (b − a) × (p − a), without rounding."""
    (ax, ay), (bx, by), (px, py) = ([Fraction(float(x)) for x in q] for q in (a, b, p))
    determinant = (bx - ax) * (py - ay) - (px - ax) * (by - ay)
    return (determinant > 0) - (determinant < 0)


def build_region(brep: dict[str, Any], face: int, flatness: float = 1e-4) -> Region | None:
    """The region of a face of a brep document; None if the face has no loops.

    Where a parameter curve is further from its edge than the uncertainty of the document, it is
    traced along the edge. Radii of pieces are at most `flatness` of the box of the loops. Raises
    ValueError if a parameter curve is missing and the surface is no parallelogram, from which it
    would follow.
    """
    entry = brep["faces"][face]
    if not entry.get("loops"):
        return None
    net = read_surface(entry["surface"])
    loops = [list(iterate_coedges(brep, entry, loop, net, flatness)) for loop in entry["loops"]]
    points = np.concatenate([coedge.curve.points for loop in loops for coedge in loop])
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.where(high > low, high - low, 1.0)
    rounding = ROUNDING * (1 + float((np.abs(points).max(axis=0) / size).max()))
    chains = [
        list_pieces(
            [
                (each.curve, each.is_reversed, rounding + (flatness if each.is_traced else 0))
                for each in loop
            ],
            low=low,
            size=size,
            flatness=flatness,
        )
        for loop in loops
    ]
    domain = net.domain
    period = np.where(find_closed(net), np.ptp(domain, axis=1), np.inf) / size
    first, last = (domain.T - low) / size
    polygons = close_chains(chains, period, first, last)
    pieces = np.concatenate(polygons)
    area = sum(float(measure_area(each)) for each in polygons)
    ends = pieces[:, :4].reshape(-1, 2)
    box = np.stack([ends.min(axis=0), ends.max(axis=0)])
    if (period < np.inf).any():
        box = np.where(period < np.inf, [first, last], box)
        shifts = [np.array([-1, 0, 1]) * x if x < np.inf else np.zeros(1) for x in period]
        moved = [pieces + np.array([x, y, x, y, 0.0]) for x, y in product(*shifts)]
        near = [
            each
            for each in moved
            if (np.maximum(each[:, :2], each[:, 2:4]).max(axis=0) >= first - 0.01).all()
            and (np.minimum(each[:, :2], each[:, 2:4]).min(axis=0) <= last + 0.01).all()
        ]
        pieces = np.concatenate(near)
    return Region(low, size, pieces[:, :2], pieces[:, 2:4], pieces[:, 4], box, int(area < 0))


def find_closed(net: Net) -> Bools:
    """Whether the surface is closed along u, and along v."""
    result = np.zeros(2, bool)
    for axis in range(2):
        ends, share = net.domain, np.linspace(0, 1, 9)
        sides = []
        for end in range(2):
            places = np.empty((9, 2))
            places[:, axis] = ends[axis, end]
            places[:, 1 - axis] = ends[1 - axis, 0] + share * np.ptp(ends[1 - axis])
            sides.append(net.at(np.clip(places, ends[:, 0], ends[:, 1])))
        result[axis] = np.abs(sides[1] - sides[0]).max() <= CLOSED * net.diagonal
    return result
