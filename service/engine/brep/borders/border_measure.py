"""Bounds of surfaces beside the sides of polygons, and the refinement of borders by them.

The surface over the segment of a side, and over its sliver, is compared with the chord of the side.
All of them, of all faces, are measured together.

Proof in docs/proofs.md: "The polygon of a trimmed face".
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.bounds.certificate import PieceMeasure
from service.engine.bounds.chords import measure_distances
from service.engine.bounds.clip import Parts, PatchPieces, clip_parts
from service.engine.bounds.goal import Goal
from service.engine.brep.borders.border import Border, renew_border
from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.borders.halving import halve_pieces
from service.engine.brep.borders.slivers import Slivers, find_slivers
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.clip import clip_segments
from service.engine.vectors import UNIT, length

NET_SHARE = 0.95
"""Share of the tolerance that the surface beside a chord may be away from it."""

OVERHANG_SHARE = 1 / 3
"""The part of a polygon beyond its loop may be this share of the bound of slivers away."""

FAR = 0.4
"""An edge further from its surface than this share of the tolerance has a gap that counts."""

ROUNDS = 12
"""The most rounds in which sides are halved."""

SHORT = 0.05
"""A piece with a chord shorter than this share of the tolerance is not halved: only the gap between
the edge and the surface is left."""

LESS, STALLS = 0.75, 3
"""A piece is not halved if `STALLS` halvings in a row have not made its bound less than this share:
the surface is far from the edge, or has no bound."""

ROUNDING = 64
"""Units u of the largest coordinate: the rounding of points of planes and of their distances."""

BLOCK = 1 << 14
"""The most sides that are measured in one step; it limits memory."""


def refine_border(
    prepared: PreparedBrep, samples: EdgeSamples, border: Border, goal: Goal
) -> tuple[EdgeSamples, Border]:
    """Measure the border, and halve the pieces of edges where surfaces are far from chords.

    The bounds of the result are within `NET_SHARE` of the tolerance, or, where an edge is further
    from its surface than `FAR` tolerances, within 0.7 tolerances and 1.1 times this gap.
    """
    before, stalls = np.full(len(samples.edges), np.inf), np.zeros(len(samples.edges), np.intp)
    for _ in range(ROUNDS):
        checkpoint()
        border = measure_border(prepared, samples, border, goal)
        bounds = _join_images(samples, border)
        stalls = np.where(bounds > LESS * before, stalls + 1, 0)
        fails = _find_failing(prepared, samples, border, goal.tolerance)
        rows = (fails & (stalls[border.samples] < STALLS)).nonzero()[0]
        if not len(rows):
            break
        samples, source = halve_pieces(prepared, samples, border.samples[rows])
        if not (source < 0).any():
            break
        # Both halves go on with the bound of the whole; for all others nothing changes.
        whole = np.maximum.accumulate(source)
        is_half = (source < 0) | np.append(source[1:] < 0, False)
        before = np.where(is_half, bounds[whole], np.inf)
        stalls = stalls[whole]
        border = renew_border(prepared, samples, border, source)
    return samples, measure_border(prepared, samples, border, goal)


def _join_images(samples: EdgeSamples, border: Border) -> FloatArray:
    """The greatest bound (T,) beside the images of each piece of an edge."""
    bounds = np.zeros(len(samples.edges))
    worst = np.maximum(border.segment_bounds, border.sliver_bounds)
    np.maximum.at(bounds, border.samples, worst)
    return bounds


def _find_failing(
    prepared: PreparedBrep, samples: EdgeSamples, border: Border, tolerance: float
) -> Bools:
    """Which sides are further from the surface than they need to be."""
    points = samples.positions[np.array([border.begin_vertices, border.end_vertices])]
    chords = length(points[1] - points[0], -1)
    edges = prepared.coedge_edges[border.coedges]
    ends = samples.bounds[border.samples]
    gaps = prepared.gaps[border.coedges] + np.where(ends > tolerance, ends, 0.0)
    allowed = np.full(len(gaps), NET_SHARE * tolerance)
    far = gaps > FAR * tolerance
    allowed[far] = np.maximum(allowed[far], 1.1 * gaps[far] + 0.7 * tolerance)
    worst = np.maximum(border.segment_bounds, border.sliver_bounds)
    fails: Bools = ~(worst <= allowed)
    return fails & ~samples.is_point[edges] & (chords > SHORT * tolerance)


def measure_border(
    prepared: PreparedBrep, samples: EdgeSamples, border: Border, goal: Goal
) -> Border:
    """The border with bounds of all sides; only those that are unknown are computed.

    If the goal is two-sided, the part of a polygon beyond its loop counts as a sliver too; it shall
    be within `OVERHANG_SHARE` of the bound of slivers.
    """
    unknown = np.isnan(border.segment_bounds).nonzero()[0]
    if not len(unknown):
        return border
    measure = _SideMeasure(prepared, border, samples.positions, goal.tolerance)
    segments, slivers = border.segment_bounds.copy(), border.sliver_bounds.copy()
    for rows in row_slices(len(unknown), 1, BLOCK):
        sides = unknown[rows]
        found = find_slivers(prepared, samples, border, sides, inner=False)
        segments[sides], slivers[sides] = measure.bound(sides, found)
        if goal.two_sided:
            found = find_slivers(prepared, samples, border, sides, inner=True)
            beyond = measure.bound(sides, found)[1]
            slivers[sides] = np.maximum(slivers[sides], beyond / OVERHANG_SHARE)
    return replace(border, segment_bounds=segments, sliver_bounds=slivers)


def bound_overhangs(
    prepared: PreparedBrep, samples: EdgeSamples, border: Border, goal: Goal
) -> FloatArray:
    """Bounds (M,) of how far the surface over the polygon outside of the region is from chords."""
    measure = _SideMeasure(prepared, border, samples.positions, goal.tolerance)
    bounds = np.zeros(len(border.faces))
    for rows in row_slices(len(bounds), 1, BLOCK):
        sides = np.arange(len(bounds))[rows]
        found = find_slivers(prepared, samples, border, sides, inner=True)
        bounds[sides] = measure.bound(sides, found)[1]
    return bounds


@dataclass(frozen=True, eq=False, slots=True)
class _SideMeasure:
    """Measures sides of a border, and triangles beside them, against their chords."""

    prepared: PreparedBrep
    border: Border
    positions: FloatArray
    tolerance: float

    def bound(self, sides: Ints, slivers: Slivers) -> FloatArray:
        """Bounds (2, m) of the segments and of the slivers of sides; owners are rows of these."""
        bounds = np.zeros((2, len(sides)))
        planar = self.prepared.surfaces.is_planar[self.border.faces[sides]]
        if planar.all() or not planar.any():
            return (self._bound_planar if planar.all() else self._bound_curved)(sides, slivers)
        for is_planar, bound in ((True, self._bound_planar), (False, self._bound_curved)):
            rows = (planar == is_planar).nonzero()[0]
            if len(rows):
                number = np.full(len(sides), -1)
                number[rows] = np.arange(len(rows))
                own = slivers.take(number[slivers.owners] >= 0)
                bounds[:, rows] = bound(sides[rows], Slivers(number[own.owners], own.corners))
        return bounds

    def _bound_planar(self, sides: Ints, slivers: Slivers) -> FloatArray:
        """Bounds (2, m) where surfaces are affine: they are no further than at their corners."""
        border, count = self.border, len(sides)
        faces = border.faces[sides]
        corners = slivers.corners.transpose(0, 2, 1).reshape(-1, 2)
        places = np.concatenate([border.begins[sides], border.ends[sides], corners])
        owners = np.concatenate([faces, faces, np.tile(faces[slivers.owners], 3)])
        points = self.prepared.places.evaluate(owners, places)
        chords = self._list_chords(sides)
        at_ends = points[: 2 * count].reshape(2, count, 3)
        at_corners = points[2 * count :].reshape(3, -1, 3).swapaxes(0, 1)
        bounds = np.zeros((2, count))
        bounds[0] = length(at_ends - chords.swapaxes(0, 1), -1).max(axis=0)
        if len(slivers.owners):
            distances = measure_distances(at_corners, chords[slivers.owners])
            np.maximum.at(bounds[1], slivers.owners, distances.max(axis=1))
        rounding = ROUNDING * UNIT * np.abs(points).max(initial=0.0)
        bounds += self.prepared.surfaces.errors[faces] + rounding
        return bounds

    def _bound_curved(self, sides: Ints, slivers: Slivers) -> FloatArray:
        """Bounds (2, m) by nets of the surface, all in one measure."""
        border, count = self.border, len(sides)
        faces, begins, ends = border.faces[sides], border.begins[sides].T, border.ends[sides].T
        owners = np.concatenate([np.arange(count), slivers.owners])
        # A chord is a triangle whose last two corners are equal.
        end = border.end_vertices[sides]
        reference = np.array([border.begin_vertices[sides], end, end]).take(owners, axis=1)
        parts = Parts(
            faces[owners],
            np.concatenate([np.array([begins, ends, ends]), slivers.corners], axis=2),
            reference,
            np.full(reference.shape, -1),
            np.zeros(len(owners), bool),
        )
        places, own = self.prepared.places, faces[slivers.owners]
        found = [
            clip_segments(places, faces, np.array([begins, ends])),
            clip_parts(places, own, slivers.corners),
        ]
        pieces = PatchPieces(
            np.concatenate([found[0].part, found[1].part + count]),
            np.concatenate([part.patch for part in found]),
            np.concatenate([part.parameters for part in found], axis=2),
            np.concatenate([part.corners for part in found], axis=2),
        )
        nets, values = self.prepared.surfaces.nets, np.zeros((3, len(pieces.part)))
        measure = PieceMeasure(nets, parts, pieces, self.positions, Goal(self.tolerance), None)
        measure.bound_pieces(values, np.arange(len(pieces.part)))
        bounds = np.zeros((2, count))
        row = (pieces.part >= count).astype(np.intp)
        np.maximum.at(bounds, (row, owners[pieces.part]), values[0])
        return bounds

    def _list_chords(self, sides: Ints) -> FloatArray:
        """The chords (m, 2, 3) of sides."""
        border = self.border
        ends = np.stack([border.begin_vertices[sides], border.end_vertices[sides]], axis=1)
        return self.positions[ends]
