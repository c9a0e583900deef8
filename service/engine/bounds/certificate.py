"""The certificate: a proved bound of the distance from every part of a surface to its mesh.

No point of the surface is further from the mesh than the largest bound of its parts. The proof:

1. **The parts are all of the surface.** They are triangles of places that divide the faces, and
   places are whole numbers. Cut at knot lines, they still cover every place (`clip`), and each
   piece is in one Bézier patch, at parameters that float64 holds exactly.
2. **Over a piece the surface is in the hull of a net.** A polynomial of degree (p, q) is, over a
   triangle of parameters, a triangular net of degree p + q (`blossoms`): S = Σ B_ijk b_ijk. The
   Bernstein polynomials are not negative and add up to 1. A rational one is S = Σ B_ijk w_ijk b_ijk
   / Σ B_ijk w_ijk, a mean of the b_ijk as well, for blossoms of positive weights at parameters in
   [0, 1] are positive. Where p + q is large, S is near a net of lower degree (`degree_reduction`).
3. **No point of such a mean is further from its host than the farthest point of the net**, for the
   distance to a convex set is a convex function. Heights and places in the host's plane may be
   bounded apart, and the host may be enlarged by what lies beyond its edges (`distance`); heights
   are bounded by their quadratic part and a remainder (`heights`), rational ones as

       h = Σ B_ijk w_ijk h_ijk / Σ B_ijk w_ijk, the numerator so bounded, over the least w_ijk.

4. **Any triangle of the mesh will do.** Which part is measured against which host is free: the
   bound is of the distance to that triangle, or to it and its neighbours.
5. **Rounding** is added, derived in `certificate_rounding`. The positions are those that are
   stored, so their rounding is in the distances themselves.

The other way round, the distance from a point A(x) of a host to the surface is at most |A(x) − S|
at the place that A takes to it, A being the affine map of the part to its host; S − A is a net
once more. Cut at knot lines, the images of a part's pieces fill its host (`clip.images`), one
affine map each.

The bound tends to the truth as parts shrink: quadratic parts are measured exactly, remainders are
of third order, and so is what neighbours add.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.bases.unique_rows import unique_values
from service.engine.bounds.clip import Pieces, clipped, images
from service.engine.bounds.degree_reduction import DIRECT, box_order
from service.engine.bounds.faces import SPAN, Faces
from service.engine.bounds.goal import Goal
from service.engine.bounds.local_frames import LocalFrames, local_frames
from service.engine.bounds.patch_nets import Nets, PatchNets

CHUNK = 1 << 17
"""Numbers of the nets that are worked on at a time: all that is made of them stays in the cache."""

COVERED = 16
"""Patches that a part covers as a whole from which on most of them are looked at only roughly."""

BLOCK = 1 << 16
"""Pieces that there are at a time, unless one part alone has more."""


@dataclass(frozen=True, eq=False, slots=True)
class Parts:
    """m triangles of places, and the triangles of the mesh that their surface is measured against.

    Attributes
    ----------
    face : ndarray of int, shape (m,)
    corners : ndarray of int, shape (m, 3, 2)
        Places of the face. Neighbouring parts share whole edges.
    host : ndarray of int, shape (m, 3)
        The vertices of the triangle of the mesh: those at the corners, in their order, if the part
        is its own.
    across : ndarray of int, shape (m, 3)
        The vertex opposite edge (k, k + 1) of the host in the triangle beyond it; -1 if there is
        none or it is not known.
    own : ndarray of bool, shape (m,), or None
        Whether the host is the image of the part; None if all are.
    """

    face: Ints
    corners: Ints
    host: Ints
    across: Ints
    own: Bools | None = None

    def take(self, rows: slice) -> "Parts":
        """A run of the parts."""
        own = None if self.own is None else self.own[rows]
        return Parts(self.face[rows], self.corners[rows], self.host[rows], self.across[rows], own)


@dataclass(frozen=True, eq=False, slots=True)
class Bounds:
    """What is proved of m parts; see `Triangulation`.

    Attributes
    ----------
    deviation : ndarray of float64, shape (m,)
        No point of the part is further than this from the mesh.
    mesh : ndarray of float64, shape (m,), or None
        No point of the host is further than this from the surface; 0 where the part is not its own.
    allowed : ndarray of float64, shape (m,)
        What the goal allows so near to the eye.
    """

    deviation: FloatArray
    mesh: FloatArray | None
    allowed: FloatArray

    @property
    def passed(self) -> Bools:
        """Which parts meet the goal."""
        met: Bools = self.deviation <= self.allowed
        if self.mesh is not None:
            met &= self.mesh <= 2 * self.allowed
        return met


def certify(
    ground: PatchNets, faces: Faces, parts: Parts, positions: FloatArray, goal: Goal
) -> Bounds:
    """Bounds of the distances between parts of the surface and the mesh.

    Parameters
    ----------
    parts : Parts
        What the bounds are of. Each has the same bits whatever is beside it.
    positions : ndarray of float64, shape (V, 3)
        The vertices as they are stored, in model coordinates.
    goal : Goal
        Whether the mesh is to be bounded too, and where the eye is.
    """
    found = np.zeros((3, len(parts.face)))
    for block in _blocks(parts):
        found[:, block] = _measure(ground, faces, parts.take(block), positions, goal)
    deviation, distance, mesh = found
    return Bounds(deviation, mesh if goal.two_sided else None, goal.allowed(distance))


def _blocks(parts: Parts) -> Iterator[slice]:
    """Runs of parts that have few pieces together; or a single one that has many."""
    low, high = parts.corners.min(axis=1), parts.corners.max(axis=1)
    block = np.cumsum(((high - low) // SPAN + 1).prod(axis=1)) // BLOCK
    begins = np.diff(block, prepend=-1).nonzero()[0]
    for begin, end in pairwise([*begins.tolist(), len(block)]):
        yield slice(begin, end)


def _measure(
    ground: PatchNets, faces: Faces, parts: Parts, positions: FloatArray, goal: Goal
) -> FloatArray:
    """Deviation, distance from the eye, and deviation of the mesh, (3, m); 0 if not asked for."""
    corners = parts.corners.transpose(1, 2, 0)
    pieces = clipped(faces, parts.face, corners)
    shares = images(pieces, corners) if goal.two_sided else None
    found = np.zeros((3, len(pieces.part)))
    measure = _Measure(ground, parts, pieces, positions, goal, shares)
    rough = None if goal.two_sided or goal.view is not None else _roughly(measure)
    if rough is None:
        measure.add(found, np.arange(len(pieces.part)))
    else:
        hull, first = rough
        measure.add(found, first.nonzero()[0])
        known = _join(np.maximum, found[0], pieces.part, len(parts.face))
        measure.add(found, (~first & (hull > known[pieces.part])).nonzero()[0])
    if parts.own is not None:
        found[2, ~parts.own[pieces.part]] = 0.0
    choices = np.maximum, np.minimum, np.maximum
    return np.array(
        [
            _join(choose, values, pieces.part, len(parts.face))
            for choose, values in zip(choices, found, strict=True)
        ]
    )


@dataclass(frozen=True, eq=False, slots=True)
class _Measure:
    """Pieces of parts, and what they are measured against; their images if these matter."""

    ground: PatchNets
    parts: Parts
    pieces: Pieces
    positions: FloatArray
    goal: Goal
    shares: FloatArray | None

    def add(self, found: FloatArray, wanted: Ints) -> None:
        """Deviation, distance from the eye, and deviation of the mesh of some pieces, (3, M)."""
        ground, pieces = self.ground, self.pieces
        deviation, near, mesh = found
        for nets, rows in ground.by_group(pieces.patch[wanted]):
            here, (p, q) = wanted[rows], nets.degree
            numbers, is_high = 4 * (p + q + 1) * (p + q + 2), p + q > DIRECT
            if is_high:
                numbers = 2 * (p + 1) * (q + 1)
                here = here[box_order(pieces.patch[here], pieces.places[..., here])]
            for chunk in row_slices(len(here), numbers, CHUNK):
                some = here[chunk]
                patch, places = pieces.patch[some], pieces.places[..., some]
                frames = self._frames(nets, some)
                if is_high:
                    patches, which = np.unique(patch, return_inverse=True)
                    own = nets.items[ground.row[patches]]
                    piece = frames.near(own, which, ground.sizes[patches], places)
                else:
                    piece = frames.over(nets.items[ground.row[patch]], places)
                deviation[some] = frames.restore(piece.deviation)
                if self.goal.view is not None:
                    near[some] = frames.distances_to_eye(piece, self.goal.view.eye)
                if self.shares is not None:
                    images = self.shares[..., some]
                    mesh[some] = frames.restore(frames.reverse_distances(piece, images))

    def hulls(self, wanted: Ints) -> FloatArray:
        """Bounds of the deviation of the whole patches that these pieces are in."""
        bounds = np.empty(len(wanted))
        for nets, rows in self.ground.by_group(self.pieces.patch[wanted]):
            for chunk in row_slices(len(rows), nets.items[0].size, CHUNK):
                some = wanted[rows[chunk]]
                own = nets.items[self.ground.row[self.pieces.patch[some]]]
                bounds[rows[chunk]] = self._frames(nets, some).hulls(own)
        return bounds

    def _frames(self, nets: Nets, some: Ints) -> LocalFrames:
        """The frames of some pieces, of one degree."""
        part, patch = self.pieces.part[some], self.pieces.patch[some]
        host, beyond = self.parts.host[part].T, self.parts.across[part].T
        vertices, across = (
            np.ascontiguousarray(self.positions[ids].swapaxes(1, 2)) for ids in (host, beyond)
        )
        beside, ordered = (across, beyond >= 0), self.goal.two_sided
        return local_frames(self.ground, nets, patch, vertices, beside, ordered=ordered)


def _roughly(measure: _Measure) -> tuple[FloatArray, Bools] | None:
    """Of parts of many spans: bounds of their pieces by whole nets, and pieces to begin with.

    A piece is in the hull of all of its patch, which says enough of most patches that a part covers
    as a whole: their bound is less than that of what is measured first, namely of the pieces on the
    edges of the part, and in the patch with the greatest hull. Bounds are (M,), infinite at edges.
    What is done with a part depends on that part alone.
    """
    pieces = measure.pieces
    if np.bincount(pieces.part).max(initial=0) < 2 * COVERED:
        return None
    first, pair = unique_values(pieces.part * len(measure.ground.sizes) + pieces.patch)
    one, two = (pieces.corners[1:] - pieces.corners[0]).astype(np.float64)
    area = np.bincount(pair, np.abs(one[0] * two[1] - one[1] * two[0]))
    part, covered = pieces.part[first], area >= (2.0 - 1e-9) * SPAN * SPAN
    covered &= (np.bincount(part, covered) >= COVERED)[part]
    if not covered.any():
        return None
    hull = np.full(len(first), np.inf)
    rows = covered.nonzero()[0]
    hull[rows] = measure.hulls(first[rows])
    greatest = np.zeros(len(measure.parts.face))
    np.maximum.at(greatest, part[rows], hull[rows])
    return hull[pair], (~covered | (hull >= greatest[part]))[pair]


def _join(choose: np.ufunc, values: FloatArray, part: Ints, count: int) -> FloatArray:
    """The largest, or the least, value of the pieces of each part; 0 of a part without any."""
    if len(values) == count:
        return values
    begins = np.diff(part, prepend=-1).nonzero()[0]
    chosen = np.zeros(count)
    chosen[part[begins]] = choose.reduceat(values, begins)
    return chosen
