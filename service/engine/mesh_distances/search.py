"""The largest distance of the points of some triangles A from other triangles B.

    D = max over p in A of min over T in B of |p − T|

The distance from one triangle T is a convex function of p. So on a convex piece P of A it is
nowhere larger than at a corner of P, and

    min over T of |p − T| ≤ min over T of max over corners c of P of |c − T|   for all p in P.

The search starts with the triangles A as pieces. It compares each piece with the triangle T that is
nearest to its centre. A piece whose bound is too large is cut along the edges of T, by planes
perpendicular to T: over T the bound is then exact, and the parts outside are compared with other
triangles. Where another triangle is nearer to a corner of a piece over T, the piece is cut where
both are equally near. Pieces that are much larger than T, or that are not cut by these planes, are
halved. A point whose distance is measured raises the lower bound of D, and a piece ends when its
upper bound is not much above the lower bound of D.

Proof in docs/proofs.md: "The largest distance between triangles".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices, unique_rows
from service.cancellation import checkpoint
from service.engine.mesh_distances.cutting import Cutter, halve
from service.engine.mesh_distances.nearest import measure_reach, search_slots
from service.engine.mesh_distances.polygons import Polygons, join_polygons
from service.engine.mesh_distances.tree import TriangleTree
from service.engine.vectors import UNIT, Vectors

EFFORT = 1 << 24
"""How many pieces are examined at most."""

BATCH = 1 << 12
"""The most pieces that are examined at once; it limits memory."""

MAX_CUTS = 96
"""A piece that has been cut this often is given up."""

CUT_ERROR = 16 * UNIT
"""In relation to the size of the coordinates: how far a cut moves a corner from its piece."""

SHARE = 0.75
"""The share of the allowed width of the interval at which pieces end; rounding needs the rest."""


@dataclass(frozen=True, eq=False, slots=True)
class LargestDistance:
    """An interval of the largest distance D of points of triangles A from triangles B.

    Attributes
    ----------
    low, high : float
        low ≤ D ≤ high.
    point : ndarray of float64, shape (3,)
        A point of A whose distance from B is at least `low`, but for the rounding of its
        coordinates.
    source, target : int
        The triangle of A with this point, and the nearest triangle of B.
    reached : bool
        Whether the interval is as narrow as it was to be, or as rounding allows.
    """

    low: float
    high: float
    point: FloatArray
    source: int
    target: int
    reached: bool


def bound_largest_distance(
    corners: FloatArray,
    tree: TriangleTree,
    *,
    relative_width: float,
    floor: float,
    effort: int = EFFORT,
) -> LargestDistance:
    """An interval of the largest distance of points of triangles from those of a tree.

    Parameters
    ----------
    corners : ndarray of float64, shape (s, 3, 3)
        The triangles A, s > 0.
    tree : TriangleTree
        The triangles B.
    relative_width : float
        The largest width of the interval as a share of its upper end, less than 1.
    floor : float
        An interval that is at most this wide is narrow enough, too.
    effort : int
        The most pieces that are examined; with fewer than are needed the interval is wider.

    Raises
    ------
    Cancelled, OutOfTime
    """
    if not len(corners):
        raise ValueError("The search needs a triangle.")
    return _Search(np.asarray(corners, np.float64), tree, relative_width, floor, effort).run()


class _Search:
    """One search; distances are in the coordinates of the tree.

    Attributes
    ----------
    low, high : float
        Bounds without rounding: of measured points, and of pieces that have ended.
    loss : float
        Bound of the errors of distances of pieces.
    """

    def __init__(
        self,
        corners: FloatArray,
        tree: TriangleTree,
        relative_width: float,
        floor: float,
        effort: int,
    ) -> None:
        self.tree, self.frames = tree, tree.frames
        self.relative_width, self.floor = relative_width, floor * tree.scale
        self.effort = effort
        points = corners.reshape(-1, 3) + 0.0  # equal rows have equal bits: no −0
        first, number = unique_rows(points)
        self.vertices = tree.to_frame(points[first])
        self.first, self.number = first, number.reshape(-1, 3)
        self.reach = measure_reach(self.vertices)
        self.loss = self.frames.bound_error(self.reach)
        self.loss += MAX_CUTS * CUT_ERROR * (self.reach + self.frames.reach)
        self.cutter = Cutter(self.frames, self.reach)
        self.low, self.high = -1.0, 0.0
        self.point, self.source, self.slot = self.vertices[:, 0], 0, 0

    def run(self) -> LargestDistance:
        """The interval."""
        slots, squares = search_slots(self.tree, self.vertices)
        self._raise_low(self.vertices, squares, slots, self.first // 3)
        self._search(slots, np.sqrt(squares))
        low, high = max(self.low - self.loss, 0.0), max(self.high, self.low) + self.loss
        scale = self.tree.scale
        return LargestDistance(
            low=low / scale,
            high=high / scale,
            point=self.tree.from_frame(self.point[:, np.newaxis])[0],
            source=self.source,
            target=int(self.tree.order[self.slot]),
            reached=high - low <= max(self.relative_width * high, self.floor, 4 * self.loss),
        )

    def _target(self) -> float:
        """Pieces whose bounds are at most this may end."""
        share = SHARE * self.relative_width
        return max(self.low / (1 - share), self.low + max(SHARE * self.floor, self.loss))

    def _raise_low(self, points: Vectors, squares: FloatArray, slots: Ints, source: Ints) -> None:
        """Use the distances of measured points (3, m) of triangles (m,) as lower bounds."""
        worst = int(squares.argmax())
        distance = float(np.sqrt(squares[worst]))
        if distance > self.low:
            self.low, self.point = distance, points[:, worst]
            self.source, self.slot = int(source[worst]), int(slots[worst])

    def _search(self, slots: Ints, distances: FloatArray) -> None:
        """Examine all triangles; `slots` and `distances` belong to the vertices."""
        waiting = list(row_slices(len(self.number), 1, BATCH))[::-1]
        stack: list[Polygons] = []
        while waiting or stack:
            checkpoint()
            # Small records of pieces are examined together, newer ones first.
            batch, count = [], 0
            while count < BATCH and (stack or waiting):
                part = stack.pop() if stack else self._begin(waiting.pop(), slots, distances)
                count += len(part)
                batch.append(part)
            pieces = join_polygons(batch)
            if count > BATCH:
                stack.append(pieces.take(np.arange(BATCH, count)))
                pieces = pieces.take(np.arange(BATCH))
            if not count:
                continue
            self.effort -= len(pieces)
            if self.effort < 0:
                self._end(self._bound(pieces))
            else:
                stack += [part for part in self._examine(pieces) if len(part)]

    def _begin(self, rows: slice, slots: Ints, distances: FloatArray) -> Polygons:
        """Pieces for the triangles `rows` that are not near enough to a triangle at a vertex."""
        number = self.number[rows]
        triangles, bounds = np.arange(rows.start, rows.stop), np.full(len(number), np.inf)
        for corner in range(3):
            slot = slots[number[:, corner]]
            bound = distances[number[:, corner]]
            for other in (number[:, corner - 2], number[:, corner - 1]):
                bound = np.maximum(bound, self._measure(self.vertices.take(other, axis=1), slot))
            np.minimum(bounds, bound, out=bounds)
            is_open = self._keep_open(bounds)
            triangles, bounds, number = triangles[is_open], bounds[is_open], number[is_open]
        count = len(triangles)
        return Polygons(
            self.vertices.take(number.ravel(), axis=1),
            np.full(count, 3),
            triangles,
            slots[number[:, 0]],
            np.zeros(count, np.intp),
        )

    def _measure(self, points: Vectors, slot: Ints) -> FloatArray:
        """The distances (m,) of points (3, m) from the triangles in slots (m,)."""
        distances: FloatArray = np.sqrt(self.frames.measure_squares(points, slot, self.reach))
        return distances

    def _bound(self, pieces: Polygons) -> FloatArray:
        """Bounds (m,) of the distances of all points of pieces, from the triangles near them."""
        return pieces.find_largest(self._measure(pieces.corners, pieces.slot.repeat(pieces.sizes)))

    def _end(self, bounds: FloatArray) -> None:
        """Count bounds (m,) of pieces that have ended."""
        self.high = max(self.high, float(bounds.max(initial=0.0)))

    def _keep_open(self, bounds: FloatArray) -> Bools:
        """Whether pieces with these bounds (m,) are examined further; the others end."""
        is_open = bounds > self._target()
        self._end(bounds[~is_open])
        return is_open

    def _filter(self, pieces: Polygons) -> Polygons:
        """The pieces that are examined further."""
        return pieces.select(self._keep_open(self._bound(pieces))) if len(pieces) else pieces

    def _examine(self, pieces: Polygons) -> list[Polygons]:
        """Compare pieces with the triangles near their centres; returns what remains of them."""
        centers = pieces.find_centers()
        slots, squares = search_slots(self.tree, centers, pieces.slot)
        self._raise_low(centers, squares, slots, pieces.source)
        pieces = self._filter(pieces.approach(slots))
        is_over = pieces.cuts >= MAX_CUTS
        if is_over.any():
            self._end(self._bound(pieces.select(is_over)))
            pieces = pieces.select(~is_over)
        if not len(pieces):
            return []
        is_large = self.cutter.is_large(pieces)
        is_apart = self.cutter.is_apart(pieces) & ~is_large
        if is_apart.any():
            # The triangle near the center has no part of the piece over it. Perhaps that one has,
            # which is nearest to the worst corner.
            pieces = pieces.approach(self._approach_corners(pieces, is_apart))
            is_apart &= self.cutter.is_apart(pieces)
        must_halve = is_large | is_apart
        parts = list(halve(pieces.select(must_halve))) if must_halve.any() else []
        inner = pieces.select(~must_halve)
        for edge in range(3):
            if not len(inner):
                break
            inner, outer = self.cutter.cut_edge(inner, edge)
            parts.append(self._filter(outer))
        return parts + self._divide_over(inner)

    def _approach_corners(self, pieces: Polygons, chosen: Bools) -> Ints:
        """Slots (m,): of chosen pieces, the triangles nearest to the corners with the bound."""
        slots, rows = pieces.slot.copy(), chosen.nonzero()[0]
        part = pieces.take(rows)
        own = self._measure(part.corners, part.slot.repeat(part.sizes))
        worst = part.corners.take(part.find_worst(own), axis=1)
        slots[rows], squares = search_slots(self.tree, worst, part.slot)
        self._raise_low(worst, squares, slots[rows], part.source)
        return slots

    def _divide_over(self, pieces: Polygons) -> list[Polygons]:
        """Divide pieces over the triangles near them where other triangles are nearer."""
        if not len(pieces):
            return []
        own = self._measure(pieces.corners, pieces.slot.repeat(pieces.sizes))
        is_open = self._keep_open(pieces.find_largest(own))
        pieces, own = pieces.select(is_open), own[is_open.repeat(pieces.sizes)]
        if not len(pieces):
            return []
        slots, squares = search_slots(self.tree, pieces.corners, pieces.slot.repeat(pieces.sizes))
        self._raise_low(pieces.corners, squares, slots, pieces.source.repeat(pieces.sizes))
        is_open = self._keep_open(pieces.find_largest(own))
        rows = is_open.repeat(pieces.sizes)
        slots, own = slots[rows], own[rows]
        pieces = pieces.select(is_open)
        if not len(pieces):
            return []
        # The other triangle is nearest to the corner that is furthest from the own triangle.
        worst = pieces.find_worst(own)
        return self.cutter.cut_between(pieces, slots[worst], worst)
