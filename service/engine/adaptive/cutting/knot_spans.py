"""Cells of several knot spans: flat neighbouring patches stay together.

Such a cell is looked at through the nets of its spans, of nine points each and of what is left of
them without their biquadratic part (see `estimate`). So a level of cells
costs as much as it has spans, and nothing between the spans' corners is missed.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.cutting.cells import Cells, Leaves
from service.engine.adaptive.cutting.estimate import (
    NEARLY,
    CellEstimates,
    Planes,
    build_forms,
    choose_directions,
    find_allowed,
    find_planes,
    measure_remainder,
    measure_sag,
)
from service.engine.adaptive.cutting.halving import evaluate_nine_points, restrict
from service.engine.adaptive.cutting.halving import project as points_of
from service.engine.adaptive.cutting.normal_variation import (
    FINEST,
    estimate_normals,
    find_chord,
    find_height_limit,
)
from service.engine.adaptive.cutting.task import Task
from service.engine.bounds.faces import SPAN
from service.engine.bounds.vectors import Vectors, dot, dots, length

BLOCK = 1 << 14
"""Spans that are looked at together, about."""

AHEAD = 1 << 8
"""Spans up to which cells, their halves, halves of these, … are looked at in one step."""

FEW = [0, 4]
"""Of nine points, those that tell whether a cell of many spans is far from flat."""


@dataclass(frozen=True, eq=False, slots=True)
class _Pieces:
    """N pieces of m cells: what each cell has of each of its spans, cell after cell, v fastest.

    Attributes
    ----------
    whole, own : Cells
        The cells, and the pieces as cells of one span.
    cell : ndarray of int, shape (N,)
        The cell of each piece.
    start, end, width : ndarray of int, shape (m,)
        The first and the last piece of each cell, and how many it has along v.
    """

    whole: Cells
    own: Cells
    cell: Ints
    start: Ints
    end: Ints
    width: Ints

    def worst(self, values: FloatArray) -> FloatArray:
        """The greatest of the values (…, N) in every cell, (…, m)."""
        greatest: FloatArray = np.maximum.reduceat(values, self.start, axis=-1)
        return greatest

    def lines(self) -> tuple[tuple[Ints, Ints], tuple[Ints, Ints]]:
        """The pieces at both ends of the line along u, and of that along v, on which each is."""
        number = np.arange(len(self.cell)) - self.start[self.cell]
        width = self.width[self.cell]
        across = number % width
        first = self.start[self.cell] + number - across
        return (
            (self.start[self.cell] + across, (self.end - self.width + 1)[self.cell] + across),
            (first, first + width - 1),
        )


def divide_spans(task: Task, start: Cells) -> tuple[list[Leaves], list[Cells]]:
    """Leaves of several spans, and the cells of one span that are left to be looked at."""
    leaves: list[Leaves] = []
    rest: list[Cells] = []
    known = _Known(task)
    waiting = [start]
    while waiting:
        cells = waiting.pop()
        while waiting and len(cells) + len(waiting[-1]) <= BLOCK:
            cells = Cells.concatenate([cells, waiting.pop()])
        counts = np.cumsum(_counts(cells))
        fitting = max(1, int(np.searchsorted(counts, BLOCK, side="right")))
        if fitting < len(cells):
            waiting.append(cells.take(slice(fitting, None)))
            cells = cells.take(slice(fitting))
        levels = _levels(cells)
        every = Cells.concatenate([own.cells for own in levels])
        verdict = _examined(task, every, known)
        here, done = np.arange(len(cells)), []
        for own in levels:
            fails = verdict.fails[here]
            done.append(here[~fails])
            cut = here[fails]
            along_v = verdict.along_v[cut]
            cut -= own.begin
            if own.halves is None:
                last = own.cells.take(cut)
                both = Cells.concatenate([*last.halve(_crosswise(last, along_v))])
                several = _counts(both) > 1
                rest.append(both.take(~several))
                if several.any():
                    waiting.append(both.take(several))
            else:
                half = cut + 2 * len(own.cells) * along_v
                half = np.concatenate([half, half + len(own.cells)])
                here = own.number[half]
                rest.append(own.halves.take(half[here < 0]))
                here = here[here >= 0]
        found = Leaves(every, verdict.along_v, verdict.rising, verdict.form)
        leaves.append(found.take(np.concatenate(done)))
    return leaves, rest


@dataclass(frozen=True, eq=False, slots=True)
class _Level:
    """Cells of several spans, the first of which is number `begin` of all that are examined.

    `halves` are all of theirs: across u, first and second ones, and across v; `number` says which
    of those that are examined each is, −1 if it has one span. The last level has none.
    """

    begin: int
    cells: Cells
    halves: Cells | None
    number: Ints


def _levels(cells: Cells) -> list[_Level]:
    """Few cells, then their halves, halves of these, …: a step takes as long for many of them."""
    found: list[_Level] = []
    begin, total, none = 0, int(_counts(cells).sum()), np.empty(0, dtype=np.intp)
    while len(cells) and (more := 2 * int(_counts(cells).sum())) + total <= AHEAD:
        directions = (_crosswise(cells, np.full(len(cells), axis == 1)) for axis in (0, 1))
        halves = Cells.concatenate([half for own in directions for half in cells.halve(own)])
        several = _counts(halves) > 1
        begin, before = begin + len(cells), begin
        number = np.where(several, begin - 1 + np.cumsum(several), -1)
        found.append(_Level(before, cells, halves, number))
        cells, total = halves.take(several), total + more
    return [*found, _Level(begin, cells, None, none)]


def _counts(cells: Cells) -> Ints:
    """How many spans cells have a part of, shape (m,)."""
    along_u, along_v = _along(cells)
    counts: Ints = along_u * along_v
    return counts


def _along(cells: Cells) -> Ints:
    """How many spans cells have a part of along u and along v: shape (2, m)."""
    counts: Ints = -(-cells.box[1::2] // SPAN) - cells.box[::2] // SPAN
    return counts


def _pieces(cells: Cells) -> _Pieces:
    along_u, along_v = _along(cells)
    count = along_u * along_v
    end = np.cumsum(count)
    start = end - count
    cell = np.repeat(np.arange(len(cells)), count)
    number, width = np.arange(len(cell)) - start[cell], along_v[cell]
    box = cells.box[:, cell]
    low, high = box[::2], box[1::2]
    begin = (low // SPAN + np.array([number // width, number % width])) * SPAN
    own = np.empty_like(box)
    np.maximum(low, begin, out=own[::2])
    np.minimum(high, begin + SPAN, out=own[1::2])
    return _Pieces(cells, Cells(cells.face[cell], own), cell, start, end - 1, along_v)


def _nets(task: Task, own: Cells, wanted: Ints) -> Iterator[tuple[FloatArray, Ints]]:
    """Nets of the wanted pieces, a group and a block at a time, and which pieces they are."""
    patch = task.find_patches(own)
    for nets, here in task.patch_nets.split_by_group(patch[wanted]):
        block = max(16, BLOCK * 16 // nets.values[..., 0].size)
        for k in range(0, len(here), block):
            some = wanted[here[k : k + block]]
            net = restrict(nets, task.patch_nets.row[patch[some]], own.take(some))
            task.limits.spend(net.size)
            yield net, some


class _Known:
    """Nine points of whole spans, which are computed once, however often these are looked at."""

    def __init__(self, task: Task) -> None:
        self.task = task
        self.place = np.full(len(task.patch_nets.sizes), -1)
        self.points = np.empty((3, 3, 3, 0))

    def of(self, own: Cells, patch: Ints) -> FloatArray:
        """Nine points of each piece, (3, 3, 3, N), about the middle of its patch."""
        whole = (own.box[1::2] - own.box[::2] == SPAN).all(axis=0)
        fresh = (whole & (self.place[patch] < 0)).nonzero()[0]
        if len(fresh):
            # Pieces of many cells may be the same span.
            fresh = fresh[np.unique(patch[fresh], return_index=True)[1]]
            more = np.empty((3, 3, 3, len(fresh)))
            self.place[patch[fresh]] = np.arange(len(fresh))
            for net, here in _nets(self.task, own, fresh):
                more[..., self.place[patch[here]]] = evaluate_nine_points(net)
            self.place[patch[fresh]] += self.points.shape[3]
            self.points = np.concatenate([self.points, more], axis=3)
        if whole.all():
            return self.points.take(self.place[patch], axis=3)
        points = np.empty((3, 3, 3, len(patch)))
        points[..., whole] = self.points[..., self.place[patch[whole]]]
        for net, here in _nets(self.task, own, (~whole).nonzero()[0]):
            points[..., here] = evaluate_nine_points(net)
        return points


def _examined(task: Task, cells: Cells, known: _Known) -> CellEstimates:
    """Verdict on cells of several spans."""
    pieces, goal = _pieces(cells), task.goal
    own, of = pieces.own, pieces.cell
    patch = task.find_patches(own)
    middles = task.patch_nets.middles
    about = middles[:, patch] - middles[:, task.faces.first[own.face]]
    points = known.of(own, patch)
    at = (points + about).reshape(9, 3, -1)
    corner = np.zeros((9, 3, len(cells)))
    corner[0], corner[6] = at[0][:, pieces.start], at[6][:, pieces.end - pieces.width + 1]
    corner[8], corner[2] = at[8][:, pieces.end], at[2][:, pieces.start + pieces.width - 1]
    planes, normal, steps, squares = find_planes(corner)
    allowed = _allowed(task, pieces)
    if goal.angle < np.pi:
        size = np.sqrt(np.maximum(squares[4], squares[5]))
        allowed = np.minimum(allowed, find_height_limit(goal.angle, size))
    stray = np.where(planes.flat, 1.0, 0.5 if goal.two_sided else 0.0)
    box, size = cells.box[:, of], cells.box[1::2] - cells.box[::2]
    low, high = ((own.box[k::2] - box[::2]) / size[:, of] for k in (0, 1))
    places = np.array([low, (low + high) * 0.5, high]).swapaxes(0, 1)

    seen = _Seen(corner[[0, 6, 8, 2]], planes, stray)
    heights = _highest(seen, pieces, at, places, allowed)
    rising = np.where(planes.worse == 0, heights[0] < heights[1] * NEARLY, planes.worse < 0)
    best = np.where(rising, heights[0], heights[1])
    fails = best > allowed
    if goal.angle < np.pi:
        fails |= _turned(pieces, at, normal, goal.angle)

    bends, lengths = _bends(seen, pieces, at, places[:, 1], normal)
    if not fails.all():
        chosen = np.where(rising, planes.normals[:2], planes.normals[2:])
        left = _left(task, pieces, (points, planes.flat), chosen, ~fails)
        worse = ~fails & (best + left[0] > allowed)
        fails |= worse
        bends = np.where(worse, left[1:], bends)
    form = build_forms(steps, normal, bends, allowed)
    along_v = choose_directions(bends, lengths, form[4] * 8.0, allowed)
    return CellEstimates(fails, along_v, rising, form)


@dataclass(frozen=True, eq=False, slots=True)
class _Seen:
    """Cells as they are looked at.

    Attributes
    ----------
    corner : ndarray of float64, shape (4, 3, m)
        a, b, c, d.
    planes : Planes
    stray : ndarray of float64, shape (m,)
        Share of a deviation in any direction that counts, where it is not only heights.
    """

    corner: FloatArray
    planes: Planes
    stray: FloatArray

    def heights(
        self, points: FloatArray, places: tuple[FloatArray, FloatArray], of: Ints
    ) -> FloatArray:
        """The greatest height of points (k, 3, N) of cells over both pairs of triangles, (2, N).

        Their places (k, N) are x and y in the cell, 0 … 1.
        """
        x, y = places
        under = self.planes.normals[..., of]
        a, b, c, d = self.corner[..., of]
        found = np.empty((2, len(of)))
        stray = self.stray[of]
        for way, (from_, below) in enumerate(((a, y <= x), (b, x + y <= 1.0))):
            away = points - from_
            one, two = dots(away, under[2 * way]), dots(away, under[2 * way + 1])
            high = np.abs(np.where(below, one, two))
            if stray.any():
                # Where the point would be, were the triangle the image of its parameters.
                s, t = x[:, np.newaxis], y[:, np.newaxis]
                if from_ is a:
                    lower, upper = a + s * (b - a) + t * (c - b), a + t * (d - a) + s * (c - d)
                else:
                    lower = a + s * (b - a) + t * (d - a)
                    upper = c + (1.0 - s) * (d - c) + (1.0 - t) * (b - c)
                gone = points - np.where(below[:, np.newaxis], lower, upper)
                whole = stray * np.sqrt(dots(gone, gone))
                high = np.maximum(np.where(stray == 1.0, 0.0, high), whole)
            found[way] = high.max(axis=0)
        return found


def _highest(
    seen: _Seen, pieces: _Pieces, at: FloatArray, places: FloatArray, allowed: FloatArray
) -> FloatArray:
    """The greatest heights (2, m) of nine points (9, 3, N) over both pairs of triangles.

    Where a few of many points are too high already, which tells enough, they are infinite.
    """
    of, maybe = pieces.cell, np.ones(len(allowed), dtype=bool)
    if len(of) > AHEAD:
        few = seen.heights(at[FEW], (places[0, :2], places[1, :2]), of)
        maybe = np.any(pieces.worst(few) <= allowed, axis=0)
    highest = np.full((2, len(maybe)), np.inf)
    rows = maybe[of].nonzero()[0]
    if len(rows):
        around = np.repeat(places[0][:, rows], 3, axis=0), np.tile(places[1][:, rows], (3, 1))
        count = (pieces.end + 1 - pieces.start)[maybe]
        heights = seen.heights(at[..., rows], around, of[rows])
        highest[:, maybe] = np.maximum.reduceat(heights, np.cumsum(count) - count, axis=-1)
    return highest


def _bends(
    seen: _Seen, pieces: _Pieces, at: FloatArray, middle: FloatArray, normal: Vectors
) -> tuple[FloatArray, FloatArray]:
    """How far middles of pieces are above chords of their cells along u and v; their lengths.

    All are (2, m); the chords run through the middles of the pieces at both ends of a line, and
    `middle` (2, N) says where on it a piece has its own.
    """
    stray = seen.stray[pieces.cell]
    bends, lengths = np.empty((2, 2, len(pieces.start)))
    for axis, (first, last) in enumerate(pieces.lines()):
        begin = at[(1, 3)[axis]][:, first]
        chord = at[(7, 5)[axis]][:, last] - begin
        away = at[4] - (begin + middle[axis] * chord)
        height = np.abs(dot(away, normal[:, pieces.cell]))
        if stray.any():
            height = np.maximum(height, stray * length(away))
        bends[axis], lengths[axis] = pieces.worst(height), pieces.worst(length(chord))
    return bends, lengths


def _crosswise(cells: Cells, along_v: Bools) -> Bools:
    """The directions of cuts, at knots where cells are as thin as any within one span.

    Normals that turn however thin the cell is, as at a crease along it, leave it to its spans.
    """
    thin = cells.box[1::2] - cells.box[::2] <= SPAN * FINEST
    directions: Bools = np.where(thin[0] | thin[1], thin[0], along_v)
    return directions


def _turned(pieces: _Pieces, at: FloatArray, normal: Vectors, angle: float) -> Bools:
    """Cells with a normal in one of their pieces that is more than half the angle from their own.

    So no two of them are further apart than the angle.
    """
    own = normal[:, pieces.cell]
    found = estimate_normals(at.reshape(3, 3, 3, -1))
    apart = np.maximum.reduce(
        [np.where(dot(n, n) == 0.0, 0.0, length(n - own)) for row in found for n in row]
    )
    turned: Bools = pieces.worst(apart) > find_chord(angle / 2.0)
    return turned


def _allowed(task: Task, pieces: _Pieces) -> FloatArray:
    """Deviation allowed to the nearest piece of every cell."""
    if task.goal.view is None:
        return np.full(len(pieces.whole), task.goal.tolerance)
    allowed = np.empty(len(pieces.cell))
    for net, here in _nets(task, pieces.own, np.arange(len(pieces.cell))):
        eye = task.find_eyes(task.find_patches(pieces.own.take(here)))
        allowed[here] = find_allowed(net, task.goal, eye)
    return -pieces.worst(-allowed)


def _left(
    task: Task,
    pieces: _Pieces,
    known: tuple[FloatArray, Bools],
    normals: FloatArray,
    wanted: Bools,
) -> FloatArray:
    """The largest `measure_remainder` and `measure_sag` of the pieces of wanted cells: (3, m).

    Known are nine points of the pieces, and which cells have no planes.
    """
    (points, flat), two_sided = known, task.goal.two_sided
    found = np.zeros((3, len(pieces.cell)))
    for net, here in _nets(task, pieces.own, wanted[pieces.cell].nonzero()[0]):
        cell, bare = pieces.cell[here], points_of(net)
        under, no_plane = normals[..., cell], flat[cell]
        found[0, here] = measure_remainder(bare, points[..., here], under, no_plane, two_sided)
        found[1:, here] = measure_sag(bare, under, no_plane, two_sided)
    return pieces.worst(found)
