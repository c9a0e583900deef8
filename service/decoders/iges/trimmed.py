"""Trimmed faces: a surface and loops of sides, each face with sides of its own.

The curves of space of a file are the sides. Where a file has curves of parameters only, the sides
are curves fitted to their images on the surface.

References
----------
IGES 5.3, sections 4.10 (108), 4.32 to 4.35 (141 to 144).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.outline import NO_OUTLINE, Outline
from service.decoders.cad.splines import drop_z, project_points, reverse, transform
from service.decoders.iges.entities import Entity
from service.decoders.iges.faults import Fault, Unsupported
from service.decoders.iges.feet import find_periods
from service.decoders.iges.images import fit_sides, list_borders
from service.decoders.iges.polygons import close_polygons, draw_polygon, find_turned_loops
from service.decoders.iges.readers import Readers
from service.decoders.iges.sides import Side, chain_curves, pair_curves
from service.decoders.iges.surfaces import TYPES, BaseSurface

FACES = frozenset({143, 144})
"""Types of trimmed faces."""

_SPACE_PREFERRED = 2
_REVERSED = 2
_BOUNDED = 1


@dataclass(frozen=True, eq=False, slots=True)
class TrimmedFace:
    """A face of its own.

    Attributes
    ----------
    number : int
        The directory entry.
    surface : Surface
    loops : tuple of tuples of Side
        Material is on their left, seen against du × dv. Without loops it is the whole surface.
    gap : float
        The largest distance of a side from the surface that was found.
    polygons : tuple of ndarray of float64
        Points (k, 2) of parameters along the borders of the face, closed: the outer one runs
        counter-clockwise.
    """

    number: int
    surface: Surface
    loops: tuple[tuple[Side, ...], ...]
    polygons: tuple[FloatArray, ...]
    gap: float


@dataclass(frozen=True, eq=False, slots=True)
class _Boundary:
    """The curves of a loop: in space, in parameters of the file, and which of them counts."""

    curves: list[Curve]
    pcurves: list[Curve]
    prefers_space: bool


class TrimmedReader:
    """Reads trimmed faces."""

    def __init__(self, readers: Readers) -> None:
        self._file = readers.file
        self._budget = readers.budget
        self._transformations = readers.transformations
        self._curves = readers.curves
        self._surfaces = readers.surfaces

    def read(self, number: int) -> TrimmedFace:
        """The face of an entity: a trimmed surface, or a whole one.

        Raises
        ------
        Fault, InvalidGeometry
            The surface or a loop is damaged, or of a kind that is not read.
        """
        self._budget.add_face()
        entity = self._file.read(number)
        parameters = entity.parameters
        matrix = self._transformations.find(entity.matrix)
        if entity.type == 144:
            base = self._surfaces.read(parameters.pointer(0))
            loops = parameters.pointers(4, parameters.count(2))
            boundaries: list[_Boundary | None] = [*map(self._read_curve_on_surface, loops)]
            has_own = parameters.integer(1, 0)
            boundaries.insert(
                0, self._read_curve_on_surface(parameters.pointer(3)) if has_own else None
            )
        elif entity.type == 143:
            base = self._surfaces.read(parameters.pointer(1))
            loops = parameters.pointers(3, parameters.count(2))
            boundaries = [*map(self._read_boundary, loops)] or [None]
        elif entity.type == 108 and entity.form == _BOUNDED:
            # The curve is moved with the plane.
            base = BaseSurface(self._surfaces.read(number).shape)
            boundaries = [
                _Boundary(chain_curves(self._curves.read(parameters.pointer(4))), [], True)
            ]
        elif entity.type in TYPES:
            base, matrix, boundaries = self._surfaces.read(number), None, [None]
        else:
            raise Unsupported(f"a face of type {entity.type} is not read")
        return _build_face(number, base, boundaries, matrix)

    def _read_curve_on_surface(self, number: int) -> _Boundary:
        """A curve on a parametric surface (142)."""
        entity = self._file.read(number)
        if entity.type == 141:
            return self._read_boundary(number)
        if entity.type != 142:
            raise Fault(f"the boundary of a face is of type {entity.type}")
        parameters = entity.parameters
        pcurves, curves = (
            chain_curves(self._curves.read(pointer)) if pointer else []
            for pointer in parameters.pointers(2, 2)
        )
        prefers_space = parameters.integer(4, 0) == _SPACE_PREFERRED
        return self._move(entity, curves, pcurves, prefers_space)

    def _read_boundary(self, number: int) -> _Boundary:
        """A boundary (141): curves of space, each with curves of parameters."""
        entity = self._file.read(number, 141)
        parameters = entity.parameters
        prefers_space = parameters.integer(1, 0) == _SPACE_PREFERRED
        position = 4
        curves: list[Curve] = []
        pcurves: list[Curve] = []
        for _ in range(parameters.count(3)):
            pieces = chain_curves(self._curves.read(parameters.pointer(position)))
            if parameters.integer(position + 1, 1) == _REVERSED:
                pieces = [reverse(piece) for piece in reversed(pieces)]
            curves += pieces
            count = parameters.count(position + 2)
            for pointer in parameters.pointers(position + 3, count):
                pcurves += self._curves.read(pointer)
            position += 3 + count
        return self._move(entity, chain_curves(curves), chain_curves(pcurves), prefers_space)

    def _move(
        self, entity: Entity, curves: list[Curve], pcurves: list[Curve], prefers_space: bool
    ) -> _Boundary:
        matrix = self._transformations.find(entity.matrix)
        if matrix is not None:
            curves = [transform(curve, matrix) for curve in curves]
        return _Boundary(curves, [drop_z(pcurve) for pcurve in pcurves], prefers_space)


def _build_face(
    number: int,
    base: BaseSurface,
    boundaries: Sequence[_Boundary | None],
    matrix: FloatArray | None,
) -> TrimmedFace:
    """A face of its boundaries; None stands for the border of the surface."""
    surface = base.cut(_find_outline([each.curves for each in boundaries if each is not None]))
    has_outer = True
    loops: list[tuple[Side, ...]] = []
    polygons: list[FloatArray] = []
    gaps = [0.0]
    for boundary in boundaries:
        if boundary is not None:
            sides, (polygon, gap) = _build_loop(base, surface, boundary)
        elif base.parameters is not None:
            sides = list_borders(surface)
            polygon, gap = draw_polygon(surface, sides)
        elif base.is_bounded:
            has_outer = False
            continue
        else:
            raise Unsupported("the outer boundary of an unbounded surface is not known")
        loops.append(tuple(sides))
        polygons.append(polygon)
        gaps.append(gap)
    for loop, is_turned in enumerate(find_turned_loops(surface, polygons, has_outer)):
        if is_turned:
            loops[loop] = tuple(side.turn() for side in reversed(loops[loop]))
            polygons[loop] = polygons[loop][::-1]
    polygons = close_polygons(surface, polygons)
    if matrix is not None:
        surface = transform(surface, matrix)
        loops = [tuple(side.move(matrix) for side in loop) for loop in loops]
    return TrimmedFace(number, surface, tuple(loops), tuple(polygons), max(gaps))


def _find_outline(loops: Sequence[Sequence[Curve]]) -> Outline:
    """The outline of a face with these curves."""
    nets = [[project_points(curve.points) for curve in loop] for loop in loops if loop]
    if not nets:
        return NO_OUTLINE
    sizes = tuple(sum(map(len, loop)) for loop in nets)
    flat = [net for loop in nets for net in loop]
    return Outline(np.concatenate(flat), np.concatenate([net[[0, -1]] for net in flat]), sizes)


def _build_loop(
    base: BaseSurface, surface: Surface, boundary: _Boundary
) -> tuple[list[Side], tuple[FloatArray, float]]:
    """The sides of a loop, and its polygon of parameters with the gap (`draw_polygon`)."""
    exact: list[Curve | None] = []
    near: list[Curve] = []
    if base.parameters is not None:
        pcurves = base.parameters.move_into(surface, boundary.pcurves)
        exact = [base.parameters.map_curve(surface, pcurve) for pcurve in pcurves]
        near = [
            base.parameters.map_corners(surface, pcurve) if curve is None else curve
            for curve, pcurve in zip(exact, pcurves, strict=True)
        ]
    if not boundary.curves:
        if not exact or None in exact:
            raise Unsupported("the boundary has no curve in space")
        sides = fit_sides(surface, near)
        return sides, draw_polygon(surface, sides)
    sides = [Side(curve) for curve in boundary.curves]
    if not near:
        return sides, draw_polygon(surface, sides)
    paired = pair_curves(surface, boundary.curves, near)
    polygon = draw_polygon(surface, paired)
    # On a closed surface the file's curves tell on which side of a seam an edge is.
    if None in exact or (boundary.prefers_space and not any(find_periods(surface))):
        return sides, polygon
    return paired, polygon
