"""What the faces that have no area leave out of a mesh.

Where two samples are one place, a triangle of a pattern has no area and is not written. The points
that fall to it then fall to the line between its two places; as a rule that is a side of the face
next to it, and nothing is lost. But at a corner between two sides that are one edge, or where a
patch between two poles has a single division, the line may be no side of any face. Then the mesh
is further away: as far as the nearest of those places that it does have.

Only samples on the border of a patch can be one place with others. So it is enough to look at the
*rim*: the triangles that have a corner on the border.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from service.bases import triangle
from service.bases.arrays import Bools, FloatArray, IndexArray, Ints, RealArray
from service.bases.cache import PLANS
from service.engine.mesh.layout import Layout
from service.engine.mesh.patterns import AnyShape, TriangleShape, faces, merged_samples
from service.engine.options import Faces, MeshOptions
from service.stopping import checkpoint

NOTHING = (False, False, False, False)

CANDIDATES = 64
"""Places of the mesh that are tried where it has none of those that are lost."""


def lost(layout: Layout, options: MeshOptions, positions: RealArray) -> FloatArray | None:
    """How much further from the mesh each patch may be than from its own triangles: (P,).

    None if nothing is lost, as is nearly always known from the patterns alone.

    Parameters
    ----------
    positions : ndarray, shape (N, 3)
    """
    # Unwelded, nothing but sides that are one point has the same place twice.
    folds = layout.folds and options.weld
    if not layout.may_lose:
        return None
    groups = layout.shapes
    if not (folds or any(_loses(shape, options.faces) for shape, _ in groups)):
        return None
    place = layout.places if options.weld else _pinched(layout)
    rims = [
        _Rim.of(_pattern(shape), place[layout.patch_samples(patches, shape)], options.faces)
        for shape, patches in groups
    ]
    owner = np.concatenate([np.repeat(patches, len(_pattern(shape))) for shape, patches in groups])
    rim = _Rim(*(np.concatenate([getattr(r, f.name) for r in rims]) for f in fields(_Rim)))
    missing = np.flatnonzero(rim.missing())
    if not len(missing):
        return None
    further = np.zeros(len(layout.base))
    np.maximum.at(further, owner[missing], rim.distances(missing, positions))
    return further


def _pinched(layout: Layout) -> Ints:
    """The same place for all samples on a side that is one point, for others their own."""
    place = np.arange(layout.size)
    samples, corner = layout.collapsed_samples()
    stand_in = np.zeros(layout.connectivity.corners, dtype=np.intp)
    stand_in[layout.connectivity.corner] = layout.corner_samples()
    place[samples] = stand_in[corner]
    return place


@dataclass(frozen=True, eq=False, slots=True)
class _Rim:
    """Triangles by the places of their corners, (m, 3); which are gone; which are half a quad."""

    corners: Ints
    gone: Bools
    halves: Bools

    @staticmethod
    def of(pattern: IndexArray, place: Ints, kind: Faces) -> "_Rim":
        """A pattern at the places of the samples of some patches, (n, samples)."""
        corners = place[:, pattern[:, :3]].reshape(-1, 3)
        a, b, c = corners.T
        gone = (a == b) | (b == c) | (a == c)
        halves = np.zeros(len(gone), dtype=bool)
        if kind == "quads":
            # The halves of a cell, (00, 10, 01) and (10, 11, 01), follow one another.
            first = np.flatnonzero(np.tile(pattern[:, 3] > 0, len(place)))[::2]
            shut = a[first] == b[first + 1]
            gone[first] |= shut
            gone[first + 1] |= shut
            halves[first] = halves[first + 1] = ~(gone[first] | gone[first + 1])
            # The diagonal comes last; it is no side of the quad.
            corners[first + 1] = np.roll(corners[first + 1], -1, axis=1)
        return _Rim(corners, gone, halves)

    def missing(self) -> Bools:
        """Which triangles are gone and do not fall to a side of one that is there."""
        checkpoint()
        there, gone = self.corners[~self.gone], self.corners[self.gone]
        # A triangle without area is a line or a point: two places in any case.
        ends = np.stack([gone.min(axis=1), gone.max(axis=1)], axis=1)
        sides = [there[:, :2], there[:, ::2], there[~self.halves[~self.gone], 1:]]
        points = np.repeat(there.reshape(-1, 1), 2, axis=1)
        lines = np.sort(np.concatenate([*sides, points]), axis=1)
        step = int(self.corners.max()) + 1
        found = self.gone.copy()
        found[self.gone] = ~np.isin(ends @ [step, 1], lines @ [step, 1])
        # Both halves of a quad that is shut like a book have an area.
        found[self.gone] |= (np.diff(np.sort(gone, axis=1)) > 0).all(axis=1)
        return found

    def distances(self, chosen: Ints, positions: RealArray) -> FloatArray:
        """How far any point of these triangles is at most from some place that is there: (m,)."""
        used = np.unique(self.corners[~self.gone])
        if not len(used):
            return np.full(len(chosen), np.inf)
        corners = self.corners[chosen]
        others = used[:: -(-len(used) // CANDIDATES)]
        targets = np.concatenate([corners, np.tile(others, (len(corners), 1))], axis=1)
        points = positions[corners].astype(np.float64)
        nearest = np.full(len(chosen), np.inf)
        for target in targets.T:
            away = points - positions[target].astype(np.float64)[:, None]
            far = np.sqrt(np.square(away).sum(axis=2)).max(axis=1)
            np.minimum(nearest, np.where(np.isin(target, used), far, np.inf), out=nearest)
        return nearest


def _pattern(shape: AnyShape) -> IndexArray:
    """Triangles with a corner on the border of the patch, and whether they are half a cell: (m, 4).

    Those without area are among them; of a cell there are both halves or none.
    """
    if any(shape.collapsed):
        return _pattern(replace(shape, collapsed=NOTHING))

    def build() -> IndexArray:
        corners = faces(shape, "triangles")[0]
        cells = 2 * len(faces(shape, "quads")[1])
        rim = np.asarray(_border(shape)[corners].any(axis=1))
        rim[:cells] = np.repeat(rim[:cells].reshape(-1, 2).any(axis=1), 2)
        half = np.arange(len(corners), dtype=np.uint32) < cells
        return np.column_stack([corners, half]).astype(np.uint32)[rim]

    return PLANS.array(("rim", shape), build)


def _border(shape: AnyShape) -> Bools:
    """Which samples lie on the border of the patch, those beside its grid among them."""
    if isinstance(shape, TriangleShape):
        border = np.zeros(triangle.size(shape.divisions), dtype=bool)
        border[triangle.side_rows(shape.divisions)] = True
        return border
    inside = np.zeros((shape.resolution[0] + 1, shape.resolution[1] + 1), dtype=bool)
    inside[1:-1, 1:-1] = True
    border = np.ones(len(merged_samples(shape)), dtype=bool)
    border[: inside.size] = ~inside.ravel()
    return border


def _loses(shape: AnyShape, kind: Faces) -> bool:
    """Whether sides that are one point leave something out of a patch of this shape."""
    if not any(shape.collapsed[: 3 if isinstance(shape, TriangleShape) else 4]):
        return False

    def build() -> Bools:
        return _Rim.of(_pattern(shape), merged_samples(shape)[np.newaxis], kind).missing()

    return bool(PLANS.array(("loses", shape, kind), build).any())
