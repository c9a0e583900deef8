"""Cells of several knot spans: flat neighbouring patches stay together.

Such a cell is looked at through the nets of its spans, of nine points each and of what is left of
them without their biquadratic part (see `estimate`). So a level of cells
costs as much as it has spans, and nothing between the spans' corners is missed.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.cutting.boxes import Cells, Leaves
from service.engine.adaptive.cutting.estimate import (
    NEARLY,
    Planes,
    across_v,
    allowed_at,
    remainder,
    sagging,
    two_planes,
)
from service.engine.adaptive.cutting.halving import nine, over
from service.engine.adaptive.cutting.halving import points as points_of
from service.engine.adaptive.cutting.task import Task
from service.engine.adaptive.cutting.turning import FINEST, chord_of, level, normals
from service.engine.bounds.faces import SPAN
from service.engine.bounds.vectors import Vectors, dot, dots, length

BLOCK = 1 << 14
"""Spans that are looked at together, about."""


@dataclass(frozen=True, eq=False, slots=True)
class _Pieces:
    """N pieces of m cells: what each cell has of each of its spans, cell after cell, v fastest.

    Attributes
    ----------
    whole, own : Cells
        The cells, and the pieces as cells of one span.
    cell : ndarray of int, shape (N,)
        The cell of each piece.
    start, end : ndarray of int, shape (m,)
        The first and the last piece of each cell.
    width : ndarray of int, shape (m,)
        How many pieces each cell has along v.
    first, last : ndarray of int, shape (2, N)
        The piece at the beginning and at the end of the same line of pieces along u, along v.
    """

    whole: Cells
    own: Cells
    cell: Ints
    start: Ints
    end: Ints
    width: Ints
    first: Ints
    last: Ints

    def worst(self, values: FloatArray) -> FloatArray:
        """The greatest of the values (…, N) in every cell, (…, m)."""
        greatest: FloatArray = np.maximum.reduceat(values, self.start, axis=-1)
        return greatest


@dataclass(frozen=True, eq=False, slots=True)
class _Look:
    """What cells of several spans look like.

    Attributes
    ----------
    pieces : _Pieces
    about : ndarray of float64, shape (3, N)
        What the nets of the pieces are about, seen from the first patch of the face.
    points : ndarray of float64, shape (3, 3, 3, N)
        Points of each piece at the beginning, in the middle and at the end along u and v.
    x, y : ndarray of float64, shape (3, N)
        Where they are in the cell, 0 … 1.
    corner : ndarray of float64, shape (4, 3, m)
        Corners of the cells, in the order (0, 0), (1, 0), (1, 1), (0, 1).
    planes : Planes
    normal : ndarray of float64, shape (3, m)
    stray : ndarray of float64, shape (N,)
        Share of a deviation in any direction that counts, where it is not only heights.
    """

    pieces: _Pieces
    about: Vectors
    points: FloatArray
    x: FloatArray
    y: FloatArray
    corner: FloatArray
    planes: Planes
    normal: Vectors
    stray: FloatArray


def flattened(task: Task, start: Cells) -> tuple[list[Leaves], list[Cells]]:
    """Leaves of several spans, and the cells of one span that are left to be looked at."""
    leaves: list[Leaves] = []
    rest: list[Cells] = []
    known = _Known(task)
    waiting = [start]
    while waiting:
        parts = [waiting.pop()]
        total = _counts(parts[0]).prod(axis=0).sum()
        while waiting and (more := total + _counts(waiting[-1]).prod(axis=0).sum()) <= BLOCK:
            parts.append(waiting.pop())
            total = more
        cells = Cells.joined(parts)
        counts = np.cumsum(np.prod(_counts(cells), axis=0))
        fitting = max(1, int(np.searchsorted(counts, BLOCK, side="right")))
        if fitting < len(cells):
            waiting.append(cells.take(slice(fitting, None)))
            cells = cells.take(slice(fitting))
        found, halves = _examined(task, cells, known)
        leaves.append(found)
        for half in halves:
            several: Bools = np.prod(_counts(half), axis=0) > 1
            rest.append(half.take(~several))
            if several.any():
                waiting.append(half.take(several))
    return leaves, rest


def _counts(cells: Cells) -> Ints:
    """Spans that cells have a part of, along u and along v: shape (2, m)."""
    counts: Ints = -(-cells.box[1::2] // SPAN) - cells.box[::2] // SPAN
    return counts


def _pieces(cells: Cells) -> _Pieces:
    along_u, along_v = _counts(cells)
    count = along_u * along_v
    end = np.cumsum(count)
    start = end - count
    cell = np.repeat(np.arange(len(cells)), count)
    here = np.arange(len(cell))
    number, width = here - start[cell], along_v[cell]
    k, l = number // width, number % width  # noqa: E741
    box = cells.box[:, cell]
    u, v = (box[0] // SPAN + k) * SPAN, (box[2] // SPAN + l) * SPAN
    low = np.maximum(box[0], u), np.maximum(box[2], v)
    high = np.minimum(box[1], u + SPAN), np.minimum(box[3], v + SPAN)
    own = Cells(cells.face[cell], np.array([low[0], high[0], low[1], high[1]]))
    first = np.array([start[cell] + l, here - l])
    last = np.array([(end - along_v)[cell] + l, here - l + width - 1])
    return _Pieces(cells, own, cell, start, end - 1, along_v, first, last)


def _nets(task: Task, pieces: _Pieces, wanted: Ints) -> Iterator[tuple[FloatArray, Ints]]:
    """Nets of the wanted pieces, a group and a block at a time, and which pieces they are."""
    patch = task.patch_of(pieces.own)
    for nets, here in task.ground.by_group(patch[wanted]):
        block = max(16, BLOCK * 16 // nets.values[..., 0].size)
        for k in range(0, len(here), block):
            some = wanted[here[k : k + block]]
            net = over(nets, task.ground.row[patch[some]], pieces.own.take(some))
            task.budget.spend(net.size)
            yield net, some


class _Known:
    """Nine points of whole spans, which are computed once, however often these are looked at."""

    def __init__(self, task: Task) -> None:
        self.task = task
        self.place = np.full(len(task.ground.sizes), -1)
        self.points = np.empty((3, 3, 3, 0))

    def of(self, pieces: _Pieces, patch: Ints) -> FloatArray:
        """Nine points of each piece, (3, 3, 3, N), about the middle of its patch."""
        box = pieces.own.box
        whole = (box[1::2] - box[::2] == SPAN).all(axis=0)
        place = np.where(whole, self.place[patch], -1)
        wanted = (place < 0).nonzero()[0]
        if not len(wanted):
            return self.points[..., place]
        fresh = np.empty((3, 3, 3, len(wanted)))
        number = np.empty(len(patch), dtype=np.intp)
        number[wanted] = np.arange(len(wanted))
        for net, here in _nets(self.task, pieces, wanted):
            fresh[..., number[here]] = nine(net)
        if len(wanted) < len(patch):
            points = np.empty((3, 3, 3, len(patch)))
            points[..., wanted] = fresh
            old = (place >= 0).nonzero()[0]
            points[..., old] = self.points[..., place[old]]
        else:
            points = fresh
        kept = whole[wanted].nonzero()[0]
        self.place[patch[wanted[kept]]] = self.points.shape[3] + np.arange(len(kept))
        self.points = np.concatenate([self.points, fresh[..., kept]], axis=3)
        return points


def _looked_at(task: Task, cells: Cells, known: _Known) -> _Look:
    pieces = _pieces(cells)
    middles, patch = task.ground.middles, task.patch_of(pieces.own)
    about = middles[:, patch] - middles[:, task.faces.first[pieces.own.face]]
    points = known.of(pieces, patch)
    points = points + about
    corner = np.array(
        [
            points[0, 0][:, pieces.start],
            points[2, 0][:, pieces.end - pieces.width + 1],
            points[2, 2][:, pieces.end],
            points[0, 2][:, pieces.start + pieces.width - 1],
        ]
    )
    nine_points = np.zeros((9, *corner.shape[1:]))
    nine_points[[0, 6, 8, 2]] = corner
    planes, normal, _, _ = two_planes(nine_points)
    x, y = (_shares(cells.box[k : k + 2, pieces.cell], pieces.own.box[k : k + 2]) for k in (0, 2))
    stray = np.where(planes.flat[pieces.cell], 1.0, 0.5 if task.goal.two_sided else 0.0)
    return _Look(pieces, about, points, x, y, corner, planes, normal, stray)


def _shares(box: Ints, own: Ints) -> FloatArray:
    """Where pieces begin, have their middle and end in their cells, 0 … 1: (3, N)."""
    size = (box[1] - box[0]).astype(np.float64)
    begin, end = (own[0] - box[0]) / size, (own[1] - box[0]) / size
    return np.array([begin, (begin + end) * 0.5, end])


def _examined(task: Task, cells: Cells, known: _Known) -> tuple[Leaves, tuple[Cells, Cells]]:
    """Leaves among the cells, and the halves of the others."""
    look = _looked_at(task, cells, known)
    heights = np.array([_heights(look, rising) for rising in (True, False)])
    planes = look.planes
    rising = np.where(planes.worse == 0, heights[0] < heights[1] * NEARLY, planes.worse < 0)
    best = np.where(rising, heights[0], heights[1])
    a, b, c, d = look.corner
    size = np.maximum(length(c - a), length(d - b))
    allowed = np.minimum(_allowed(task, look.pieces), level(task.goal.angle, size))
    bends = np.array([_bend(look, axis) for axis in (0, 1)])
    fails = best > allowed
    if task.goal.angle < np.pi:
        fails |= _turned(look, task.goal.angle)
    rest = _left(task, look, np.where(rising, planes.normals[:2], planes.normals[2:]), ~fails)
    worse = ~fails & (best + rest[0] > allowed)
    fails |= worse
    bends = np.where(worse, rest[1:], bends)
    lengths = np.array([look.pieces.worst(length(_chord(look, axis)[1])) for axis in (0, 1)])
    step_u, step_v = (b - a + c - d) * 0.5, (d - a + c - b) * 0.5
    skew = dot(a - b + c - d, look.normal)
    along_v = across_v(bends, lengths, skew, allowed)
    form = np.array(
        [
            dot(step_u, step_u),
            dot(step_u, step_v),
            dot(step_v, step_v),
            bends[0],
            skew * 0.125,
            bends[1],
            allowed,
        ]
    )
    leaves = Leaves(cells, along_v, rising, form).take((~fails).nonzero()[0])
    cut = fails.nonzero()[0]
    return leaves, cells.take(cut).halved(_crosswise(cells, along_v)[cut])


def _crosswise(cells: Cells, along_v: Bools) -> Bools:
    """The directions of cuts, at knots where cells are as thin as any within one span.

    Normals that turn however thin the cell is, as at a crease along it, leave it to its spans.
    """
    thin = cells.box[1::2] - cells.box[::2] <= SPAN * FINEST
    directions: Bools = np.where(thin[0] | thin[1], thin[0], along_v)
    return directions


def _heights(look: _Look, rising: bool) -> FloatArray:
    """The greatest height of any of the points over the triangle below it, (m,)."""
    of = look.pieces.cell
    lower, upper = look.planes.normals[slice(0, 2) if rising else slice(2, 4)][..., of]
    a, b, c, d = look.corner[..., of]
    away = look.points - (a if rising else b)
    x, y = look.x[:, np.newaxis], look.y
    below = y <= x if rising else x + y <= 1.0
    high = np.abs(np.where(below, dots(away, lower), dots(away, upper)))
    if look.stray.any():
        # Where the point would be, were the triangle the image of its parameters.
        s, t = x[..., np.newaxis, :], y[..., np.newaxis, :]
        if rising:
            one, two = a + s * (b - a) + t * (c - b), a + t * (d - a) + s * (c - d)
        else:
            one = a + s * (b - a) + t * (d - a)
            two = c + (1.0 - s) * (d - c) + (1.0 - t) * (b - c)
        gone = look.points - np.where(below[:, :, np.newaxis], one, two)
        stray = look.stray * np.sqrt(dots(gone, gone))
        high = np.maximum(np.where(look.stray == 1.0, 0.0, high), stray)
    return look.pieces.worst(high.max(axis=(0, 1)))


def _chord(look: _Look, axis: int) -> tuple[Vectors, Vectors]:
    """Chords of the cells through the middles of their pieces: begin and step."""
    points, pieces = look.points, look.pieces
    ends = (points[0, 1], points[2, 1]) if axis == 0 else (points[1, 0], points[1, 2])
    begin = ends[0][:, pieces.first[axis]]
    return begin, ends[1][:, pieces.last[axis]] - begin


def _bend(look: _Look, axis: int) -> FloatArray:
    """How far the middles of the pieces are above chords of their cells, along u or v: (m,)."""
    begin, chord = _chord(look, axis)
    away = look.points[1, 1] - (begin + (look.x, look.y)[axis][1] * chord)
    height = np.abs(dot(away, look.normal[:, look.pieces.cell]))
    if look.stray.any():
        height = np.maximum(height, look.stray * length(away))
    return look.pieces.worst(height)


def _turned(look: _Look, angle: float) -> Bools:
    """Cells with a normal in one of their pieces that is more than half the angle from their own.

    So no two of them are further apart than the angle.
    """
    points, own = look.points, look.normal[:, look.pieces.cell]
    found = normals(points)
    apart = np.maximum.reduce(
        [np.where(dot(n, n) == 0.0, 0.0, length(n - own)) for row in found for n in row]
    )
    turned: Bools = look.pieces.worst(apart) > chord_of(angle / 2.0)
    return turned


def _allowed(task: Task, pieces: _Pieces) -> FloatArray:
    """Deviation allowed to the nearest piece of every cell."""
    if task.goal.view is None:
        return np.full(len(pieces.whole), task.goal.tolerance)
    allowed = np.empty(len(pieces.cell))
    for net, here in _nets(task, pieces, np.arange(len(pieces.cell))):
        allowed[here] = allowed_at(
            net, task.goal, task.eye_of(task.patch_of(pieces.own.take(here)))
        )
    return -pieces.worst(-allowed)


def _left(task: Task, look: _Look, normals: FloatArray, wanted: Bools) -> FloatArray:
    """What `remainder` and `sagging` say of wanted cells, of every one the greatest: (3, m)."""
    pieces = look.pieces
    found = np.zeros((3, len(pieces.cell)))
    for net, here in _nets(task, pieces, wanted[pieces.cell].nonzero()[0]):
        cell = pieces.cell[here]
        at = look.points[..., here] - look.about[:, here]
        flat = look.planes.flat[cell]
        bare, two_sided = points_of(net), task.goal.two_sided
        found[0, here] = remainder(bare, at, normals[..., cell], flat, two_sided)
        found[1:, here] = sagging(bare, normals[..., cell], flat, two_sided)
    return pieces.worst(found)
