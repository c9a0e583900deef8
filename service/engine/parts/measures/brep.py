"""The measures of one placed brep: areas, volumes and centroids of its shells, lengths of edges.

Proofs in docs/proofs.md: "Panels of trimmed faces" and "Closing the gaps of edges".
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.measures.cells import UPWARDS
from service.engine.measures.integrals import Integrable, estimate
from service.engine.measures.panels import Panels
from service.engine.measures.patch_cells import PatchCells
from service.engine.measures.precision import REMAINDER_SHARE, integrate, measure_sizes
from service.engine.measures.solids import Solid, find_solid
from service.engine.measures.values import Interval, MeasureQuery
from service.engine.parts.edge_uses import EdgeUses
from service.engine.parts.measures.border_pieces import BorderPieces, cut_borders
from service.engine.parts.measures.edge_lengths import list_border_cells, list_edge_cells
from service.engine.parts.measures.edge_strips import close_faces
from service.engine.parts.measures.placed import PlacedBrep
from service.engine.parts.measures.region_panels import PanelPlan

NOTHING = Interval(0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False, slots=True)
class BrepMeasures:
    """The measures of a placed brep, in model units.

    Attributes
    ----------
    areas : list of Interval
        Of the brep, and of each shell.
    solids : list of Solid
        Likewise; (None, None) for those that are not closed.
    edge_length : Interval
        Of all edges of the model together.
    edge_lengths : list of Interval
        Of each edge.
    boundary_length : Interval
    boundary_lengths : list of Interval
        Of each open border of `borders`.
    borders : list of (ndarray of int, bool)
        The coedges of each open border, and whether it is closed.
    uses : EdgeUses
    """

    areas: list[Interval]
    solids: list[Solid]
    edge_length: Interval
    edge_lengths: list[Interval]
    boundary_length: Interval
    boundary_lengths: list[Interval]
    borders: list[tuple[Ints, bool]]
    uses: EdgeUses


AllowPanels: TypeAlias = Callable[[int, tuple[int, int]], None]
"""Is called with the number of panels and the highest degree of their patches; raises an error if
they take too much work."""


def allow_all(count: int, degree: tuple[int, int]) -> None:
    """Allow any number of panels."""


def measure_brep(
    placed: PlacedBrep, query: MeasureQuery, allow: AllowPanels = allow_all
) -> BrepMeasures:
    """Measure a placed brep."""
    prepared, scale = placed.prepared, placed.frame.scale
    uses = EdgeUses.of(prepared)
    areas = [NOTHING] * (1 + len(prepared.model.shell_counts))
    solids: list[Solid] = [(None, None)] * len(areas)
    if len(prepared.coedge_edges):
        areas, solids = _measure_faces(placed, uses, query, allow)
    every = np.arange(len(prepared.model.edge_curves))
    lengths = _measure_lengths(list_edge_cells(placed), len(every), query)
    borders = uses.chain_open()
    coedges = np.concatenate([np.zeros(0, np.intp), *(chain for chain, _ in borders)])
    border = np.repeat(np.arange(len(borders)), [len(chain) for chain, _ in borders])
    cells = list_border_cells(placed, coedges, border)
    boundaries = _measure_lengths(cells, len(borders), query)
    return BrepMeasures(
        [area.times(scale**2) for area in areas],
        solids,
        lengths[0].times(scale),
        [length.times(scale) for length in lengths[1:]],
        boundaries[0].times(scale),
        [length.times(scale) for length in boundaries[1:]],
        borders,
        uses,
    )


def _measure_faces(
    placed: PlacedBrep, uses: EdgeUses, query: MeasureQuery, allow: AllowPanels
) -> tuple[list[Interval], list[Solid]]:
    """Areas, and volumes and centroids, of the brep, and then of each shell."""
    prepared = placed.prepared
    pieces = cut_borders(prepared)
    plan = PanelPlan.of(placed, pieces)
    degrees = [group.degree for group in prepared.surfaces.nets.groups]
    allow(plan.count, (max(p for p, _ in degrees), max(q for _, q in degrees)))
    panels = plan.build()
    shell, count = np.maximum(prepared.model.face_shells, 0), len(prepared.model.shell_counts)
    drifts = np.zeros(count)
    drifts += np.bincount(shell, _bound_drifts(placed, pieces), minlength=count)
    areas = [NOTHING] * (1 + count)
    if panels:
        areas = measure_sizes(panels, shell, count, query, more_errors=drifts)
    if panels and uses.closed_shells.any():
        return areas, _measure_solids(placed, pieces, panels, uses=uses, query=query)
    return areas, [(None, None)] * (1 + count)


def _measure_lengths(cells: list[PatchCells], count: int, query: MeasureQuery) -> list[Interval]:
    """The length of all cells of curves together, and of each of `count` edges or borders."""
    if not cells:
        return [NOTHING] * (1 + count)
    return measure_sizes(cells, np.arange(count), count, query.of_edges())


def _bound_drifts(placed: PlacedBrep, borders: BorderPieces) -> FloatArray:
    """How much the areas of faces change where borders were moved, (F,), in the frame."""
    pieces = borders.pieces
    variation = np.empty_like(pieces.moved)
    for nets in borders.nets:
        points = nets.values[:2] / nets.values[2:] if len(nets.values) > 2 else nets.values
        variation[:, nets.rows] = np.abs(np.diff(points, axis=1)).sum(axis=1)
    # The border moves by δ_u across a distance along v, and by δ_v across a distance along u.
    moved = (pieces.moved * (variation + 2 * pieces.moved)[::-1]).sum(axis=0)
    change = 2 * moved * pieces.speeds.prod(axis=0) * placed.stretch**2
    total = np.zeros(len(placed.sides))
    total += np.bincount(pieces.face, change, minlength=len(total))
    return total


def _measure_solids(
    placed: PlacedBrep,
    pieces: BorderPieces,
    panels: list[Panels],
    *,
    uses: EdgeUses,
    query: MeasureQuery,
) -> list[Solid]:
    """The volume and centroid of the brep, and then of each shell.

    They are None for those that are not closed.
    """
    prepared, radius = placed.prepared, placed.radius
    shells = np.maximum(prepared.model.face_shells, 0)
    closing = close_faces(placed, pieces)
    is_measured = uses.closed_shells[shells]
    every: list[Integrable] = [*panels, *closing.strips]
    groups = [each.take(is_measured[each.patch]) for each in every]
    groups = [each for each in groups if len(each)]
    (flux, *_), rounding = estimate(groups, "flux")
    # As in `solids`: the scales of the flux and of its moment.
    scales = abs(flux) * np.array([REMAINDER_SHARE, radius / 4])
    integrals = integrate(groups, "flux", scales, rounding, query)
    count = len(uses.closed_shells)
    sums, errors = integrals.over_parts(shells, count)
    more = np.zeros((2, count))
    # The flux of a tube about the origin is three times its volume, its moment four times the
    # integral of x.
    for row, tube in enumerate((3.0, 4 * radius)):
        leaks = closing.leaks * radius**row + tube * closing.tubes
        more[row] += np.bincount(shells, np.where(is_measured, leaks, 0.0), minlength=count)
    errors += np.concatenate([more.sum(axis=1, keepdims=True), more], axis=1)
    has_volume = [uses.is_closed, *uses.closed_shells.tolist()]
    return [
        find_solid(sums[:, k], errors[:, k] * UPWARDS, placed.frame.origin, placed.frame.scale)
        if closed
        else (None, None)
        for k, closed in enumerate(has_volume)
    ]
