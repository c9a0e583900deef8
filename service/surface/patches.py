"""A surface of many Bézier patches, four-sided or triangular, over one list of vertices."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from service.bases import triangle
from service.bases.arrays import FloatArray, Ints
from service.errors import InvalidRequest, Issue
from service.surface.batches import Channel, Patches, TensorPatches, TrianglePatches
from service.surface.channels import NO_CHANNELS, Channels
from service.surface.checks import (
    Up,
    check_triangle,
    check_up,
    validate_points,
    validate_weights,
)
from service.surface.grids import (
    NO_GRIDS,
    Grids,
    IndexGrid,
    PartMembers,
    check_indices,
    check_parts,
    first_patch,
    group_by_degree,
    order_parts,
    validate_grids,
)
from service.surface.lowered import PatchModel
from service.surface.placement import Box, find_box
from service.surface.sizes import NUMBER, SurfaceKind, SurfaceSize, tensor_size

NO_TRIANGLES: NDArray[np.int64] = np.empty((0, 3), dtype=np.int64)


@dataclass(frozen=True, eq=False, slots=True)
class PatchSurface(SurfaceKind):
    """Bézier patches that are given by indices into one list of vertices.

    A patch is a grid of indices (tensor-product) or a triangle. Grids may have different degrees
    (p, q); all triangles have one degree n. If two patches have the same vertices along a side,
    they share this edge.

    Attributes
    ----------
    vertices : ndarray of float64, shape (V, 3)
        Control points that the patches share. Model units.
    patches : ndarray of int64, shape (P, p+1, q+1), or P arrays (p+1, q+1) of several degrees
        Indices into `vertices`, from 0. The last axis runs along v, the axis before it along u. P
        may be 0.
    weights : ndarray of float64, shape (V,), or None
        One positive weight for each vertex.
    parts : tuple of (name, patch numbers)
        Named groups of patches. Patch numbers count the grids first, then the triangles. A patch
        belongs to at most one part. The patches without a part form a last part with the surface's
        name. Parts are sorted by the first patch number in their lists.
    up : "y" or "z"
        The model's vertical axis.
    name : str
        Name of the model.
    channels : Channels
        Colours, texture coordinates and attributes: one value for each vertex.
    triangles : ndarray of int64, shape (T, (n+1)(n+2)/2)
        Indices into `vertices`, row after row: n + 1 along the side t = 0, then n, …, and 1 at the
        opposite corner. T may be 0.

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the surface.
    """

    vertices: FloatArray
    patches: Grids = field(default_factory=lambda: NO_GRIDS)
    weights: FloatArray | None = None
    parts: PartMembers = ()
    up: Up = "y"
    name: str = "surface"
    channels: Channels = NO_CHANNELS
    triangles: NDArray[np.int64] = field(default_factory=lambda: NO_TRIANGLES)
    _by_degree: tuple[tuple[Ints, IndexGrid], ...] = field(init=False, repr=False)
    _name_bytes: int = field(init=False, repr=False)

    def __post_init__(self) -> None:
        vertices = validate_points(self.vertices, "vertices", axes=2)
        patches = validate_grids(self.patches)
        triangles = np.array(self.triangles, dtype=np.int64, order="C")
        _check_triangles(triangles, len(patches))
        check_indices(patches, len(vertices), "patches")
        check_indices(triangles, len(vertices), "triangles")
        triangles.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "patches", patches)
        object.__setattr__(self, "triangles", triangles)
        object.__setattr__(self, "weights", validate_weights(self.weights, (len(vertices),)))
        object.__setattr__(self, "_by_degree", group_by_degree(patches))
        self.channels.check_per_vertex(len(vertices), self.index_count)
        check_parts(self.parts, len(patches) + len(triangles))
        object.__setattr__(self, "parts", tuple(sorted(self.parts, key=first_patch)))
        object.__setattr__(self, "_name_bytes", sum(len(name.encode()) for name, _ in self.parts))
        check_up(self.up)

    @property
    def by_degree(self) -> tuple[tuple[Ints, IndexGrid], ...]:
        """For each degree, the numbers (K,) and the grids (K, p+1, q+1) of its patches."""
        return self._by_degree

    @property
    def degree(self) -> tuple[int, int]:
        """Highest p and highest q of the grids; (1, 1) for a surface without grids."""
        if isinstance(self.patches, np.ndarray):
            _, rows, columns = self.patches.shape
            return rows - 1, columns - 1
        p, q = np.max([grid.shape for grid in self.patches], axis=0).tolist()
        return p - 1, q - 1

    @property
    def triangle_degree(self) -> int:
        """Degree of every triangle."""
        return triangle.degree_of(self.triangles.shape[1])

    @property
    def index_count(self) -> int:
        """Number of indices in all patches."""
        if isinstance(self.patches, np.ndarray):
            return self.patches.size + self.triangles.size
        return sum(grid.size for grid in self.patches) + self.triangles.size

    def size(self) -> SurfaceSize:
        """The size of the grids and triangles, with points gathered from the vertices."""
        triangles, (p, q), n = len(self.triangles), self.degree, self.triangle_degree
        weights, channels = self.weights, self.channels
        size = tensor_size(len(self.patches), (p, q), weights, channels, name=self.name)
        vertex_bytes = self.vertices.nbytes + (0 if weights is None else weights.nbytes)
        index_count, triangle_indices = self.index_count, self.triangles.size
        numbers = 3 + (weights is not None) + size.width
        # The points, and the arrays `request_numbers` and `sequence`.
        result_bytes = (index_count * numbers + 2 * (size.grids + triangles)) * NUMBER
        # A triangle has four sides of n + 1 points here, like the grid to which some computations
        # convert it.
        triangle_side_bytes = triangles * (numbers - size.width) * NUMBER * 4 * (n + 1)
        # Temporary arrays: the indices in the order of the parts, and the indices of the sorting.
        temporary_bytes = (index_count + 8 * (size.grids + triangles)) * NUMBER
        return replace(
            size,
            degree=(max(p, n), max(q, n)),
            triangles=triangles,
            nets=size.grids + triangles,
            control_points=index_count + triangle_indices,
            net_points=index_count,
            net_segments=2 * index_count + triangle_indices,
            net_cells=index_count,
            parts=len(self.parts) + 1,
            name_bytes=size.name_bytes + self._name_bytes,
            surface_bytes=vertex_bytes
            + NUMBER * index_count
            + sum(net.nbytes for *_, net in channels.each()),
            lowered_bytes=result_bytes,
            peak_bytes=result_bytes + temporary_bytes,
            side_bytes=size.side_bytes + triangle_side_bytes,
        )

    def bounds(self) -> Box:
        """Least and greatest coordinates of the vertices."""
        return find_box(self.vertices)

    def lower(self) -> PatchModel:
        """A batch for each degree of the grids and one of the triangles, ordered part by part."""
        count = len(self.patches) + len(self.triangles)
        part_order, parts = order_parts(self.parts, count, self.name)
        forms = self._by_degree
        if len(self.triangles):
            forms += ((np.arange(len(self.patches), count), self.triangles),)
        # Without parts, grids of one degree, and triangles after them, need no new order.
        order = sequence = None
        if len(forms) == 1:
            order = part_order
        elif part_order is not None or len(forms[0][0]) < len(self.patches):  # or several degrees
            # Each form (a degree of grids, or the triangles) becomes one batch, with patches of all
            # parts; so `order` sorts by form, and `sequence` leads back to the order of the parts.
            form = np.empty(count, np.intp)
            for number, (members, _) in enumerate(forms):
                form[members] = number
            full_order = np.arange(count) if part_order is None else part_order
            order = full_order[np.argsort(form[full_order], kind="stable")]
            sequence = np.argsort(order)[full_order]
        batches: list[Patches] = []
        first = 0
        for members, indices in forms:
            batch_indices = indices
            if order is not None:
                rows = order[first : first + len(members)]
                if len(forms) > 1:  # from patch numbers to rows of `indices`
                    rows = np.searchsorted(members, rows)
                batch_indices = indices[rows]
            first += len(members)
            kind = TensorPatches if indices.ndim == 3 else TrianglePatches
            batches.append(kind(*self._gather(batch_indices)))
        return PatchModel(
            self.name, tuple(batches), parts, self.up, request_numbers=order, sequence=sequence
        )

    def _gather(
        self, indices: NDArray[np.int64]
    ) -> tuple[FloatArray, FloatArray | None, tuple[Channel, ...]]:
        """Points, weights and channels of the patches with these vertex indices."""
        weights = None if self.weights is None else self.weights[indices]
        channels: tuple[Channel, ...] = ()
        if self.channels is not NO_CHANNELS:
            channels = self.channels.lower(lambda values: values[indices])
        return self.vertices.take(indices, axis=0), weights, channels


def _check_triangles(triangles: NDArray[np.int64], grids: int) -> None:
    """Refuse an array that cannot be triangles of one degree, and a surface without patches."""
    if triangles.ndim != 2:
        raise InvalidRequest(
            Issue(
                "too_few_points",
                "Every triangle is a list of vertex indices, row after row.",
                "/triangles",
                f"indices of shape {triangles.shape}",
                "triangles × indices",
            )
        )
    if not grids + len(triangles):
        raise InvalidRequest(
            Issue(
                "too_few_points",
                "There must be at least one patch, in `patches` or in `triangles`.",
                "/patches",
                "no patch",
                "grids of vertex indices, triangles of them, or both",
            )
        )
    check_triangle(triangles.shape[1], "triangles")
