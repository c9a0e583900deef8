"""Area, lengths of open borders, volume and centroid of a surface, each as an interval.

    area = Σ ∫∫ |N|,  N = S_u × S_v,  over all patches;  length = Σ ∫ |C′|  over all open edges

and volumes as `solids` says. Every interval [low, high] contains the exact value: it includes the
remainders of the rules (`remainders`), all rounding (`quadrature`), and the errors of control
points by lowering, placing and joining (`cells`, `solids`).
"""

import numpy as np

from service.bases.affine_combination import to_homogeneous
from service.engine.connectivity.orientation import LEFT, OrientedSides, orient_sides
from service.engine.connectivity.seams import Seams
from service.engine.joining.join import Allow, allow_any
from service.engine.measures.chains import chain_edges
from service.engine.measures.joined_surface import JoinedSurface, RequestSide, place_and_join
from service.engine.measures.patch_cells import build_cells, group_cells
from service.engine.measures.precision import measure_sizes
from service.engine.measures.solids import measure_solids
from service.engine.measures.values import (
    MAX_LISTED,
    Boundary,
    FaultyEdge,
    Interval,
    MeasureQuery,
    Measures,
    PartMeasures,
)
from service.engine.nets.query_nets import frame, surface_nets
from service.surface.lowered import Model
from service.surface.sides import BEGINS, ENDS


def measure(lowered: Model, query: MeasureQuery, allow: Allow = allow_any) -> Measures[RequestSide]:
    """Measure a surface, or all members of a group together.

    Parameters
    ----------
    allow : callable
        Is called with surfaces whose patches were split to join borders; raises an error if there
        are too many patches.

    Raises
    ------
    InvalidRequest
        `not_parametric`: tubes and ribbons have no measures.
    BudgetEnded
        The query is a trial, and a larger budget would change the result.
    """
    # Areas are measured on the patches of the request; borders and volumes on joined patches, which
    # are in `joined`.
    patch_model, part_of_patch, joined = place_and_join(lowered, query.weld_tolerance, allow)
    nets = surface_nets(patch_model.batches)
    groups = group_cells(nets, joined.point_error)
    sizes = measure_sizes(groups, part_of_patch, len(patch_model.parts), query)
    areas = [size.times(nets.scale**2) for size in sizes]
    oriented = orient_sides(joined.seams)
    closed_parts = oriented.find_closed_parts(joined.part, len(patch_model.parts))
    solids = measure_solids(joined, oriented.is_closed, closed_parts, (sizes, nets.scale), query)
    boundary_length, boundaries = _measure_boundaries(joined, oriented, query)
    (volume, centroid), *solid_parts = solids
    tolerance = query.tolerance
    sides = np.flatnonzero(oriented.find_unbalanced_sides().ravel())
    is_open = oriented.is_open.ravel()[sides]
    return Measures(
        area=areas[0],
        volume=volume,
        centroid=centroid,
        closed=oriented.is_closed,
        boundary_length=boundary_length,
        boundary_count=len(boundaries),
        boundaries=tuple(boundaries[:MAX_LISTED]),
        open_edges=int(is_open.sum()),
        inconsistent_edges=int((~is_open).sum()),
        faulty_edges=tuple(
            FaultyEdge(bool(is_side_open), joined.find_request_side(int(side)))
            for side, is_side_open in zip(sides[:MAX_LISTED], is_open, strict=False)
        ),
        parts=tuple(
            PartMeasures(part.name, area, *solid)
            for part, area, solid in zip(patch_model.parts, areas[1:], solid_parts, strict=True)
        ),
        reached=areas[0].is_within(tolerance * areas[0].value)
        and boundary_length.is_within(tolerance * boundary_length.value)
        and (volume is None or volume.is_within(tolerance * abs(volume.value)))
        and (
            centroid is None or all(c.is_within(tolerance * patch_model.diagonal) for c in centroid)
        ),
        moved=joined.moved,
    )


def _measure_boundaries(
    joined: JoinedSurface, oriented: OrientedSides, query: MeasureQuery
) -> tuple[Interval, list[Boundary[RequestSide]]]:
    """The length of all open edges together, and the open borders."""
    borders = _join_open_sides(joined.seams, oriented)
    if not borders:
        return Interval(0.0, 0.0, 0.0), []
    edges = np.concatenate([oriented.edge.ravel()[border] for border, _ in borders])
    numbers = np.arange(len(borders))
    border_of_edge = np.full(joined.seams.edge_count, -1)
    border_of_edge[edges] = np.repeat(numbers, [len(border) for border, _ in borders])
    origin, scale, _ = frame(*joined.model.bounds)
    point_error = (joined.point_error + joined.moved) / scale
    # In cells of curves, the number of the border stands for the number of the patch.
    groups = []
    for curves in joined.seams.curves:
        rows = border_of_edge[curves.ids] >= 0
        if rows.any():
            weights = None if curves.weights is None else curves.weights[rows]
            pieces = to_homogeneous((curves.points[rows] - origin) / scale, weights)
            groups.append(
                build_cells(pieces[:, :, np.newaxis], border_of_edge[curves.ids[rows]], point_error)
            )
    lengths = measure_sizes(groups, numbers, len(borders), query)
    total, *each_length = [length.times(scale) for length in lengths]
    return total, [
        Boundary(length, len(border), is_closed, joined.find_request_side(border[0]))
        for length, (border, is_closed) in zip(each_length, borders, strict=True)
    ]


def _join_open_sides(seams: Seams, oriented: OrientedSides) -> list[tuple[list[int], bool]]:
    """The open sides as borders with the patches on their left, in the order of their first sides.

    A border is a list of sides, as numbers patch · 4 + side, and whether it is closed.
    """
    sides = np.flatnonzero(oriented.is_open.ravel())
    begins, ends = (seams.corner[:, corners].ravel()[sides] for corners in (BEGINS, ENDS))
    # A side that has its patch on the right is passed from its end to its beginning.
    is_reversed = np.tile(LEFT < 0, len(seams.edge))[sides]
    begins, ends = np.where(is_reversed, ends, begins), np.where(is_reversed, begins, ends)
    return [(sides[border].tolist(), is_closed) for border, is_closed in chain_edges(begins, ends)]
