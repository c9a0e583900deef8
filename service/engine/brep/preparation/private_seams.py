"""Loops that run around a closed direction, cut along a line of the surface.

The line is u = s (or v = s). Where loops cross it, their edges are split. Between two crossings the
line is inside of the face or outside: inside, it is a seam, an edge that the face has twice, once
for each side of the cut, and that no neighbour sees. Let the cut surface be unrolled between the
*low* border u = s and the *high* border u = s + period. A loop that leaves through a border goes on
along it with the material on its left, up to the next crossing, where a loop enters. Beyond the
last crossing it goes along the border to a pole, along the side of the pole to the other border,
and back. So every loop is closed in the plane.

Proof in docs/proofs.md: "Regions of closed surfaces".
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.brep.preparation.arcs import Arc, ArcLoop, CutLoops
from service.engine.brep.preparation.cut_lines import (
    Crossing,
    CutLine,
    choose_line,
    find_crossings,
)
from service.engine.brep.preparation.seam_arcs import SeamMaker
from service.engine.trims.closure import ClosedSurfaces


class NotClosed(Exception):
    """The material of a face reaches a border of its surface that no loop has."""


@dataclass(frozen=True, eq=False, slots=True)
class SourcedLoop:
    """A loop of arcs, the loop of the model of which its first arc is, and its turns (2,)."""

    source: int
    arcs: ArcLoop
    turns: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class _Chain:
    """The part of a loop between two crossings, in the strip between the borders."""

    source: int
    arcs: ArcLoop
    begin: Crossing
    end: Crossing
    begin_at: float
    end_at: float


class Cutter:
    """Cuts the loops of one face along a line across one closed axis; `where` is face and axis."""

    def __init__(
        self,
        surfaces: ClosedSurfaces,
        work: CutLoops,
        where: tuple[int, int],
        *,
        is_cut: bool,
    ) -> None:
        self.surfaces, self.work, self.face, self.axis = surfaces, work, *where
        self.maker = SeamMaker(surfaces, work, *where)
        self.other = 1 - self.axis
        self.low, self.period = surfaces.low[self.face], surfaces.period[self.face]
        # A face that is cut across the other axis already is not closed along it any more.
        self.is_closed = bool(surfaces.is_closed[self.face, self.other]) and not is_cut
        # Along the high border, the material is on the left in this direction.
        self.forward = 1 if self.axis == 0 else -1
        self.line = 0.0

    def cut(self, loops: list[SourcedLoop], *, is_whole: bool) -> list[SourcedLoop]:
        """The loops after the cut; with `is_whole`, the line is inside if no loop crosses it."""
        arcs = [loop.arcs for loop in loops]
        turns = [loop.turns for loop in loops]
        self.line = choose_line(self.surfaces, self.work, (self.face, self.axis), arcs, turns)
        self.maker.line = self.line
        chains: list[_Chain] = []
        result = []
        line = CutLine(self.face, self.axis, self.line)
        for loop in loops:
            crossings = find_crossings(
                self.surfaces, self.work, line, (loop.arcs, loop.turns), len(chains)
            )
            if crossings:
                chains += self._make_chains(loop, crossings)
            else:
                result.append(self._move_into_strip(loop))
        if chains:
            return result + self._link(chains)
        return result + self._surround() if is_whole else result

    def _move_into_strip(self, loop: SourcedLoop) -> SourcedLoop:
        """A loop that does not cross the line."""
        first = self._locate(loop.arcs[0])
        turns = np.floor((first[self.axis] - self.line) / self.period[self.axis])
        return SourcedLoop(loop.source, self._shift(loop.arcs, -turns, self.axis), loop.turns)

    def _locate(self, arc: Arc) -> FloatArray:
        """The place in the middle of an arc."""
        t = np.array([(arc.begin + arc.end) / 2])
        place: FloatArray = self.work.evaluate(np.array([arc.coedge]), t)[0]
        return place + arc.shift

    def _shift(self, arcs: ArcLoop, turns: float, axis: int) -> ArcLoop:
        """Arcs, moved by a number of periods along an axis."""
        shift = np.zeros(2)
        shift[axis] = turns * self.period[axis]
        return [arc.move(shift) for arc in arcs]

    def _make_chains(self, loop: SourcedLoop, crossings: list[Crossing]) -> list[_Chain]:
        """The parts of a loop between its crossings, in the strip."""
        turn = loop.turns * self.period
        second = [arc.move(turn) for arc in loop.arcs]
        arcs = loop.arcs + second
        count = len(loop.arcs)
        first = crossings[0]
        again = Crossing(
            first.key,
            first.arc + count,
            first.t,
            first.at + turn[self.other],
            first.direction,
            first.number + round(loop.turns[self.axis]),
            first.vertex,
        )
        chains = []
        for begin, end in pairwise([*crossings, again]):
            part = arcs[begin.arc : end.arc + 1]
            part[0] = Arc(part[0].coedge, begin.t, part[0].end, part[0].shift)
            part[-1] = Arc(part[-1].coedge, part[-1].begin, end.t, part[-1].shift)
            part = [arc for arc in part if arc.begin != arc.end]
            strip = begin.number if begin.direction > 0 else begin.number - 1
            moved = self._shift(part, -strip, self.axis)
            chains.append(_Chain(loop.source, moved, begin, end, begin.at, end.at))
        return chains

    def _link(self, chains: list[_Chain]) -> list[SourcedLoop]:
        """Chains joined along the borders to closed loops."""
        # Crossings along the line; a chain begins, and a chain ends, at each.
        chains = sorted(chains, key=lambda chain: self._reduce(chain.begin_at))
        position = {chain.begin.key: k for k, chain in enumerate(chains)}
        left = set(range(len(chains)))
        result = []
        while left:
            first = min(left)
            arcs: ArcLoop = []
            k, offset = first, 0.0
            while k in left:
                left.remove(k)
                chain = chains[k]
                arcs += self._shift(chain.arcs, offset / self.period[self.other], self.other)
                at = chain.end_at + offset
                k, target, seam = self._follow(chains, position[chain.end.key], at)
                arcs += seam
                offset = target - chains[k].begin_at
            if k != first:
                raise NotClosed
            turns = np.zeros(2)
            if self.is_closed:
                turns[self.other] = round(offset / self.period[self.other])
            result.append(SourcedLoop(chains[first].source, arcs, turns))
        return result

    def _reduce(self, at: float) -> float:
        """A coordinate along the line, within the domain."""
        if not self.is_closed:
            return at
        low, period = float(self.low[self.other]), float(self.period[self.other])
        return low + (at - low) % period

    def _follow(self, chains: list[_Chain], here: int, at: float) -> tuple[int, float, ArcLoop]:
        """The chain that goes on where one ends, where it begins, and the arcs between.

        `here` is the chain that begins at the crossing at which the other one ends, which is at
        `at` along the line.
        """
        leaves_high = chains[here].begin.direction > 0
        step = self.forward if leaves_high else -self.forward
        following = here + step
        if self.is_closed:
            following %= len(chains)
        if not 0 <= following < len(chains):
            return self._go_around(chains, here, at, step)
        if chains[following].begin.direction == chains[here].begin.direction:
            raise NotClosed
        apart = (self._reduce(chains[following].begin_at) - self._reduce(at)) * step
        if self.is_closed and apart <= 0:
            apart += float(self.period[self.other])
        target = at + step * apart
        lower = here if step > 0 else following
        key = lower, (following if step > 0 else here)
        vertices = chains[here].begin.vertex, chains[following].begin.vertex
        arcs = self.maker.make_seam(key, (at, target), vertices, is_high=leaves_high)
        return following, target, arcs

    def _go_around(
        self, chains: list[_Chain], here: int, at: float, step: int
    ) -> tuple[int, float, ArcLoop]:
        """From the last crossing along the border to a pole, along it, and back."""
        end = 1 if step > 0 else 0
        if not self.surfaces.is_pole[self.face, self.other, end]:
            raise NotClosed
        side = float(self.low[self.other] + end * self.period[self.other])
        leaves_high = chains[here].begin.direction > 0
        pole = self.maker.make_pole_vertex(end, side)
        vertex = chains[here].begin.vertex
        key = (here, -1 - end) if end else (-1 - end, here)
        arcs = self.maker.make_seam(key, (at, side), (vertex, pole), is_high=leaves_high)
        arcs += self.maker.make_pole(pole, side, from_high=leaves_high)
        arcs += self.maker.make_seam(key, (side, at), (pole, vertex), is_high=not leaves_high)
        return here, at, arcs

    def _surround(self) -> list[SourcedLoop]:
        """Loops along both borders, if no loop crosses them and they are inside."""
        low = float(self.low[self.other])
        high = low + float(self.period[self.other])
        begin, end = (low, high) if self.forward > 0 else (high, low)
        if self.is_closed:
            place = self.maker.place(self.line, low)
            vertex = self.maker.add_vertex(place)
            turns = np.zeros(2)
            turns[self.other] = self.forward
            up = self.maker.make_seam((0, 0), (begin, end), (vertex, vertex), is_high=True)
            down = self.maker.make_seam((0, 0), (end, begin), (vertex, vertex), is_high=False)
            return [SourcedLoop(-1, up, turns), SourcedLoop(-1, down, -turns)]
        if not self.surfaces.is_pole[self.face, self.other].all():
            raise NotClosed
        poles = {
            low: self.maker.make_pole_vertex(0, low),
            high: self.maker.make_pole_vertex(1, high),
        }
        arcs = self.maker.make_seam(
            (-1, -2), (begin, end), (poles[begin], poles[end]), is_high=True
        )
        arcs += self.maker.make_pole(poles[end], end, from_high=True)
        arcs += self.maker.make_seam(
            (-1, -2), (end, begin), (poles[end], poles[begin]), is_high=False
        )
        arcs += self.maker.make_pole(poles[begin], begin, from_high=False)
        return [SourcedLoop(-1, arcs, np.zeros(2))]
