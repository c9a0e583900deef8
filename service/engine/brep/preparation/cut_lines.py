"""Lines across closed axes along which faces are cut, and where loops cross them."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.brep.preparation.arcs import Arc, ArcLoop, CutLoops
from service.engine.brep.preparation.circle import Circle
from service.engine.trims.closure import ClosedSurfaces

SAMPLES = 24
"""Points of an arc for each span of its parameter curve."""

SAME = 1e-9
"""A vertex this close to a line, as a share of the period, is on it."""

APART = 1e-6
"""Other vertices are at least this far from a line, so that no edge is split close to its end."""

CLEARANCES = (1e-2, 1e-3, 1e-5)
"""How far a line has to be from points at which a loop turns back, or runs along the line: the
first of these that some line has."""

CANDIDATES, MOST_VERTICES = 32, 256
"""Lines that are tried: between vertices, and at most through this many of them."""

STEPS, PARTS = 12, 32
"""How often an interval with a crossing is divided, and into how many parts."""


@dataclass(frozen=True, eq=False, slots=True)
class CutLine:
    """A line of a face: where the coordinate along `axis` is `at`."""

    face: int
    axis: int
    at: float


@dataclass(frozen=True, eq=False, slots=True)
class Crossing:
    """Where a loop crosses a line s + k · period.

    Attributes
    ----------
    key : int
        One number for each crossing of a cut.
    arc : int
        The arc of the loop on which it is.
    t : float
        The parameter of its edge.
    at : float
        The coordinate along the line.
    direction : int
        1 if the coordinate across the line grows, else −1.
    number : int
        k.
    vertex : int
    """

    key: int
    arc: int
    t: float
    at: float
    direction: int
    number: int
    vertex: int


@dataclass(frozen=True, eq=False, slots=True)
class _Samples:
    """Points (n + 1, 2) of a loop with its end, and the arc, the parameter, of each but the last.

    `is_vertex` marks the beginnings of arcs; `signs` (n,) is the direction in which the coordinate
    across the line goes from each point to the next.
    """

    points: FloatArray
    arcs: list[int]
    parameters: FloatArray
    is_vertex: Bools
    signs: FloatArray

    def find_turning(self) -> Bools:
        """Whether the coordinate does not go on in one direction at each point, (n,)."""
        before = np.roll(self.signs, 1)
        turning: Bools = (before != self.signs) | (self.signs == 0)
        return turning


def choose_line(
    surfaces: ClosedSurfaces,
    work: CutLoops,
    where: tuple[int, int],
    loops: list[ArcLoop],
    turns: list[FloatArray],
) -> float:
    """The coordinate across the line that splits the fewest edges; `where` is face and axis."""
    face, axis = where
    low, period = float(surfaces.low[face, axis]), float(surfaces.period[face, axis])
    samples = [
        _sample(surfaces, work, where, (arcs, turn))
        for arcs, turn in zip(loops, turns, strict=True)
    ]
    none = np.zeros(0)
    values = np.concatenate([none, *(loop.points[:-1, axis] for loop in samples)])
    following = np.concatenate([none, *(loop.points[1:, axis] for loop in samples)])
    turning = np.concatenate([none > 0, *(loop.find_turning() for loop in samples)])
    is_vertex = np.concatenate([none > 0, *(loop.is_vertex for loop in samples)])
    vertices = values[is_vertex & ~turning]
    some = vertices[:: len(vertices) // MOST_VERTICES + 1]
    spread = low + period * ((np.arange(CANDIDATES) + 0.381966) / CANDIDATES)
    candidates = np.concatenate([[low], some, spread])
    around = Circle(low, period)
    clear = around.find_distance(candidates, values[turning])
    on_vertex = around.count_near(candidates, vertices, SAME)
    is_bad = around.count_near(candidates, vertices, APART) > on_vertex
    crossings = around.count_crossings(candidates, values, following)
    cost = crossings - on_vertex + 0.5 * (np.arange(len(candidates)) > 0)
    for clearance in CLEARANCES:
        good = ((clear >= clearance) & ~is_bad).nonzero()[0]
        if len(good):
            return float(candidates[good[cost[good].argmin()]])
    return float(candidates[clear.argmax()])


def find_crossings(
    surfaces: ClosedSurfaces,
    work: CutLoops,
    line: CutLine,
    loop: tuple[ArcLoop, FloatArray],
    first_key: int,
) -> list[Crossing]:
    """Where a loop crosses the lines, in its order; edges are split there.

    `loop` has its arcs and its turns. The keys are `first_key` and the numbers after it.
    """
    axis = line.axis
    period = float(surfaces.period[line.face, axis])
    samples = _sample(surfaces, work, (line.face, axis), loop)
    position = (samples.points[:, axis] - line.at) / period
    nearest = np.rint(position)
    is_on = np.abs(position - nearest) <= SAME
    is_on[:-1] &= samples.is_vertex | (position == nearest)[:-1]
    position = np.where(is_on, nearest, position)
    turning = samples.find_turning()
    arcs = loop[0]
    crossings: list[Crossing] = []
    for i in range(len(samples.arcs)):
        arc = arcs[samples.arcs[i]]
        direction = int(samples.signs[i])
        if is_on[i] and not turning[i]:
            t, at = float(samples.parameters[i]), float(samples.points[i, 1 - axis])
            vertex = _find_begin(work, arc) if samples.is_vertex[i] else work.split(arc.coedge, t)
            key = first_key + len(crossings)
            crossings.append(
                Crossing(key, samples.arcs[i], t, at, direction, round(position[i]), vertex)
            )
        a, b = position[i], position[i + 1]
        numbers = range(int(np.floor(min(a, b))) + 1, int(np.ceil(max(a, b))))
        for number in numbers if direction > 0 else reversed(numbers):
            ends = samples.parameters[i], _find_next(samples, arcs, i)
            t = _find_parameter(work, arc, axis, ends, line.at + number * period)
            place = _locate(work, arc, t)
            key = first_key + len(crossings)
            vertex = work.split(arc.coedge, t)
            crossings.append(
                Crossing(key, samples.arcs[i], t, float(place[1 - axis]), direction, number, vertex)
            )
    return crossings


def _find_begin(work: CutLoops, arc: Arc) -> int:
    """The vertex at which an arc begins."""
    edge = work.find_edge(arc.coedge)
    ends = work.find_range(edge)
    if arc.begin in ends:
        return work.find_vertices(edge)[ends.index(arc.begin)]
    return work.split(arc.coedge, arc.begin)


def _find_next(samples: _Samples, arcs: ArcLoop, i: int) -> float:
    """The parameter, of the arc of sample i, at the next sample."""
    is_last = i + 1 == len(samples.arcs) or samples.arcs[i + 1] != samples.arcs[i]
    return arcs[samples.arcs[i]].end if is_last else float(samples.parameters[i + 1])


def _locate(work: CutLoops, arc: Arc, t: float) -> FloatArray:
    """The place (2,) of an arc at a parameter."""
    place: FloatArray = work.evaluate(np.array([arc.coedge]), np.array([t]))[0] + arc.shift
    return place


def _find_parameter(
    work: CutLoops, arc: Arc, axis: int, ends: tuple[float, float], target: float
) -> float:
    """Where the coordinate of an arc is `target`, between two parameters."""
    low, high = ends
    coedges = np.full(PARTS + 1, arc.coedge)
    for _ in range(STEPS):
        t = np.linspace(low, high, PARTS + 1)
        beyond = work.evaluate(coedges, t)[:, axis] + arc.shift[axis] - target
        # The first part at whose ends the coordinate is on both sides of the target.
        k = max(int(((beyond < 0) != (beyond[0] < 0)).argmax()), 1)
        low, high = float(t[k - 1]), float(t[k])
    return (low + high) / 2


def _sample(
    surfaces: ClosedSurfaces,
    work: CutLoops,
    where: tuple[int, int],
    loop: tuple[ArcLoop, FloatArray],
) -> _Samples:
    """Points along a loop, which is closed by its turns."""
    face, axis = where
    arcs, turns = loop
    points, t, numbers = sample_arcs(work, arcs)
    points = np.concatenate([points, points[:1] + turns * surfaces.period[face]])
    steps = np.diff(points[:, axis])
    signs = np.where(np.abs(steps) > SAME * surfaces.period[face, axis], np.sign(steps), 0.0)
    is_vertex = np.diff(numbers, prepend=-1) > 0
    return _Samples(points, numbers.tolist(), t, is_vertex, signs)


def sample_arcs(work: CutLoops, arcs: ArcLoop) -> tuple[FloatArray, FloatArray, Ints]:
    """Points (n, 2) along arcs, without their ends; the parameter of each, and its arc."""
    coedges = np.array([arc.coedge for arc in arcs])
    degree, spans = work.find_shapes(coedges)
    count = np.where(degree == 1, 1, SAMPLES) * spans
    numbers, step = expand_runs(count)
    begin, end = np.array([[arc.begin, arc.end] for arc in arcs]).T
    t = begin[numbers] + (end - begin)[numbers] * (step / count[numbers])
    shifts = np.array([arc.shift for arc in arcs])
    return work.evaluate(coedges[numbers], t) + shifts[numbers], t, numbers
