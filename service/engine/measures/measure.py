"""Area, lengths of open borders, volume and centroid of a surface, each as an interval.

    area = Σ ∫∫ |N|,  N = S_u × S_v,  over all patches;  length = Σ ∫ |C′|  over all open edges

and volumes as `solids` says. Every interval [low, high] contains the exact value: it includes the
remainders of the rules (`remainders`), all rounding (`rules`), and the errors of control points by
lowering, placing and joining (`local_nets`, `solids`).
"""

import numpy as np

from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import Ints
from service.engine.connectivity.orientation import OrientedSides, orient_sides
from service.engine.joining.join import Allow, allow_any
from service.engine.measures.boundaries import join_open_sides
from service.engine.measures.cells import Cells, cells_of, group_cells
from service.engine.measures.integrals import estimate
from service.engine.measures.precision import REMAINDER_SHARE, Precision
from service.engine.measures.solids import measure_solids
from service.engine.measures.sources import Source, place_and_join
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


def measure(lowered: Model, query: MeasureQuery, allow: Allow = allow_any) -> Measures:
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
    TooLarge
        `too_costly`: the budget of the query does not suffice for its tolerance, but would suffice
        for a larger one.
    """
    # Areas are measured on the patches of the request; borders and volumes on joined patches, which
    # are in `source`.
    patch_model, part_of_patch, source = place_and_join(lowered, query.weld_tolerance, allow)
    precision = Precision(query)
    nets = surface_nets(patch_model.batches)
    groups = group_cells(nets, source.noise)
    sizes = _measure_sizes("the area", groups, part_of_patch, len(patch_model.parts), precision)
    areas = [size.times(nets.scale**2) for size in sizes]
    oriented = orient_sides(source.seams)
    closed_parts = oriented.find_closed_parts(source.part, len(patch_model.parts))
    solids = measure_solids(
        source, oriented.is_closed, closed_parts, (sizes, nets.scale), precision
    )
    boundary_length, boundaries = _measure_boundaries(source, oriented, precision)
    precision.refuse_if_too_costly()
    (volume, centroid), *solid_parts = solids
    tolerance = query.tolerance
    faults = oriented.find_unbalanced_sides()
    sides = np.flatnonzero(faults.ravel())
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
            FaultyEdge(bool(is_side_open), source.find_request_side(int(side)))
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
        moved=source.moved,
    )


def _measure_sizes(
    name: str, groups: list[Cells], part: Ints, count: int, precision: Precision
) -> list[Interval]:
    """The areas or lengths of all cells together, and then of each of `count` parts.

    Patch k belongs to part `part[k]`. The results are in the coordinates of the cells, which do not
    underflow. The list is empty if the query will be refused.
    """
    sizes, rounding = estimate(groups, "size")
    integrals = precision.integrate(name, groups, "size", REMAINDER_SHARE * sizes, rounding)
    if integrals is None:
        return []
    sums, errors = integrals.over_parts(part, count)
    return [
        Interval.about(value, error).without_negatives()
        for value, error in zip(sums[0].tolist(), errors[0].tolist(), strict=True)
    ]


def _measure_boundaries(
    source: Source, oriented: OrientedSides, precision: Precision
) -> tuple[Interval, list[Boundary]]:
    """The length of all open edges together, and the open borders.

    The list is empty if the query will be refused.
    """
    borders = join_open_sides(source.seams, oriented)
    if not borders:
        return Interval(0.0, 0.0, 0.0), []
    edges = np.concatenate([oriented.edge.ravel()[list(border.sides)] for border in borders])
    numbers = np.arange(len(borders))
    border_of_edge = np.full(source.seams.edge_count, -1)
    border_of_edge[edges] = np.repeat(numbers, [len(border.sides) for border in borders])
    origin, scale, _ = frame(*source.model.bounds)
    noise = (source.noise + source.moved) / scale
    # In cells of curves, the number of the border stands for the number of the patch.
    groups = []
    for curves in source.seams.curves:
        rows = border_of_edge[curves.ids] >= 0
        if rows.any():
            weights = None if curves.weights is None else curves.weights[rows]
            pieces = to_homogeneous((curves.points[rows] - origin) / scale, weights)
            groups.append(
                cells_of(pieces[:, :, np.newaxis], border_of_edge[curves.ids[rows]], noise)
            )
    lengths = _measure_sizes("the borders", groups, numbers, len(borders), precision)
    if not lengths:
        return Interval(0.0, 0.0, 0.0), []
    total, *each_length = [length.times(scale) for length in lengths]
    return total, [
        Boundary(
            length, len(border.sides), border.is_closed, source.find_request_side(border.sides[0])
        )
        for length, border in zip(each_length, borders, strict=True)
    ]
