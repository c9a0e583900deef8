"""The measures of several bodies together."""

from collections.abc import Sequence
from itertools import islice
from math import dist

import numpy as np

from service.engine.measures.joined_surface import RequestSide
from service.engine.measures.solids import Solid
from service.engine.measures.values import (
    MAX_EDGES,
    MAX_LISTED,
    Boundary,
    FaceEdge,
    FaultyEdge,
    Interval,
    Measures,
    PartMeasures,
)
from service.engine.parts.copies import BrepCopy, Members
from service.engine.parts.measures.brep import BrepMeasures
from service.engine.scenes.placing import scalings
from service.surface.placement import join_boxes, place_box


def join_measures(
    members: Members,
    copies: Sequence[BrepMeasures],
    others: Measures[RequestSide] | None,
    parts: tuple[PartMeasures, ...],
    tolerance: float,
) -> Measures[RequestSide | FaceEdge]:
    """The measures of a whole part.

    Parameters
    ----------
    members : Members
    copies : sequence of BrepMeasures
        Those of all copies of breps.
    others : Measures or None
        Those of all members without trims together.
    parts : tuple of PartMeasures
    tolerance : float
        The largest relative width of intervals.
    """
    rest = () if others is None else (others,)
    area = Interval.total([*(each.areas[0] for each in copies), *(each.area for each in rest)])
    border = Interval.total(
        [
            *(each.boundary_length for each in copies),
            *(each.boundary_length for each in rest),
        ]
    )
    volume, centroid = add_solids(
        [*(each.solids[0] for each in copies), *((each.volume, each.centroid) for each in rest)]
    )
    boundaries: list[Boundary[RequestSide | FaceEdge]] = [
        each for one in rest for each in one.boundaries
    ]
    faulty: list[FaultyEdge[RequestSide | FaceEdge]] = [
        each for one in rest for each in one.faulty_edges
    ]
    first_edge = open_edges = inconsistent = 0
    gap = 0.0
    for copy, measures in zip(members.copies, copies, strict=True):
        namer = _EdgeNames(members, copy, first_edge)
        boundaries += namer.list_boundaries(measures)
        faulty += namer.list_faulty(measures)
        first_edge += len(measures.edge_lengths)
        open_edges += int(measures.uses.is_open.sum())
        inconsistent += int((~measures.uses.is_open).sum())
        prepared = members.definitions[copy.definition]
        largest = float(prepared.close_gaps.max(initial=prepared.left_out_gap))
        gap = max(gap, largest * scalings(copy.matrix)[1])
    lengths = islice((length for each in copies for length in each.edge_lengths), MAX_EDGES)
    total_length = Interval.total([each.edge_length for each in copies])
    widths = [
        (area, tolerance * area.value),
        (border, tolerance * border.value),
        (total_length, tolerance * total_length.value),
        *([] if volume is None else [(volume, tolerance * abs(volume.value))]),
        *((each, tolerance * _find_diagonal(members)) for each in centroid or ()),
    ]
    return Measures(
        area=area,
        volume=volume,
        centroid=centroid,
        closed=all([each.uses.is_closed for each in copies] + [each.closed for each in rest]),
        boundary_length=border,
        boundary_count=sum(len(each.borders) for each in copies)
        + sum(each.boundary_count for each in rest),
        boundaries=tuple(boundaries[:MAX_LISTED]),
        open_edges=open_edges + sum(each.open_edges for each in rest),
        inconsistent_edges=inconsistent + sum(each.inconsistent_edges for each in rest),
        faulty_edges=tuple(faulty[:MAX_LISTED]),
        parts=parts,
        reached=all(interval.is_within(width) for interval, width in widths),
        moved=max((each.moved for each in rest), default=0.0),
        edge_lengths=tuple(lengths),
        gap_bound=gap,
        skipped_faces=tuple(members.list_skipped()),
    )


def add_solids(solids: Sequence[Solid]) -> Solid:
    """The volume and centroid of all solids; (None, None) if one of them has no volume.

    Centroids are taken relative to the first one, so that sums have small numbers.
    """
    if len(solids) == 1:
        return solids[0]
    volumes = [volume for volume, _ in solids if volume is not None]
    if len(volumes) < len(solids):
        return None, None
    total = Interval.total(volumes)
    inverse = total.inverse()
    centroids = [centroid for _, centroid in solids if centroid is not None]
    if inverse is None or len(centroids) < len(solids):
        return total, None
    result = []
    for coordinates in zip(*centroids, strict=True):
        origin = coordinates[0].value
        moments = [
            volume.product(each.plus(-origin))
            for volume, each in zip(volumes, coordinates, strict=True)
        ]
        result.append(Interval.total(moments).product(inverse).plus(origin))
    return total, tuple(result)


class _EdgeNames:
    """The edges of a copy of a brep, by their numbers in the request."""

    def __init__(self, members: Members, copy: BrepCopy, first_edge: int) -> None:
        self._prepared = members.definitions[copy.definition]
        self._first_patch, self._first_edge = copy.first_patch, first_edge

    def list_boundaries(self, measures: BrepMeasures) -> list[Boundary[FaceEdge]]:
        """The open borders of the copy, at most `MAX_LISTED`."""
        pairs = zip(measures.boundary_lengths, measures.borders, strict=True)
        return [
            Boundary(length, len(coedges), is_closed, self.find_edge(int(coedges[0])))
            for length, (coedges, is_closed) in list(pairs)[:MAX_LISTED]
        ]

    def list_faulty(self, measures: BrepMeasures) -> list[FaultyEdge[FaceEdge]]:
        """The edges of the copy that are not balanced, at most `MAX_LISTED`."""
        faulty, is_open = measures.uses.faulty[:MAX_LISTED], measures.uses.is_open
        return [
            FaultyEdge(each, self.find_edge(coedge))
            for each, coedge in zip(is_open.tolist(), faulty.tolist(), strict=False)
        ]

    def find_edge(self, coedge: int) -> FaceEdge:
        """The edge of a coedge."""
        prepared = self._prepared
        source = int(prepared.edge_sources[prepared.coedge_edges[coedge]])
        edge = self._first_edge + source if source >= 0 else None
        return FaceEdge(self._first_patch + int(prepared.coedge_faces[coedge]), edge)


def _find_diagonal(members: Members) -> float:
    """The diagonal of the box of a part."""
    boxes = [
        place_box((box[0], box[1]), copy.matrix)
        for copy in members.copies
        for box in (members.definitions[copy.definition].box,)
    ]
    if members.patches is not None:
        boxes.append(members.patches.bounds)
    return dist(*(np.asarray(bound).tolist() for bound in join_boxes(boxes)))
