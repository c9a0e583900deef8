"""Numbers the samples of a model, patch after patch.

A tensor-product patch has a grid of (Ru + 1) (Rv + 1) samples. A triangle has rows of samples, with
max(Ru, Rv) divisions of each side. If a neighbour divides a shared edge more finely, the patch is
*stitched*: it takes the samples of its border from the edges. The samples of the edges that its
grid lacks get the last numbers, after the samples of all grids.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import Bools, IndexArray, Ints
from service.bases.cache import MESH_PLANS
from service.bases.row_batches import first_positions, unique_rows
from service.engine.connectivity.incidence import Connectivity
from service.engine.plans.patterns import AnyShape, Shape, TriangleShape
from service.engine.plans.sample_numbers import Block, BorderWrites, SampleRuns
from service.engine.plans.vertices import Averages
from service.surface.batches import Patches
from service.surface.sides import along_sides

FINE = 4
"""If a patch has at least this number of divisions along u and along v, its triangles without area
at a side that is one point are lines, which are sides of faces that the mesh keeps. Patches with
fewer divisions are examined one shape at a time (`service.engine.bounds.degenerate_faces`)."""


@dataclass(frozen=True, eq=False)
class Layout(SampleRuns):
    """The numbers of all samples of a model, which depend on connectivity and resolution alone.

    Attributes
    ----------
    connectivity, base, ru, rv, first_extra, extra_count
        As in `SampleRuns`: the first sample and the divisions of each patch; the first extra sample
        of each side, and their number.
    resolution : tuple of int
        Requested divisions along u and v.
    blocks : tuple of Block
        The grids of patches that are not stitched, then the grids of stitched patches.
    divisions : ndarray of int, shape (E,)
        The number of divisions of each distinct edge.
    size : int
        The number of samples.
    """

    resolution: tuple[int, int]
    blocks: tuple[Block, ...]
    divisions: Ints
    size: int

    @staticmethod
    def plan(connectivity: Connectivity, resolution: tuple[int, int]) -> "Layout":
        """The cached layout at these divisions of a patch along u and v."""
        layout = MESH_PLANS.get(
            ("layout", connectivity.key, resolution), lambda: Layout.build(connectivity, resolution)
        )
        assert isinstance(layout, Layout)
        return layout

    @staticmethod
    def build(connectivity: Connectivity, resolution: tuple[int, int]) -> "Layout":
        """A new layout: divisions of the edges, and numbers of the samples of patches and edges."""
        ru, rv = resolution
        edge, collapsed = connectivity.edge, connectivity.collapsed
        is_triangle, total = connectivity.is_triangle, len(connectivity.edge)
        rus, rvs = np.full(total, ru), np.full(total, rv)
        rus[is_triangle] = rvs[is_triangle] = max(ru, rv)
        side_divisions = np.stack(along_sides(rus, rvs), axis=1)
        # An edge takes the largest of the divisions of its sides. A triangle has max(Ru, Rv) on all
        # sides, so none of its edges is finer, and a triangle is never stitched.
        divisions = np.zeros(len(connectivity.sides_per_edge), dtype=np.intp)
        np.maximum.at(divisions, edge, side_divisions)
        is_finer = (divisions[edge] != side_divisions) & ~collapsed
        is_stitched = is_finer.any(axis=1)
        base = np.zeros(total, dtype=np.intp)
        # Strips of triangles need a line of samples inside the patch.
        rus[is_stitched], rvs[is_stitched] = max(ru, 2), max(rv, 2)
        blocks: list[Block] = []
        size = 0
        for are_stitched in (False, True):
            first = 0
            for batch_number, count in enumerate(connectivity.counts):
                rows = np.flatnonzero(is_stitched[first : first + count] == are_stitched)
                if len(rows):
                    grid = int(rus[first + rows[0]]), int(rvs[first + rows[0]])
                    has_triangles, is_whole_batch = bool(is_triangle[first]), len(rows) == count
                    block = Block(
                        batch_number, first, rows, grid, size, has_triangles, is_whole_batch
                    )
                    base[first + rows] = size + np.arange(len(rows)) * block.count
                    size += len(rows) * block.count
                    blocks.append(block)
                first += count
        # Without stitched patches, one number in memory stands for all sides.
        first_extra: Ints = np.broadcast_to(np.intp(-1), (total, 4))
        extra_count: Ints = np.broadcast_to(np.intp(0), (total, 4))
        if is_stitched.any():
            grid_divisions = np.stack(along_sides(rus, rvs), axis=1)
            has_extra = is_stitched[:, None] & (divisions[edge] != grid_divisions) & ~collapsed
            extra_count = np.where(has_extra, divisions[edge] - 1, 0)
            first_extra = np.full((total, 4), -1, dtype=np.intp)
            before = (np.cumsum(extra_count) - extra_count.ravel()).reshape(extra_count.shape)
            first_extra[has_extra] = size + before[has_extra]
            size += int(extra_count.sum())
        return Layout(
            connectivity=connectivity,
            base=base,
            ru=rus,
            rv=rvs,
            first_extra=first_extra,
            extra_count=extra_count,
            resolution=resolution,
            blocks=tuple(blocks),
            divisions=divisions,
            size=size,
        )

    @property
    def nbytes(self) -> int:
        """An upper bound of the bytes of the layout and of the values that are cached with it."""
        # For each sample of a side, `averages` has at most 4 numbers of 4 bytes, and
        # `border_writes` 2. The other arrays have at most 22 numbers of 8 bytes for each patch.
        border = int(self.divisions[self.connectivity.edge].sum()) + 4 * len(self.base)
        return 24 * border + 176 * len(self.base) + self.connectivity.nbytes

    def split_batches(self, batches: Sequence[Patches]) -> list[tuple[Block, Patches]]:
        """The blocks, each together with its patches from the batches of a model."""
        return [
            (
                block,
                batches[block.batch]
                if block.is_whole_batch
                else batches[block.batch].take(block.patches),
            )
            for block in self.blocks
        ]

    @cached_property
    def may_fold(self) -> bool:
        """Whether index patterns may keep faces that have two vertices at one position."""
        return bool(self.divisions.min() < 2) or self.connectivity.is_folded

    @cached_property
    def may_lose_faces(self) -> bool:
        """Whether a face without area may lie elsewhere than on a side of a face in the mesh."""
        is_fine = min(self.ru.min(), self.rv.min()) >= FINE
        return self.may_fold or (self.has_poles and not is_fine)

    @cached_property
    def has_poles(self) -> bool:
        """Whether any side is one point but has several samples."""
        return bool(self.pinched_sides.any())

    @cached_property
    def has_shared_samples(self) -> bool:
        """Whether two samples, of one patch or of two patches, have one position."""
        # A triangle has three corners.
        corners = self.connectivity.corner.size - int(np.count_nonzero(self.is_triangle))
        return (
            self.connectivity.is_joined
            or self.connectivity.corner_count < corners
            or self.has_poles
        )

    def find_leaders(self) -> IndexArray:
        """For each sample, one sample at its position, the same for all samples there, (N,).

        Samples have one position on a shared edge, at a corner or at a pole.
        """
        leaders = np.arange(self.size, dtype=np.uint32)
        leaders[self.averages.members] = self.averages.leader_of_member
        return leaders

    @cached_property
    def averages(self) -> Averages:
        """The groups of samples at one position; smooth models get the mean of their normals."""
        leaders = np.arange(self.size, dtype=np.uint32)
        edge = self.connectivity.edge.ravel()
        for divisions, sides in self.side_groups():
            samples = self.find_side_samples(sides, divisions)
            # The first side of each edge represents all its sides.
            edge_of_side = edge[sides]
            leaders[samples] = samples[first_positions(edge_of_side, len(self.divisions))][
                edge_of_side
            ]
        corners, corner = self.corner_samples(), self.connectivity.corner
        first = first_positions(corner.ravel(), self.connectivity.corner_count)
        first_at_corner = corners.ravel()[first]
        leaders[corners] = first_at_corner[corner]
        samples, corner_of_sample = self.find_collapsed_samples()
        leaders[samples] = first_at_corner[corner_of_sample]
        return Averages.from_leaders(leaders)

    @cached_property
    def border_writes(self) -> BorderWrites:
        """Which samples of edges and corners replace the samples on the borders of patches."""
        edge = self.connectivity.edge.ravel()
        groups: list[tuple[int, Bools | None]] = []
        targets, sources = [], []
        first = 0
        by_divisions = [*self.side_groups()]
        for divisions, sides in by_divisions:
            has_divisions = np.zeros(len(self.divisions), dtype=bool)
            # If all edges have equal divisions, all are sampled, also edges that are one point,
            # because leaving them out takes longer.
            has_divisions[edge[sides] if len(by_divisions) > 1 else slice(None)] = True
            groups.append((divisions, None if has_divisions.all() else has_divisions))
            count = int(np.count_nonzero(has_divisions))
            # For each side, the row of the table with the first sample of its edge; its other
            # samples follow in every `count`-th row.
            row = (np.cumsum(has_divisions)[edge[sides]] - 1 + first).astype(np.uint32)
            # The ends of a side are corners.
            steps = count * np.arange(1, divisions, dtype=np.uint32)
            sources.append((row[:, None] + steps).ravel())
            targets.append(self.find_side_samples(sides, divisions)[:, 1:-1].ravel())
            first += count * (divisions + 1)
        collapsed_samples, corner_of_sample = self.find_collapsed_samples()
        targets += [self.corner_samples().ravel(), collapsed_samples]
        corners = first + self.connectivity.corner.ravel(), first + corner_of_sample
        sources += [rows.astype(np.uint32) for rows in corners]
        return BorderWrites(tuple(groups), np.concatenate(targets), np.concatenate(sources))

    @cached_property
    def shapes(self) -> tuple[tuple[AnyShape, Ints], ...]:
        """Patches grouped by their index pattern, in the order of the first patch of each group."""
        sides = list(along_sides(self.ru, self.rv))
        if self.is_stitched:
            sides = [
                np.where(first >= 0, extra + 1, divisions)
                for first, extra, divisions in zip(
                    self.first_extra.T, self.extra_count.T, sides, strict=True
                )
            ]
        is_turned = self.connectivity.is_cut_twice[:, :2] & ~self.is_triangle[:, None]
        # Whether triangle; Ru, Rv; the divisions of four sides; which sides are one point; which of
        # the corners (0, 0) and (1, 1) two patches cut off by the same line.
        columns = [self.is_triangle, self.ru, self.rv, *sides]
        columns += [*self.connectivity.collapsed.T, *is_turned.T]
        # Most columns have one value for all patches.
        varying = [column for column in columns if (column != column[0]).any()]
        first, number = np.zeros(1, np.intp), np.zeros(len(self.base), np.intp)
        if varying:
            first, number = unique_rows(np.stack(varying, axis=1).astype(np.float64))
        numbers_by_shape: list[tuple[AnyShape, Ints]] = []
        for k in np.argsort(first, kind="stable").tolist():
            is_triangle, ru, rv, a, b, c, d, *bits = [column[first[k]].item() for column in columns]
            collapsed = bool(bits[0]), bool(bits[1]), bool(bits[2]), bool(bits[3])
            turned = bool(bits[4]), bool(bits[5])
            shape: AnyShape = TriangleShape(ru, collapsed)
            if not is_triangle:
                shape = Shape((ru, rv), (a, b, c, d), collapsed, turned)
            numbers_by_shape.append((shape, np.flatnonzero(number == k)))
        return tuple(numbers_by_shape)

    def side_groups(self) -> Iterator[tuple[int, Ints]]:
        """Yields each number of divisions with its sides (patch · 4 + side) that are not points."""
        divisions = self.divisions[self.connectivity.edge.ravel()]
        is_line = ~self.connectivity.collapsed.ravel()
        for number in np.unique(divisions[is_line]).tolist():
            yield number, np.flatnonzero(is_line & (divisions == number))
