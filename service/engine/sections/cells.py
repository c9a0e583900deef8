"""Cells of patches in which the section is known: found by halving, no loop is lost.

Theorem. Let f be the polynomial of `heights` over a rectangle.

1. If all coefficients of f are positive, or all negative, the section does not meet the rectangle.
   If none is negative, or none positive, it meets at most the border of the rectangle: whole sides
   whose coefficients are zero, and corners.
2. If no coefficient of ∂f/∂v is negative and not all are zero, f increases in v wherever u is in
   the open interval. So the section has at most one point at each u: it is the graph of v over u,
   without a loop, and all its ends lie on the border. In the order of u, the points where it
   crosses the border are in turn beginnings and ends of pieces. Likewise for decreasing f, and for
   ∂f/∂u with the graph of u over v.

Proof. A Bézier polynomial is a mean of its coefficients, with factors that are all positive in the
open rectangle and, on a side, for the coefficients of that side. For the second part, f(u, ·) is
monotone, so that the piece over u exists exactly where f(u, v₀) and f(u, v₁) have two signs: there
is a crossing of the border wherever that begins or ends. ∎

A cell of neither kind is halved in both directions. A graph is halved along itself until each of
its pieces is within the tolerance of its chord (`flatness`), as are sides that lie in the plane.
What is still open at the size `FINEST`, or at a part of the tolerance where cells of one patch are
so many that they must lie along a curve, is *singular*: near it the surface touches the plane, or
the section crosses itself.

Rounding. Halving takes means of two numbers: after k levels in each direction coefficients are off
by at most 2 k (p + q) u max |f|, which is below `NOISE` for the depths and degrees at hand, or
1e-13 of the size of the model for high ones. In other words, each cell has the exact section of a
surface that is off by so much along n.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.queries.cells import halved
from service.engine.queries.nets import NetGroup
from service.engine.sections.borders import ONE
from service.engine.sections.flatness import Pieces, is_zero, piece_bounds, side_bounds
from service.engine.sections.heights import NOISE, LocalPlanes, height_nets
from service.engine.sections.roots import roots
from service.surface.sides import take_side

OVER_U, OVER_V, BELOW, ABOVE, SINGULAR, COPLANAR = range(6)
"""Kinds of cells: the graph of v over u, of u over v; f ≤ 0, f ≥ 0; open; in the plane."""

FINEST = 2.0**-20
"""Size of singular cells, in the coordinates of the nets: heights in them are about `THICKNESS`."""

CROWD = 128
"""Open cells of one patch that lie along a curve, and are not halved below a part of the tolerance:
`SHARE`. Around a point where a section crosses itself there are some 16."""

SHARE = 1 / 8


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """Cells of pairs of a plane and a net, n in number, all of nets of one group.

    Attributes
    ----------
    plane, net, kind : ndarray of int, shape (n,)
    place : ndarray of int, shape (4, n)
        u₀, u₁, v₀, v₁ in units of 1 / `ONE`.
    sense : ndarray of float64, shape (n,)
        1 where a graph runs towards larger parameters when f > 0 lies to its left, −1 where to
        smaller; 0 for other kinds.
    floor : ndarray of float64, shape (n,)
        Numbers f that are taken for zero, as of `roots`.
    rows : tuple of ndarray of float64
        f along the four sides, (n, q+1) twice and (n, p+1) twice.
    """

    plane: Ints
    net: Ints
    kind: Ints
    place: Ints
    sense: FloatArray
    floor: FloatArray
    rows: tuple[FloatArray, FloatArray, FloatArray, FloatArray]


@dataclass(eq=False, slots=True)
class CellSearch:
    """The search for the cells of one group of nets.

    Attributes
    ----------
    tolerance : float
        In the coordinates of the nets.
    allow : callable
        Is told how many cells there are at least; raises if these are too many.
    deviation : float
        Largest bound of the distance of a piece from its chord.
    """

    group: NetGroup
    planes: LocalPlanes
    tolerance: float
    allow: Callable[[int], None]
    deviation: float = 0.0
    _ended: list[Cells] = field(default_factory=list)

    def find(self, plane: Ints, net: Ints) -> tuple[Cells, Bools]:
        """The cells of pairs that the section meets, and which pairs (m,) are coplanar."""
        nets, floor, coplanar = height_nets(self.group, self.planes, plane, net)
        place = np.zeros((4, len(plane)), np.int64)
        place[1], place[3] = ONE, ONE
        opened = _Open(np.arange(len(plane)), plane, net, place, nets, coplanar, floor)
        held = 0
        while len((opened := opened.take(_is_near(opened))).pair):
            checkpoint()
            kind, sense, both = classify(opened.nets)
            checkpoint()
            kind[opened.coplanar] = COPLANAR
            along_u, along_v = self._to_halve(opened, kind, both)
            ends = ~(along_u | along_v)
            held += int(np.count_nonzero(ends))
            self.allow(held + len(opened.pair))
            self._end(opened.take(ends), kind[ends], sense[ends])
            opened = _halves(opened, along_u, along_v)
        return _joined(self._ended), coplanar

    def _to_halve(self, cells: "_Open", kind: Ints, both: Bools) -> tuple[Bools, Bools]:
        """Which cells are halved along u, and along v."""
        long = cells.place[1::2] - cells.place[::2]
        can = long > 1
        is_open = kind == SINGULAR
        size = self._sizes(cells, long)
        crowded = np.bincount(cells.pair[is_open], minlength=1)
        crowd = np.zeros(len(size), bool)
        crowd[is_open] = crowded[cells.pair[is_open]] > CROWD
        is_open &= size > np.where(crowd, self.tolerance * SHARE, FINEST)
        along = np.stack([is_open, is_open])
        for axis in (OVER_U, OVER_V):
            rows = np.flatnonzero(kind == axis)
            if not len(rows):
                continue
            flat, wide = self._are_flat(cells.take(rows), axis, both[rows])
            along[axis, rows], along[1 - axis, rows] = ~flat, ~flat & wide
        for side in range(4):
            checkpoint()
            axis = 1 - side // 2
            is_flat = is_zero(take_side(cells.nets, side)) & (kind != SINGULAR)
            # Within a patch that lies in the plane nothing is drawn.
            is_flat &= (kind != COPLANAR) | (cells.place[side] == (side % 2) * ONE)
            rows = np.flatnonzero(is_flat & ~along[axis])
            if len(rows):
                along[axis, rows] = ~self._have_flat_side(cells.take(rows), side, axis)
        along &= can
        return along[0], along[1]

    def _sizes(self, cells: "_Open", long: Ints) -> FloatArray:
        """About the sizes of cells on the surface."""
        points = self.group.nets[..., :3]
        if self.group.is_rational:
            points = points / self.group.nets[..., 3:]
        speeds = []
        for axis in (1, 2):
            steps = np.abs(np.diff(points, axis=axis)).max(axis=(1, 2, 3))
            speeds.append(steps * (points.shape[axis] - 1))
        net = cells.net - self.group.first
        return np.asarray((speeds[0][net] * long[0] + speeds[1][net] * long[1]) / ONE)

    def _are_flat(self, cells: "_Open", axis: int, both: Bools) -> tuple[Bools, Bools]:
        """Which graphs over one parameter are near enough to their chords, all of their pieces.

        And of which the other parameter may be any in the cell.
        """
        cell, place = crossings(cells.nets, cells.floor, cells.place / ONE, axis)
        first, second = cell[::2], place[::2]
        last = place[1::2]
        low = np.stack([cells.place[0], cells.place[2]], axis=1)[first] / ONE
        high = np.stack([cells.place[1], cells.place[3]], axis=1)[first] / ONE
        low[:, axis], high[:, axis] = second[:, axis], last[:, axis]
        across = 1 - axis
        # |dv/du| ≤ max |f_u| / min |f_v| = K: v is at most K Δu / 2 from the mean of its ends.
        middle = (second[:, across] + last[:, across]) / 2
        wide = _steepest(cells, axis)[first] * (last[:, axis] - second[:, axis]) / 2 + 2.0**-50
        low[:, across] = np.maximum(low[:, across], middle - wide)
        high[:, across] = np.minimum(high[:, across], middle + wide)
        tight = both[first]
        low[tight] = np.minimum(second[tight], last[tight])
        high[tight] = np.maximum(second[tight], last[tight])
        kinds = np.where(tight, 2, axis)
        pieces = Pieces(cells.plane[first], cells.net[first], second, last, low, high, kinds)
        bound, slack = piece_bounds(self.group, self.planes, pieces)
        checkpoint()
        worst = np.zeros(len(cells.pair))
        # What rounding adds does not become smaller: half of the tolerance is left for the rest.
        needed = np.minimum(slack, self.tolerance / 2) + bound
        np.maximum.at(worst, first, needed)
        is_wide = np.zeros(len(worst), bool)
        is_wide[first] = (high - low)[:, across] * ONE >= cells.place[2 * across + 1, first] - (
            cells.place[2 * across, first]
        )
        long = cells.place[2 * axis + 1] - cells.place[2 * axis]
        flat = self._are_small(worst, long)
        self._note((bound + slack)[flat[first]])
        return flat, is_wide & ~both

    def _have_flat_side(self, cells: "_Open", side: int, axis: int) -> Bools:
        low = np.stack([cells.place[0], cells.place[2]], axis=1) / ONE
        high = np.stack([cells.place[1], cells.place[3]], axis=1) / ONE
        low[:, 1 - axis] = high[:, 1 - axis] = cells.place[side] / ONE
        long = cells.place[2 * axis + 1] - cells.place[2 * axis]
        bounds = side_bounds(self.group, cells.net, low, high, axis)
        flat = self._are_small(bounds, long)
        self._note(bounds[flat])
        return flat

    def _are_small(self, bounds: FloatArray, long: Ints) -> Bools:
        """Which bounds are small enough, or of cells that cannot be halved."""
        return np.asarray((bounds <= self.tolerance) | (long <= 1))

    def _note(self, bounds: FloatArray) -> None:
        """Keeps the largest bound."""
        self.deviation = max(self.deviation, float(bounds.max(initial=0.0)))

    def _end(self, cells: "_Open", kind: Ints, sense: FloatArray) -> None:
        if len(kind):
            checkpoint()
            a, b, c, d = (take_side(cells.nets, side).copy() for side in range(4))
            rows = a, b, c, d
            self._ended.append(
                Cells(cells.plane, cells.net, kind, cells.place, sense, cells.floor, rows)
            )


@dataclass(frozen=True, eq=False, slots=True)
class _Open:
    """Cells that are looked at: their pairs, and f over them (n, p+1, q+1)."""

    pair: Ints
    plane: Ints
    net: Ints
    place: Ints
    nets: FloatArray
    coplanar: Bools
    floor: FloatArray

    def take(self, rows: Ints | Bools) -> "_Open":
        """Some of the cells."""
        return _Open(
            self.pair[rows],
            self.plane[rows],
            self.net[rows],
            self.place[:, rows],
            self.nets[rows],
            self.coplanar[rows],
            self.floor[rows],
        )


def _is_near(cells: _Open) -> Bools:
    """Which cells the section may meet, rounding included."""
    low, high = cells.nets.min(axis=(1, 2)), cells.nets.max(axis=(1, 2))
    return np.asarray((low <= NOISE) & (high >= -NOISE))


def classify(nets: FloatArray) -> tuple[Ints, FloatArray, Bools]:
    """Kinds of cells (n,) by the theorem, senses (n,), and which graphs are monotone (n,).

    `nets` are the coefficients of f, (n, p+1, q+1).
    """
    count = len(nets)
    kind, sense = np.full(count, SINGULAR), np.zeros(count)
    steepest, graphs = np.zeros(count), np.zeros(count, np.intp)
    for axis, which in ((1, OVER_V), (2, OVER_U)):
        steps = np.diff(nets, axis=axis).reshape(count, -1)
        low, high = steps.min(axis=1), steps.max(axis=1)
        rises, falls = (low >= 0) & (high > 0), (high <= 0) & (low < 0)
        slope = np.abs(steps.mean(axis=1)) * (nets.shape[axis] - 1)
        better = (rises | falls) & (slope >= steepest)
        graphs += rises | falls
        steepest[better] = slope[better]
        kind[better] = which
        # To the left of (f_v, −f_u) in the plane of parameters f is larger.
        sense[better] = np.where(rises == (which == OVER_U), 1.0, -1.0)[better]
    flat = nets.reshape(count, -1)
    for which, is_one in ((ABOVE, flat.min(axis=1) >= 0), (BELOW, flat.max(axis=1) <= 0)):
        kind[is_one], sense[is_one] = which, 0.0
    return kind, sense, graphs == 2


def crossings(
    nets: FloatArray, floor: FloatArray, place: FloatArray, axis: int
) -> tuple[Ints, FloatArray]:
    """Where graphs cross the borders of their cells.

    Parameters
    ----------
    nets : ndarray of float64, shape (n, p+1, q+1)
    floor : ndarray of float64, shape (n,)
        As of `roots`.
    place : ndarray of float64, shape (4, n)
    axis : int
        0 for graphs over u, 1 over v.

    Returns
    -------
    cell : ndarray of int, shape (k,)
        Ascending; each cell an even number of times.
    place : ndarray of float64, shape (k, 2)
        Parameters (u, v), ascending along the axis for each cell.
    """
    cells, places = [], []
    for side in range(4):
        row, t = roots(take_side(nets, side), floor)
        across, along = side // 2, 1 - side // 2
        where = np.empty((len(row), 2))
        low, high = place[2 * along, row], place[2 * along + 1, row]
        where[:, across], where[:, along] = place[side, row], low + t * (high - low)
        cells.append(row)
        places.append(where)
    cell, where = np.concatenate(cells), np.concatenate(places)
    checkpoint()
    order = np.lexsort((where[:, axis], cell))
    return cell[order], where[order]


def _steepest(cells: _Open, axis: int) -> FloatArray:
    """A bound (n,) of the slopes of graphs over one parameter, infinite where there is none."""
    steps = []
    for each in (0, 1):
        long = cells.place[2 * each + 1] - cells.place[2 * each]
        steps.append(np.diff(cells.nets, axis=each + 1).reshape(len(long), -1))
        steps[-1] = np.abs(steps[-1]) * (cells.nets.shape[each + 1] - 1) / long[:, np.newaxis]
    least = steps[1 - axis].min(axis=1)
    most = steps[axis].max(axis=1)
    return np.where(least > 0, most / np.where(least > 0, least, 1.0), 1e300)


def _halves(cells: _Open, along_u: Bools, along_v: Bools) -> _Open:
    """The halves and quarters of cells that are halved."""
    parts = []
    for on_u, on_v in ((True, False), (False, True), (True, True)):
        some = cells.take(np.flatnonzero((along_u == on_u) & (along_v == on_v)))
        pieces = [some] if len(some.pair) else []
        for axis, is_on in ((0, on_u), (1, on_v)):
            if is_on:
                checkpoint()
                pieces = [half for each in pieces for half in _halved(each, axis)]
        parts += pieces
    checkpoint()
    if not parts:
        return cells.take(np.zeros(0, np.intp))
    return _Open(
        np.concatenate([part.pair for part in parts]),
        np.concatenate([part.plane for part in parts]),
        np.concatenate([part.net for part in parts]),
        np.concatenate([part.place for part in parts], axis=1),
        np.concatenate([part.nets for part in parts]),
        np.concatenate([part.coplanar for part in parts]),
        np.concatenate([part.floor for part in parts]),
    )


def _halved(cells: _Open, axis: int) -> tuple[_Open, _Open]:
    halves = []
    middle = (cells.place[2 * axis] + cells.place[2 * axis + 1]) // 2
    for end, nets in enumerate(halved(cells.nets[..., np.newaxis], axis + 1)):
        place = cells.place.copy()
        place[2 * axis + 1 - end] = middle
        halves.append(replace(cells, place=place, nets=nets[..., 0]))
    return halves[0], halves[1]


def _joined(parts: list[Cells]) -> Cells:
    if not parts:
        none, rows = np.zeros(0, np.intp), np.zeros((0, 2))
        return Cells(
            none, none, none, np.zeros((4, 0), np.int64), rows[:, 0], rows[:, 0], (rows,) * 4
        )
    a, b, c, d = (np.concatenate([part.rows[side] for part in parts]) for side in range(4))
    return Cells(
        np.concatenate([part.plane for part in parts]),
        np.concatenate([part.net for part in parts]),
        np.concatenate([part.kind for part in parts]),
        np.concatenate([part.place for part in parts], axis=1),
        np.concatenate([part.sense for part in parts]),
        np.concatenate([part.floor for part in parts]),
        (a, b, c, d),
    )
