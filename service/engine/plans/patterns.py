"""Index patterns: the faces of one patch as indices of its samples, without coordinates.

A pattern depends on the numbers of divisions and on which sides are one point; one cached pattern
serves all patches of that shape. The samples of a patch have local indices: sample (i, j) of the
grid has index i (Rv+1) + j. If the divisions of a side differ from the grid, its inner samples have
the next indices; the order of the sides is u = 0, u = 1, v = 0, v = 1. Samples of a triangle are
numbered row by row (`service.bases.triangle`).
"""

from dataclasses import dataclass
from typing import TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from service.bases import triangle
from service.bases.arrays import Bools, IndexArray, Ints
from service.bases.cache import BASES
from service.engine.options import Faces
from service.engine.plans.strips import Divisions, build_strips
from service.surface.sides import along_sides

Index = TypeVar("Index", np.uint32, np.intp)

NO_TRIANGLES: IndexArray = np.empty((0, 3), dtype=np.uint32)
NO_QUADS: IndexArray = np.empty((0, 4), dtype=np.uint32)


@dataclass(frozen=True, slots=True)
class Shape:
    """The shape of a patch, which determines its pattern.

    `sides` are the divisions of the four sides. If the divisions of a side differ from those of the
    grid, the patch is stitched: strips of triangles run along all four sides. `collapsed` says
    which sides are one point. `is_turned` says whether the first and the last cell are split along
    (0, 0)–(1, 1); all other cells are split along the other diagonal.
    """

    resolution: tuple[int, int]
    sides: Divisions
    collapsed: tuple[bool, bool, bool, bool] = (False, False, False, False)
    is_turned: tuple[bool, bool] = (False, False)

    @property
    def grid_divisions(self) -> Divisions:
        """The grid's divisions along the four sides."""
        return along_sides(*self.resolution)

    @property
    def is_stitched(self) -> bool:
        """Whether the divisions of a side differ from those of the grid."""
        return self.sides != self.grid_divisions

    @property
    def grid_size(self) -> int:
        """The number of samples of the grid."""
        return (self.resolution[0] + 1) * (self.resolution[1] + 1)

    @property
    def inner(self) -> int:
        """The number of samples inside the patch, not on its border."""
        return (self.resolution[0] - 1) * (self.resolution[1] - 1)


@dataclass(frozen=True, slots=True)
class TriangleShape:
    """The shape of a triangular patch, which determines its pattern. Triangles are never stitched.

    The fourth side of a triangle is always one point.
    """

    divisions: int
    collapsed: tuple[bool, bool, bool, bool] = (False, False, False, True)

    @property
    def grid_size(self) -> int:
        """The number of samples."""
        return triangle.count_points(self.divisions)

    @property
    def inner(self) -> int:
        """The number of samples inside the patch, not on its border."""
        return (self.divisions - 1) * (self.divisions - 2) // 2


AnyShape: TypeAlias = Shape | TriangleShape


def build_faces(shape: AnyShape, kind: Faces) -> tuple[IndexArray, IndexArray]:
    """Triangles (T, 3) and quads (Q, 4) of a patch of this shape, as local indices; read-only.

    A cell has the corners (i,j) (i+1,j) (i+1,j+1) (i,j+1), in this order. It is split along
    (1,0)–(0,1), unless it is turned. Faces without area at a collapsed side are omitted; a quad
    there may become a triangle. A triangular patch of R divisions has R² triangles, also if quads
    are requested. They are listed row by row; in a row, upright and reversed triangles alternate.
    """
    if isinstance(shape, TriangleShape):
        return BASES.array(("triangles", shape), lambda: _build_triangle_rows(shape)), NO_QUADS
    triangles = BASES.array(("triangles", shape, kind), lambda: _build_grid_faces(shape, kind)[0])
    if kind == "triangles":
        return triangles, NO_QUADS
    return triangles, BASES.array(("quads", shape), lambda: _build_grid_faces(shape, kind)[1])


def find_used_samples(shape: AnyShape, kind: Faces) -> Ints:
    """The local indices that occur in the faces of this shape, in ascending order; read-only."""
    return BASES.array(
        ("used", shape, kind), lambda: np.union1d(*build_faces(shape, kind)).astype(np.intp)
    )


def _build_grid_faces(shape: Shape, kind: Faces) -> tuple[IndexArray, IndexArray]:
    """Triangles and quads of a tensor-product patch of this shape, as local indices."""
    ru, rv = shape.resolution
    if not shape.is_stitched and not any(shape.collapsed):
        if kind == "quads":
            return NO_TRIANGLES, _repeat_rows(_build_cell_row(rv), ru, rv + 1)
        return _turn_corner_cells(
            shape, _repeat_rows(_split_quads(_build_cell_row(rv)), ru, rv + 1)
        ), NO_QUADS
    cells = _repeat_rows(_build_cell_row(rv), ru, rv + 1).astype(np.intp)
    if shape.is_stitched:
        cells = cells.reshape(ru, rv, 4)[1:-1, 1:-1].reshape(-1, 4)
    return _build_cells(shape, kind, cells)


def build_rim(shape: Shape, kind: Faces) -> tuple[IndexArray, IndexArray]:
    """Triangles and quads of a patch of this shape, without the faces of its inner cells.

    The (Ru − 2)(Rv − 2) inner cells touch no side, so their faces do not depend on the sides. So
    all faces can be counted from these faces at the rim, in a time that grows with Ru + Rv.
    """
    ru, rv = shape.resolution
    first_corner = np.arange(0)
    # At the sides of a stitched patch are strips, which `_build_cells` adds, and no cells.
    if not shape.is_stitched:
        i, j = np.arange(ru), np.arange(rv)
        ends_u, ends_v = np.unique([0, ru - 1]), np.unique([0, rv - 1])
        rows = (ends_u[:, None] * (rv + 1) + j).ravel()
        columns = (i[1:-1, None] * (rv + 1) + ends_v).ravel()
        first_corner = np.concatenate([rows, columns])
    above = first_corner + rv + 1  # the sample (i + 1, j)
    cells = np.stack([first_corner, above, above + 1, first_corner + 1], axis=1)
    return _build_cells(shape, kind, cells)


def _build_cells(shape: Shape, kind: Faces, cells: Ints) -> tuple[IndexArray, IndexArray]:
    """Faces of these cells and of strips along the sides, without faces that repeat a vertex."""
    ru, rv = shape.resolution
    number = np.arange((ru + 1) * (rv + 1)).reshape(ru + 1, rv + 1)
    strips = build_strips(number, shape.sides) if shape.is_stitched else []
    merged = merge_collapsed(shape)
    quads = cells[:0]
    if kind == "quads":
        is_quad = _find_proper(merged[cells])
        quads, cells = cells[is_quad], cells[~is_quad]
    triangles = np.concatenate([_turn_corner_cells(shape, _split_quads(cells)), *strips])
    triangles = triangles[_find_proper(merged[triangles])]
    return triangles.astype(np.uint32), quads.astype(np.uint32)


def _build_triangle_rows(shape: TriangleShape) -> IndexArray:
    """Triangles (m,j) (m,j+1) (m+1,j) and (m,j+1) (m+1,j+1) (m+1,j), shape (T, 3)."""
    divisions = shape.divisions
    # Each sample but the last of its row begins an upright triangle. The samples above these
    # samples have consecutive numbers.
    ends = triangle.side_rows(divisions)[1]
    first_corner = np.delete(np.arange(triangle.count_points(divisions)), ends).astype(np.uint32)
    above = np.uint32(divisions + 1) + np.arange(len(first_corner), dtype=np.uint32)
    one = np.uint32(1)
    pairs = np.stack(
        [first_corner, first_corner + one, above, first_corner + one, above + one, above], axis=1
    )
    is_used = np.ones((len(first_corner), 2), dtype=bool)
    # No reversed triangle follows the last upright triangle of a row.
    is_used[triangle.side_rows(divisions - 1)[1], 1] = False
    triangles = pairs.reshape(-1, 3)[is_used.ravel()]
    if any(shape.collapsed[:3]):
        triangles = triangles[_find_proper(merge_collapsed(shape)[triangles])]
    return triangles


def _build_cell_row(columns: int) -> IndexArray:
    """The quads between the first two lines of samples, shape (Rv, 4)."""
    j = np.arange(columns, dtype=np.uint32)
    above = j + np.uint32(columns + 1)  # the samples (1, j)
    return np.stack([j, above, above + np.uint32(1), j + np.uint32(1)], axis=1)


def _repeat_rows(row: IndexArray, rows: int, step: int) -> IndexArray:
    """The faces of all rows of cells, from the faces of the first row, by one addition."""
    offsets = np.arange(rows, dtype=np.uint32) * np.uint32(step)
    return (row + offsets[:, None, None]).reshape(-1, row.shape[1])


def _split_quads(cells: NDArray[Index]) -> NDArray[Index]:
    """Two triangles of every quad, split along (1, 0)–(0, 1)."""
    # The corners 0, 1, 2, 3 of a cell are (0, 0), (1, 0), (1, 1), (0, 1).
    return cells[:, [0, 1, 3, 1, 2, 3]].reshape(-1, 3)


def _turn_corner_cells(shape: Shape, triangles: NDArray[Index]) -> NDArray[Index]:
    """The triangles, with the first and the last cell split along the other diagonal if turned."""
    ru, rv = shape.resolution
    if min(ru, rv) < 2:
        # The other diagonal, too, would join two sides.
        return triangles
    # The triangles 0, 1, 3 and 1, 2, 3 of the cell become 0, 1, 2 and 0, 2, 3. The first cell
    # begins at the sample (0, 0), the last at (Ru − 1, Rv − 1).
    for is_turned, begin in zip(shape.is_turned, (0, (ru - 1) * (rv + 1) + rv - 1), strict=True):
        is_first_half = (
            (triangles[:, 0] == begin) & (triangles[:, 2] == begin + 1) if is_turned else []
        )
        for row in np.flatnonzero(is_first_half).tolist():
            opposite = triangles[row + 1, 1]
            triangles[row + 1, 0], triangles[row, 2] = triangles[row, 0], opposite
    return triangles


def merge_collapsed(shape: AnyShape) -> Ints:
    """All local indices, where the samples of a collapsed side have one common index."""
    if isinstance(shape, TriangleShape):
        indices = np.arange(triangle.count_points(shape.divisions))
        borders = list(triangle.side_rows(shape.divisions))
    else:
        ru, rv = shape.resolution
        extra = sum(
            n - 1
            for n, divisions in zip(shape.sides, shape.grid_divisions, strict=True)
            if n != divisions
        )
        number = np.arange((ru + 1) * (rv + 1)).reshape(ru + 1, rv + 1)
        indices = np.arange(number.size + extra)
        borders = [number[0], number[-1], number[:, 0], number[:, -1]]
    for border, is_collapsed in zip(borders, shape.collapsed, strict=False):
        if is_collapsed:
            # If two collapsed sides meet, both are the same point.
            is_same_point = np.zeros(len(indices), dtype=bool)
            is_same_point[indices[border]] = True
            indices[is_same_point[indices]] = indices[border].min()
    return indices


def _find_proper(faces: Ints) -> Bools:
    """Which faces do not repeat a vertex."""
    ordered = np.sort(faces, axis=1)
    is_proper: Bools = (ordered[:, 1:] != ordered[:, :-1]).all(axis=1)
    return is_proper
