"""The parameter curves that a file gives for the edges of a face.

They are used where the surface of the face keeps its parameters: splines, and splines that are
extruded. On planes and other elementary surfaces the service makes its own, which takes no longer
than reading those of the file; and there the parameter of the spline is no angle.

A parameter curve must run at the parameters of its edge. So those of circles and ellipses stay
away: their arcs are rational, with parameters that are no angles.

References
----------
ISO 10303-42, clause 4.4: pcurve, surface_curve, seam_curve;
ISO 10303-43: definitional_representation.
"""

from collections.abc import Sequence

import numpy as np

from service.decoders.cad.conics import Line
from service.decoders.cad.content import Coedge, Curve
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.splines import drop_z, find_domain, find_ends, reverse, segment
from service.decoders.step.curves import SURFACE_CURVES
from service.decoders.step.edges import EdgeReader, Source
from service.decoders.step.entities import Entities
from service.decoders.step.records import as_reference, as_references

MAX_PCURVES = 8
"""The most parameter curves of one edge that are looked at."""

OUTSIDE = 1e-6
"""A parameter curve may end before its edge by this share of its domain."""


class PcurveReader:
    """Finds the parameter curves of edges on surfaces."""

    def __init__(self, entities: Entities, edges: EdgeReader) -> None:
        self._entities = entities
        self._edges = edges

    def add(self, loop: Sequence[Coedge], surface: int) -> list[Coedge]:
        """The coedges of a loop, with the parameter curves that the file gives on a surface.

        Parameters
        ----------
        loop : sequence of Coedge
            Its material is on the left, seen against du × dv.
        surface : int
            The number of the surface of the face.
        """
        return [
            Coedge(each.edge, each.is_reversed, _choose(self._find(each.edge, surface), each))
            for each in loop
        ]

    def _find(self, edge: int, surface: int) -> list[Curve]:
        """The parameter curves of an edge on a surface; on a seam there are two."""
        source = self._edges.find_source(edge)
        if source is None:
            return []
        try:
            entity = self._entities.read(source.data.curve)
            if entity.keyword not in SURFACE_CURVES:
                return []
            numbers = as_references(entity.parameter(2))[:MAX_PCURVES]
            found = [self._read(number, surface, source) for number in numbers]
        except (InvalidGeometry, ArithmeticError):
            return []
        return [curve for curve in found if curve is not None]

    def _read(self, number: int, surface: int, source: Source) -> Curve | None:
        """A parameter curve, cut to the edge and along it; None if it is on another surface."""
        entity = self._entities.read(number)
        if entity.keyword not in ("PCURVE", "BOUNDED_PCURVE"):
            return None
        if as_reference(entity.parameter(1)) != surface:
            return None
        definition = self._entities.read(as_reference(entity.parameter(2)))
        (item,) = as_references(definition.parameter(1))[:1] or [-1]
        span = self._edges.find_span(source)
        if span is None:
            return None
        first, last = span
        low, high = min(span), max(span)
        basis = self._edges.curves.read_piece(item)
        if isinstance(basis, Curve):
            begin, end = find_domain(basis)
            margin = OUTSIDE * (end - begin)
            if low < begin - margin or high > end + margin:
                return None
            curve = segment(basis, low, high)
        elif isinstance(basis, Line):
            curve = basis.cut(low, high)
        else:
            return None
        self._entities.budget.count_points(len(curve.points))
        return drop_z(curve if first < last else reverse(curve))


def _choose(curves: Sequence[Curve], coedge: Coedge) -> Curve | None:
    """The parameter curve of a coedge: on a seam the one that has the material on its left.

    Two curves at different u run along v. The loop runs upwards at the end of u, because there the
    left is towards smaller u, and downwards at its beginning; at the end of v it runs towards
    smaller u.
    """
    if len(curves) < 2:
        return curves[0] if curves else None
    ends = np.stack([find_ends(curve) for curve in curves[:2]])
    middles = ends.mean(axis=1)
    apart = np.abs(middles[1] - middles[0])
    travel = (ends[:, 1] - ends[:, 0]).mean(axis=0) * (-1 if coedge.is_reversed else 1)
    axis = int(apart.argmax())
    other = travel[1 - axis]
    if not apart[axis] > 0 or other == 0:
        return None
    wants_larger = other > 0 if axis == 0 else other < 0
    return curves[int((middles[1, axis] > middles[0, axis]) == wants_larger)]
