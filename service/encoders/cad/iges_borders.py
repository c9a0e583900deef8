"""Loops of faces as IGES needs them: the outer one first, and natural borders found."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.encoders.cad.shapes import find_lines
from service.surface.brep_model import BrepModel
from service.surface.spline_tables import expand_rows

SIDES = 4
"""The sides of a surface."""


@dataclass(frozen=True, eq=False, slots=True)
class Borders:
    """Which loops run along the borders of surfaces.

    Attributes
    ----------
    has_lines : ndarray of bool, shape (L,)
        Whether all parameter curves of a loop are lines on the border of the domain.
    is_whole : ndarray of bool, shape (F,)
        Whether the face is its whole surface, and the natural border of this has the same edges:
        one for each side, of which some are poles or seams; or there are poles and seams only.
    """

    has_lines: Bools
    is_whole: Bools


def find_borders(body: BrepModel) -> Borders:
    """The loops of a brep that run along the borders of surfaces."""
    faces, edges = body.coedge_faces, body.coedge_edges
    loops = len(body.loop_counts)
    # A seam is used twice by a face.
    key = faces * (len(body.edge_vertices) + 1) + edges
    _, number, uses = np.unique(key, return_inverse=True, return_counts=True)
    is_closing = body.is_degenerate[edges] | (uses[number] == 2)
    is_side = _find_sides(body)

    def count(rows: Bools) -> Ints:
        return np.bincount(body.coedge_loops[rows], minlength=loops)

    has_lines = count(is_side) == body.loop_counts
    closing = count(is_closing)
    is_natural = has_lines & (body.loop_counts == SIDES) & (closing > 0)
    is_natural |= closing == body.loop_counts
    loops_of_face = np.bincount(body.loop_faces, minlength=body.face_count)
    is_whole = loops_of_face == 0
    is_whole[body.loop_faces[is_natural & (loops_of_face[body.loop_faces] == 1)]] = True
    return Borders(has_lines, is_whole)


def _find_sides(body: BrepModel) -> Bools:
    """Which coedges have a parameter curve that is a line on the border of the domain, (C,)."""
    pcurves = body.coedge_pcurves
    rows = np.flatnonzero(pcurves >= 0)
    table, domains = body.pcurves, body.surfaces.domains[body.coedge_faces]
    is_line = find_lines(table)[pcurves[rows]]
    rows = rows[is_line]
    first = table.point_starts[pcurves[rows]]
    begin, end = table.points[first], table.points[first + 1]
    on_border = (begin == end) & (begin[:, :, np.newaxis] == domains[rows]).any(axis=2)
    is_side = np.zeros(len(pcurves), bool)
    is_side[rows] = on_border.any(axis=1)
    return is_side


def sort_loops(body: BrepModel, loops: Sequence[int]) -> list[int]:
    """The loops of a face, the outer one first: that whose edges have the largest box."""
    if len(loops) < 2:
        return list(loops)

    def measure(loop: int) -> float:
        """The square of the diagonal of the box about the control points of the edges."""
        begin, end = body.loop_starts[loop : loop + 2].tolist()
        curves = body.edge_curves[body.coedge_edges[begin:end]]
        rows = expand_rows(body.curves.point_starts, curves[curves >= 0])
        if not len(rows):
            return 0.0
        return float(np.square(np.ptp(body.curves.points[rows], axis=0)).sum())

    return sorted(loops, key=measure, reverse=True)
