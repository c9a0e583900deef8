"""Polygons of faces that are fine enough for a goal, and without crossings.

Edges are sampled for the tolerance, then halved where normals of the faces beside them turn too
far, where a surface is far from a chord, and where it runs along a chord unevenly.
"""

import numpy as np

from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.borders.border import Border, build_border, renew_border
from service.engine.brep.borders.border_measure import measure_border, refine_border
from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.borders.halving import halve_pieces
from service.engine.brep.borders.sampling import sample_edges
from service.engine.brep.borders.settling import LoopFaults, settle_border
from service.engine.brep.filling.angles import find_turning_sides
from service.engine.brep.filling.inner_points import LeafPoints
from service.engine.brep.filling.poles import split_poles
from service.engine.brep.filling.reverse import find_uneven_sides
from service.engine.brep.prepared import PreparedBrep

TURNS = 8
"""How often the sides of polygons are halved because normals turn too far, or the surface runs
along them unevenly."""

MOST_TURNS, SMOOTH = 32, 0.1
"""How often sides are halved whose normals turn by at most `SMOOTH` radians. Halving does not help
at creases, where they turn further than that."""

SIDE_WORK = 2e4
"""Multiplications to sample and measure a side of a polygon, approximately."""


def sample_borders(
    prepared: PreparedBrep, goal: Goal, limits: MeshLimits
) -> tuple[EdgeSamples, Border]:
    """Samples of edges, and polygons of loops that are near enough to the surfaces."""
    samples = sample_edges(prepared, goal.tolerance, limits)
    border = build_border(prepared, samples)
    if goal.angle < np.pi:
        for number in range(MOST_TURNS):
            _check_sides(border, limits)
            most = np.pi if number < TURNS else SMOOTH
            turning = find_turning_sides(prepared.places, border, goal.angle, most)
            samples, source = halve_pieces(prepared, samples, border.samples[turning])
            if not (source < 0).any():
                break
            border = renew_border(prepared, samples, border, source)
    _check_sides(border, limits)
    samples, border = refine_border(prepared, samples, border, goal)
    for _ in range(TURNS if goal.two_sided else 0):
        uneven = find_uneven_sides(prepared.places, border, samples.positions, goal.tolerance)
        samples, source = halve_pieces(prepared, samples, border.samples[uneven])
        if not (source < 0).any():
            break
        border = renew_border(prepared, samples, border, source)
        _check_sides(border, limits)
        samples, border = refine_border(prepared, samples, border, goal)
    return samples, border


def _check_sides(border: Border, limits: MeshLimits) -> None:
    """Count the work of sides, and the triangles that faces have at least.

    A polygon of k sides has at least k − 2 triangles.
    """
    limits.spend(SIDE_WORK * len(border.faces))
    is_side = border.begin_vertices != border.end_vertices
    sides = np.bincount(border.faces[is_side])
    limits.count(int(np.maximum(sides - 2, 0).sum()))


def settle_borders(
    prepared: PreparedBrep,
    samples: EdgeSamples,
    border: Border,
    leaves: LeafPoints,
    goal: Goal,
    *,
    limits: MeshLimits,
) -> tuple[EdgeSamples, Border, LoopFaults]:
    """Samples of poles, and polygons without conflicts; with the faults of loops that have some."""
    at_poles = split_poles(prepared, samples, leaves, border)
    if at_poles is not None:
        samples, source = at_poles
        border = renew_border(prepared, samples, border, source)
    samples, border, faults = settle_border(prepared, samples, border)
    _check_sides(border, limits)
    return samples, measure_border(prepared, samples, border, goal), faults
