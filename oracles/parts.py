"""Whole parts for slow searches: trimmed faces, edges as curves of space, and placements.

A part is all faces of a brep document, or of all members of a group, with their regions
(`oracles.regions`), and all edges that are borders. Where a loop has no edges, and on the natural
borders of a face without loops, the border is the parameter curve on the surface. Seams and poles
are no borders. A Bézier patch of a group is a face without loops. Points have 64 bits of mantissa.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracles.brep_documents import Array, Long, Net, Spline, read_surface
from oracles.coedges import iterate_coedges, read_edge
from oracles.loop_sides import LoopSides, build_sides
from oracles.regions import Region, build_region, find_closed

Document: TypeAlias = dict[str, Any]
Answers: TypeAlias = NDArray[np.int8]

INSIDE, OUTSIDE, UNSURE = 1, 0, -1

FLATNESS = 1e-4
"""Radii of the pieces of loops, as a share of the box of the loops of a face."""

COLLAPSED = 1e-9
"""Share of the diagonal: a side of a surface that is no longer is a pole."""


@dataclass(frozen=True, eq=False)
class Border:
    """A curve of space: an edge, or the border of one face; `faces` are the faces that it bounds.

    `evaluate` gives points (m, 3) at parameters (m,) of the domain.
    """

    evaluate: Callable[[Array], Long]
    domain: tuple[float, float]
    breaks: Array
    matrix: Array
    faces: list[int] = field(default_factory=list)

    def at(self, t: Array) -> Long:
        """Points (m, 3) of the part."""
        return place(self.evaluate(t), self.matrix)


@dataclass(frozen=True, eq=False)
class Face:
    """A trimmed surface, placed by an affine matrix (4, 4).

    `document` is the brep, and `number` the face of it, of which the region is made; None for a
    patch without trims. `borders` are numbers of the borders of the part.
    """

    net: Net
    document: Document | None
    number: int
    matrix: Array
    borders: list[int] = field(default_factory=list)

    @cached_property
    def domain(self) -> Array:
        """The rectangle of parameters: rows low and high."""
        return self.net.domain.T

    @cached_property
    def periods(self) -> Array:
        """The length of each closed axis, else 0."""
        return np.where(find_closed(self.net), np.ptp(self.domain, axis=0), 0.0)

    @cached_property
    def region(self) -> Region | None:
        """The region; None for the whole domain."""
        return None if self.document is None else build_region(self.document, self.number, FLATNESS)

    @cached_property
    def _sides(self) -> LoopSides | None:
        if self.document is None or self.region is None:
            return None
        low, size, periods = self.region.low, self.region.size, self.periods
        return build_sides(
            self.document, self.number, self.net, low=low, size=size, periods=periods
        )

    @cached_property
    def box(self) -> Array:
        """A rectangle (2, 2) of parameters around the region: rows low and high."""
        low, high = self.domain
        if self.region is not None:
            # The box is that of points of the loops: curves may leave it by the radii of pieces.
            wider = self.region.box + 2 * FLATNESS * np.array([[-1.0], [1.0]])
            low, high = np.clip(self.region.low + wider * self.region.size, low, high)
        return np.stack([low, high])

    def at(self, places: Array) -> Long:
        """Points (m, 3) of the part at parameters (m, 2)."""
        return place(self.net.at(places), self.matrix)

    def move_inside(self, places: Array) -> Array:
        """Parameters in the domain: on closed axes by whole periods, else to the nearest border."""
        low, high = self.domain
        period = np.where(self.periods > 0, self.periods, 1.0)
        turned = low + (places - low) % period
        is_out = (places < low) | (places > high)
        return np.clip(np.where(is_out & (self.periods > 0), turned, places), low, high)

    def find_inside(self, places: Array, *, is_fine: bool = True) -> Answers:
        """Whether parameters (m, 2) of the domain are in the region: `INSIDE`, `OUTSIDE`, `UNSURE`.

        Without `is_fine` all places are unsure that pieces of loops may meet.
        """
        answers = np.full(len(places), INSIDE, np.int8)
        if self.region is None:
            return answers
        is_inside, is_sure = self.region.find_inside(places)
        answers = np.where(is_sure, is_inside, UNSURE).astype(np.int8)
        unsure = np.flatnonzero(~is_sure)
        if is_fine and len(unsure) and self._sides is not None:
            is_left, is_sure = self._sides.find_left(places[unsure])
            answers[unsure] = np.where(is_sure, is_left, UNSURE)
        return answers


@dataclass(frozen=True, eq=False)
class Part:
    """All faces and borders; `seams` are the edges that are seams."""

    faces: list[Face]
    borders: list[Border]
    seams: list[Border]

    @cached_property
    def corners(self) -> Array:
        """The box (2, 3) about the placed control points of all faces."""
        points = np.concatenate(
            [
                place(face.net.points.reshape(-1, 3).astype(np.longdouble), face.matrix)
                for face in self.faces
            ]
        ).astype(np.float64)
        return np.stack([points.min(axis=0), points.max(axis=0)])


def place(points: Long, matrix: Array) -> Long:
    """Points (m, 3) after an affine map (4, 4)."""
    result: Long = points
    if (matrix != np.eye(4)).any():
        result = points @ matrix[:3, :3].T.astype(np.longdouble) + matrix[:3, 3]
    return result


def read_part(document: Document, truth: Document | None = None) -> Part:
    """The part of a brep, a group, or a Bézier patch.

    Regions are those of `truth`, a document with the right parameter curves, if it is given; edges
    are those of `document`.
    """
    part = Part([], [], [])
    for surface, matrix in iterate_members(document):
        if surface.get("type", "bezier") == "brep":
            _add_brep(part, surface, truth or surface, matrix)
        else:
            part.faces.append(Face(read_surface(surface), None, 0, matrix))
    return part


def iterate_members(document: Document) -> Iterator[tuple[Document, Array]]:
    """The surfaces of a group with their placements; of another surface, that with the identity."""
    if document.get("type") != "group":
        yield document, np.eye(4)
        return
    placed: list[Array] = []
    for member in document["members"]:
        matrix = np.array(member.get("matrix", np.eye(4)), dtype=np.float64)
        if member.get("parent") is not None:
            matrix = placed[member["parent"]] @ matrix
        placed.append(matrix)
        surface = member.get("surface")
        if member.get("definition") is not None:
            surface = document["definitions"][member["definition"]]
        if surface is not None:
            yield surface, matrix


def _add_brep(part: Part, brep: Document, truth: Document, matrix: Array) -> None:
    first = len(part.faces)
    numbers: dict[int, int] = {}
    for k, entry in enumerate(truth["faces"]):
        face = Face(read_surface(entry["surface"]), truth, k, matrix)
        part.faces.append(face)
        loops = entry.get("loops") or []
        edges = [e for loop in loops for e in loop.get("edges") or []]
        for edge in dict.fromkeys(edges):
            if brep["edges"][edge].get("degenerate"):
                continue
            if edges.count(edge) > 1 and (face.periods > 0).any():
                part.seams.append(_make_border(read_edge(brep, edge), matrix))
                continue
            if edge not in numbers:
                numbers[edge] = len(part.borders)
                part.borders.append(_make_border(read_edge(brep, edge), matrix))
            part.borders[numbers[edge]].faces.append(first + k)
            face.borders.append(numbers[edge])
        own = [
            _follow(face, coedge.curve)
            for loop in loops
            if not loop.get("edges")
            for coedge in iterate_coedges(truth, entry, loop, face.net, None)
        ]
        own += [] if loops else list(_list_sides(face))
        for border in own:
            border.faces.append(first + k)
            face.borders.append(len(part.borders))
            part.borders.append(border)


def _make_border(curve: Spline, matrix: Array) -> Border:
    first, last = curve.domain
    knots = curve.knots[(curve.knots >= first) & (curve.knots <= last)]
    return Border(curve.at, curve.domain, np.unique(knots), matrix)


def _follow(face: Face, curve: Spline) -> Border:
    """The curve on a surface over a parameter curve."""

    def evaluate(t: Array) -> Long:
        return face.net.at(face.move_inside(curve.at(t).astype(np.float64)))

    border = _make_border(curve, face.matrix)
    return Border(evaluate, border.domain, border.breaks, face.matrix)


def list_poles(face: Face) -> Array:
    """The points (n, 3) of the collapsed sides of a surface."""
    low, high = face.domain
    sides = [(axis, end) for axis in range(2) for end in (low, high)]
    points = [face.at(_place_along(face, *side)).astype(np.float64) for side in sides]
    poles = [each[0] for each in points if np.ptp(each, axis=0).max() <= _least_side(face)]
    return np.array(poles).reshape(-1, 3)


def _least_side(face: Face) -> float:
    return COLLAPSED * face.net.diagonal


def _place_along(face: Face, axis: int, end: Array) -> Array:
    """Parameters (9, 2) along the side of the domain where one parameter has its value in `end`."""
    low, high = face.domain
    places: Array = np.linspace(low, high, 9)
    places[:, axis] = end[axis]
    return places


def _list_sides(face: Face) -> Iterator[Border]:
    """The natural borders of a face without loops: sides that are no seams and no poles."""
    low, high = face.domain
    for axis in range(2):
        if face.periods[axis] > 0:
            continue
        for end in (low, high):
            places = _place_along(face, axis, end)
            ends, points = places[[0, -1]], face.net.at(places).astype(np.float64)
            if np.ptp(points, axis=0).max() > _least_side(face):
                knots = np.array([0.0, 0, 1, 1])
                yield _follow(face, Spline(1, knots, ends, np.ones(2)))
