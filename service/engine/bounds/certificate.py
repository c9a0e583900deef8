"""The certificate: a proved bound of the distance from every part of a surface to its mesh.

A part is a triangle of parameters with the surface over it. Cut at knot lines into pieces (`clip`),
it is in the hulls of their nets (`blossoms`, or `degree_reduction`), and these are compared with a
triangle of the mesh and its neighbours, the reference triangle (`distance`). Rounding is added
(`goal`). For the other direction, S − A has a net, where A maps a piece affinely into the reference
triangle (`clip.find_images`).

Proofs in docs/proofs.md: "The certificate" and "The distance from the mesh to the surface".
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import find_begins, row_slices, unique_values
from service.engine.bounds.clip import Parts, PatchPieces, clip_parts, find_images
from service.engine.bounds.degree_reduction import DIRECT, sort_by_box
from service.engine.bounds.faces import SPAN, Faces
from service.engine.bounds.goal import Goal
from service.engine.bounds.local_frames import LocalFrames, build_local_frames
from service.engine.nets.nets import Nets
from service.engine.nets.patch_nets import PatchNets

BLOCK = 1 << 16
"""The most pieces in one block, unless a single part has more; it limits memory."""

CHUNK = 1 << 17
"""Numbers in the nets of one chunk, so that temporary arrays stay in the cache."""

COVERED = 16
"""The least number of patches inside one part for which the hulls of patches are tried first."""


@dataclass(frozen=True, eq=False, slots=True)
class PieceMeasure:
    """M pieces of parts, and the mesh that they are measured against: the arguments of `certify`.

    `images` (3, 3, M) are the corners of pieces in barycentric coordinates of their parts
    (`find_images`); None unless `goal.two_sided`.
    """

    patch_nets: PatchNets
    parts: Parts
    pieces: PatchPieces
    positions: FloatArray
    goal: Goal
    images: FloatArray | None

    def bound_pieces(self, bounds: FloatArray, rows: Ints) -> None:
        """Write the bounds of these pieces into the columns `rows` of `bounds` (3, M).

        The rows of `bounds`: deviation, distance from the eye, and deviation of the mesh.
        """
        patch_nets, pieces = self.patch_nets, self.pieces
        deviation, eye_distance, mesh = bounds
        for nets, selected in patch_nets.split_by_group(pieces.patch[rows]):
            group, (p, q) = rows[selected], nets.degree
            # Approximately how many numbers the arrays of a piece have. Pieces of high degree that
            # are in the same box share the net over this box.
            numbers, is_high = 4 * (p + q + 1) * (p + q + 2), p + q > DIRECT
            if is_high:
                numbers = 2 * (p + 1) * (q + 1)
                order = sort_by_box(pieces.patch[group], pieces.parameters.take(group, axis=2))
                group = group[order]
            for chunk in row_slices(len(group), numbers, CHUNK):
                pieces_of_chunk = group[chunk]
                patch = pieces.patch[pieces_of_chunk]
                parameters = pieces.parameters.take(pieces_of_chunk, axis=2)
                frames = self._build_frames(nets, pieces_of_chunk)
                if is_high:
                    first, which = unique_values(patch)
                    patches = patch[first]
                    items = nets.items[patch_nets.row[patches]]
                    local = frames.build_reduced_nets(
                        items, which, patch_nets.sizes[patches], parameters
                    )
                else:
                    local = frames.build_nets(nets.items[patch_nets.row[patch]], parameters)
                deviation[pieces_of_chunk] = frames.to_model_units(local.deviation)
                if self.goal.view is not None:
                    eye = self.goal.view.eye
                    eye_distance[pieces_of_chunk] = frames.bound_distances_to_eye(local, eye)
                if self.images is not None:
                    images = self.images.take(pieces_of_chunk, axis=2)
                    reverse = frames.bound_reverse_distances(local, images)
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
        """The frames of these pieces, which lie in patches of one degree."""
        part, patch = self.pieces.part[rows], self.pieces.patch[rows]
        # The numbers of the vertices of the reference triangles; and, for each edge, the number of
        # the vertex opposite to it in the neighbouring triangle. Where there is no neighbour, −1
        # takes the last vertex, which is not used.
        parts = self.parts
        reference, opposite = parts.reference.take(part, axis=1), parts.across.take(part, axis=1)
        vertices, opposite_vertices = (
            np.ascontiguousarray(self.positions.take(ids, axis=0).swapaxes(1, 2))
            for ids in (reference, opposite)
        )
        # `images` has the corners of pieces in order, so the corners of nets must keep this order.
        return build_local_frames(
            self.patch_nets,
            nets,
            patch,
            vertices,
            (opposite_vertices, opposite >= 0),
            ordered=self.goal.two_sided,
        )


def find_covering_hulls(measure: PieceMeasure) -> tuple[FloatArray, Bools] | None:
    """Bounds (M,) of pieces by the hulls of their whole patches; which pieces (M,) to bound first.

    In a part that covers at least `COVERED` whole patches, the pieces in the covered patch with the
    largest bound by its hull are bounded first, by nets. In most other patches of the part the
    bound by the hull is below the bound of these pieces, so their own pieces need no nets.

    In all other parts the bounds are infinite, and all pieces are bounded first. The results for a
    piece depend on its part alone. The result is None if no part covers `COVERED` patches.
    """
    pieces = measure.pieces
    # A covered patch has at least two pieces.
    if np.bincount(pieces.part).max(initial=0) < 2 * COVERED:
        return None
    # Pairs of a part and a patch: the first piece of each pair, and the pair of each piece.
    first, pair = unique_values(pieces.part * len(measure.patch_nets.sizes) + pieces.patch)
    # A patch is covered if the areas of its pieces add up to SPAN², up to rounding.
    to_b, to_c = (pieces.corners[1:] - pieces.corners[0]).astype(np.float64)
    twice_area = np.bincount(pair, np.abs(to_b[0] * to_c[1] - to_b[1] * to_c[0]))
    part, is_covered = pieces.part[first], twice_area >= (2.0 - 1e-9) * SPAN * SPAN
    has_hulls = (np.bincount(part, is_covered) >= COVERED)[part]
    if not has_hulls.any():
        return None
    hull = np.full(len(first), np.inf)
    rows = has_hulls.nonzero()[0]
    hull[rows] = measure.bound_by_hulls(first[rows])
    largest = np.zeros(len(measure.parts.face))
    rows = (has_hulls & is_covered).nonzero()[0]
    np.maximum.at(largest, part[rows], hull[rows])
    is_first = ~has_hulls | (is_covered & (hull >= largest[part]))
    return hull[pair], is_first[pair]


@dataclass(frozen=True, eq=False, slots=True)
class PartBounds:
    """Proved bounds of m parts, in model units.

    Attributes
    ----------
    deviation : ndarray of float64, shape (m,)
        No point of the part is further than this from the mesh.
    mesh : ndarray of float64, shape (m,), or None
        No point of the reference triangle is further than this from the surface; 0 where this
        triangle is not the image of the part (`Parts.is_own`). None unless `goal.two_sided`;
        such a goal allows 2 times `allowed` here.
    allowed : ndarray of float64, shape (m,)
        The deviation that the goal allows at the part's distance from the eye.
    """

    deviation: FloatArray
    mesh: FloatArray | None
    allowed: FloatArray

    @property
    def meets_goal(self) -> Bools:
        """Which parts meet the goal, shape (m,)."""
        meets_goal: Bools = self.deviation <= self.allowed
        if self.mesh is not None:
            meets_goal &= self.mesh <= 2 * self.allowed
        return meets_goal


def certify(
    patch_nets: PatchNets, faces: Faces, parts: Parts, positions: FloatArray, goal: Goal
) -> PartBounds:
    """Bounds of the distances between parts of the surface and the mesh.

    Parameters
    ----------
    parts : Parts
        m parts. The bits of the bounds of a part do not depend on the other parts.
    positions : ndarray of float64, shape (V, 3)
        The stored vertices, in model coordinates.
    goal : Goal
    """
    blocks = [
        _bound_parts(patch_nets, faces, block, positions, goal)
        for block in _split_into_blocks(faces, parts)
    ]
    deviation, distance, mesh = np.concatenate(blocks, axis=1)
    return PartBounds(deviation, mesh if goal.two_sided else None, goal.find_allowed(distance))


def _split_into_blocks(faces: Faces, parts: Parts) -> Iterator[Parts]:
    """Runs of parts with at most about `BLOCK` pieces together; a single part may have more."""
    if len(parts.face) * int((faces.spans + 1).prod(axis=0).max()) <= BLOCK:
        yield parts
        return
    low, high = parts.corners.min(axis=0), parts.corners.max(axis=0)
    # A part is counted as one piece for each span of the box about it.
    block = np.cumsum(((high - low) // SPAN + 1).prod(axis=0)) // BLOCK
    begins = find_begins(block)
    for begin, end in pairwise([*begins.tolist(), len(block)]):
        yield parts.take(slice(begin, end))


def _bound_parts(
    patch_nets: PatchNets, faces: Faces, parts: Parts, positions: FloatArray, goal: Goal
) -> FloatArray:
    """Bounds (3, m) of parts: deviation, distance from the eye, and deviation of the mesh.

    The second row is 0 without a view. The third row is 0 unless `goal.two_sided`.
    """
    pieces = clip_parts(faces, parts.face, parts.corners)
    images = find_images(pieces, parts.corners) if goal.two_sided else None
    bounds = np.zeros((3, len(pieces.part)))
    measure = PieceMeasure(patch_nets, parts, pieces, positions, goal, images)
    covering = None if goal.two_sided or goal.view is not None else find_covering_hulls(measure)
    if covering is None:
        measure.bound_pieces(bounds, np.arange(len(pieces.part)))
    else:
        hull, is_first = covering
        measure.bound_pieces(bounds, is_first.nonzero()[0])
        largest = _join(np.maximum, bounds[0], pieces.part, len(parts.face))
        # All others have a bound by the hull that is no larger than `largest`, and keep 0.
        measure.bound_pieces(bounds, (~is_first & (hull > largest[pieces.part])).nonzero()[0])
    bounds[2, ~parts.is_own[pieces.part]] = 0.0
    choices = np.maximum, np.minimum, np.maximum
    return np.array(
        [
            _join(choose, values, pieces.part, len(parts.face))
            for choose, values in zip(choices, bounds, strict=True)
        ]
    )


def _join(choose: np.ufunc, values: FloatArray, part: Ints, count: int) -> FloatArray:
    """The largest or the least value of the pieces of each of `count` parts.

    `part` is in ascending order. A part has at least one piece, unless its corners are in a line;
    the value of a part without pieces is 0.
    """
    if np.array_equal(part, np.arange(count)):  # one piece for each part
        return values
    begins = find_begins(part)
    chosen = np.zeros(count)
    chosen[part[begins]] = choose.reduceat(values, begins)
    return chosen
