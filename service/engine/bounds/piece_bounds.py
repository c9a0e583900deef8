"""Bounds of the pieces of parts, each over one patch, by the nets of the pieces or of the patch.

A piece is bounded by its own net in the frame of its host (`local_frames`). A part that covers many
patches as a whole has many pieces; most of them need no net of their own, because the hull of the
whole patch already keeps them below the bound of the part (`find_covering_hulls`).
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.bases.unique_rows import unique_values
from service.engine.bounds.clip import Parts, PatchPieces
from service.engine.bounds.degree_reduction import DIRECT, sort_by_box
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal
from service.engine.bounds.local_frames import LocalFrames, build_local_frames
from service.engine.bounds.patch_nets import Nets, PatchNets

CHUNK = 1 << 17
"""Numbers of nets that are computed at a time: their temporary arrays stay in the cache."""

COVERED = 16
"""Least number of patches covered as a whole by one part for which hulls are tried first."""


@dataclass(frozen=True, eq=False, slots=True)
class PieceMeasure:
    """M pieces of parts, and the mesh that they are measured against.

    Attributes
    ----------
    patch_nets : PatchNets
    parts : Parts
    pieces : PatchPieces
    positions : ndarray of float64, shape (V, 3)
        Vertices of the mesh as they are stored, in model coordinates.
    goal : Goal
    shares : ndarray of float64, shape (3, 3, M), or None
        Images of the corners of pieces in their parts; None unless the goal has two sides.
    """

    patch_nets: PatchNets
    parts: Parts
    pieces: PatchPieces
    positions: FloatArray
    goal: Goal
    shares: FloatArray | None

    def bound_pieces(self, bounds: FloatArray, rows: Ints) -> None:
        """Write bounds of pieces into the columns `rows` of `bounds`, shape (3, M).

        Row 0 is the deviation. Row 1 is the distance from the eye, written only if the goal has a
        view. Row 2 is the deviation of the mesh, written only if the goal has two sides.
        """
        patch_nets, pieces = self.patch_nets, self.pieces
        deviation, eye_distance, mesh = bounds
        for nets, selected in patch_nets.split_by_group(pieces.patch[rows]):
            group, (p, q) = rows[selected], nets.degree
            numbers, is_high = 4 * (p + q + 1) * (p + q + 2), p + q > DIRECT
            if is_high:
                numbers = 2 * (p + 1) * (q + 1)
                order = sort_by_box(pieces.patch[group], pieces.places.take(group, axis=2))
                group = group[order]
            for chunk in row_slices(len(group), numbers, CHUNK):
                pieces_of_chunk = group[chunk]
                patch = pieces.patch[pieces_of_chunk]
                places = pieces.places.take(pieces_of_chunk, axis=2)
                frames = self._build_frames(nets, pieces_of_chunk)
                if is_high:
                    patches, which = np.unique(patch, return_inverse=True)
                    items = nets.items[patch_nets.row[patches]]
                    local = frames.restrict_reduced(items, which, patch_nets.sizes[patches], places)
                else:
                    local = frames.restrict(nets.items[patch_nets.row[patch]], places)
                deviation[pieces_of_chunk] = frames.to_model_units(local.deviation)
                if self.goal.view is not None:
                    eye = self.goal.view.eye
                    eye_distance[pieces_of_chunk] = frames.bound_distances_to_eye(local, eye)
                if self.shares is not None:
                    reverse = frames.bound_reverse_distances(
                        local, self.shares.take(pieces_of_chunk, axis=2)
                    )
                    mesh[pieces_of_chunk] = frames.to_model_units(reverse)

    def bound_by_hulls(self, rows: Ints) -> FloatArray:
        """Bounds of the deviation of the whole patches that these pieces are in."""
        bounds = np.empty(len(rows))
        for nets, selected in self.patch_nets.split_by_group(self.pieces.patch[rows]):
            for chunk in row_slices(len(selected), nets.items[0].size, CHUNK):
                chunk_rows = rows[selected[chunk]]
                items = nets.items[self.patch_nets.row[self.pieces.patch[chunk_rows]]]
                bounds[selected[chunk]] = self._build_frames(nets, chunk_rows).bound_by_hulls(items)
        return bounds

    def _build_frames(self, nets: Nets, rows: Ints) -> LocalFrames:
        """The frames of some pieces, of one degree."""
        part, patch = self.pieces.part[rows], self.pieces.patch[rows]
        host, beyond = self.parts.host[part].T, self.parts.across[part].T
        vertices, across = (
            np.ascontiguousarray(self.positions.take(ids, axis=0).swapaxes(1, 2))
            for ids in (host, beyond)
        )
        beside, ordered = (across, beyond >= 0), self.goal.two_sided
        return build_local_frames(self.patch_nets, nets, patch, vertices, beside, ordered=ordered)


def find_covering_hulls(measure: PieceMeasure) -> tuple[FloatArray, Bools] | None:
    """Bounds of pieces by the hulls of their whole patches, and the pieces to be bounded first.

    A piece is in the hull of its whole patch. For most patches that a part covers as a whole, the
    bound by this hull is less than the bound of the pieces that are bounded first: those at the
    edges of the part, and those in the patch with the largest hull. These patches then need no net
    of their pieces.

    Returns
    -------
    hull : ndarray of float64, shape (M,)
        The bound by the hull; infinite for patches that are not covered as a whole.
    is_first : ndarray of bool, shape (M,)
        Pieces to be bounded first. Both depend on the part of the piece alone. The result is None
        if no part covers `COVERED` patches.
    """
    pieces = measure.pieces
    if np.bincount(pieces.part).max(initial=0) < 2 * COVERED:
        return None
    first, pair = unique_values(pieces.part * len(measure.patch_nets.sizes) + pieces.patch)
    one, two = (pieces.corners[1:] - pieces.corners[0]).astype(np.float64)
    area = np.bincount(pair, np.abs(one[0] * two[1] - one[1] * two[0]))
    part, covered = pieces.part[first], area >= (2.0 - 1e-9) * SPAN * SPAN
    covered &= (np.bincount(part, covered) >= COVERED)[part]
    if not covered.any():
        return None
    hull = np.full(len(first), np.inf)
    rows = covered.nonzero()[0]
    hull[rows] = measure.bound_by_hulls(first[rows])
    largest = np.zeros(len(measure.parts.face))
    np.maximum.at(largest, part[rows], hull[rows])
    return hull[pair], (~covered | (hull >= largest[part]))[pair]
