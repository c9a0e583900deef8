"""The size of a surface and of its lowered model, computed from the shapes of its arrays alone.

Every kind of surface has a method `size`, so that the service can estimate the cost of a request
before it allocates memory.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import zip_longest
from typing import TypeAlias

from service.bases.arrays import FloatArray
from service.surface.channels import NO_CHANNELS, Channels
from service.surface.checks import Up
from service.surface.lowered import Model
from service.surface.placement import Box, find_box

MEMBER_BYTES = 900
"""Bytes of a member of a group, and of its lowered form, in addition to its surface and names."""

NUMBER = 8
"""Bytes of a number in double precision, and of an index."""

Attributes: TypeAlias = tuple[tuple[str, int], ...]
"""Names of attributes, each with the number of its values at a point."""


@dataclass(frozen=True, slots=True)
class SurfaceSize:
    """Counts and bytes of a surface; for a group, of all members together.

    Attributes
    ----------
    degree : (int, int)
        Highest degree along u and v of any patch, or of a swept curve.
    grids, triangles : int
        Number of tensor-product patches, and number of triangular patches.
    control_points : int
        Upper bound of the control points of all patches. Control points of triangles count
        twice, because some computations convert triangles to grids.
    net_points, net_segments, net_cells : int
        Upper bounds of the points, lines and cells of the drawn control net.
    parts, name_bytes : int
        Upper bounds of the number of named parts, and of the bytes of all names in UTF-8.
    members, surfaces, label_bytes, member_bytes : int
        For groups: the number of placed surfaces; the number of distinct ones; bytes of the names
        of all members together, each with a separator; and bytes of memory for the members,
        without their surfaces. 1, 1, 0 and 0 for other kinds.
    colors, uvs : int
        How many numbers a color has, and the texture coordinates of a point have; 0 for surfaces
        without them.
    attributes : tuple of (name, int)
        The name of each attribute, and the number of its values at a point.
    surface_bytes, lowered_bytes, peak_bytes : int
        Bytes of the arrays of the surface; bytes of the additional arrays of its lowered model; and
        the most bytes in use while the surface is lowered.
    side_bytes : int
        Bytes of the control points on the sides of all patches.
    nets : int
        Number of control nets that a file of definitions has: one for each patch, for each
        B-spline, and for each face of a brep.
    curves, swept_vertices, extra_vertices : int
        For sweeps: the number of Bézier pieces of the curves; the number of vertices if every piece
        has one division, without the vertices at the end of the curve; and an upper bound of the
        additional vertices at this end, of caps, and at bends.
    faces, edges, coedges, face_colors : int
        For breps: the number of faces, of edges, and of coedges of all loops; and the number of
        distinct colours of faces, where faces without a colour count as one colour. Faces do not
        count in `parts`.
    placed_faces, defined_faces, face_name_bytes : int
        For breps: the number of faces if each copy counts, and if equal members count once; and the
        bytes of the names of all placed faces as parts, with those of their members.
    face_patches, edge_pieces : int
        For breps: the numbers of Bézier patches of the surfaces of all faces, and of Bézier pieces
        of the curves of edges and of all pcurves.
    """

    degree: tuple[int, int]
    grids: int = 0
    triangles: int = 0
    control_points: int = 0
    net_points: int = 0
    net_segments: int = 0
    net_cells: int = 0
    parts: int = 1
    name_bytes: int = 0
    members: int = 1
    surfaces: int = 1
    label_bytes: int = 0
    member_bytes: int = 0
    colors: int = 0
    uvs: int = 0
    attributes: Attributes = ()
    surface_bytes: int = 0
    lowered_bytes: int = 0
    peak_bytes: int = 0
    side_bytes: int = 0
    nets: int = 0
    curves: int = 0
    swept_vertices: int = 0
    extra_vertices: int = 0
    faces: int = 0
    edges: int = 0
    coedges: int = 0
    face_colors: int = 0
    face_patches: int = 0
    edge_pieces: int = 0
    placed_faces: int = 0
    defined_faces: int = 0
    face_name_bytes: int = 0

    @property
    def patches(self) -> int:
        """Number of Bézier patches."""
        return self.grids + self.triangles

    @property
    def width(self) -> int:
        """How many numbers all channels together have at a point."""
        return self.colors + self.uvs + sum(dimension for _, dimension in self.attributes)


class SurfaceKind(ABC):
    """The base of every kind of surface: its lowering, its size and its box."""

    __slots__ = ()
    up: Up
    name: str

    @property
    def unit(self) -> float | None:
        """Metres in one unit of the coordinates; None if this is not known."""
        return None

    @abstractmethod
    def lower(self) -> Model:
        """The surface as batches of Bézier patches, as a sweep, or as a group of these."""

    @abstractmethod
    def size(self) -> SurfaceSize:
        """The size, computed from shapes in a few microseconds; each member of a group counts."""

    def stored_size(self) -> SurfaceSize:
        """The size if equal members of a group are counted once."""
        return self.size()

    def written_size(self) -> SurfaceSize:
        """The size of what a document of the surface has."""
        return self.size()

    def exact_patches(self) -> "SurfaceKind":
        """An equal surface of patches or faces, to which questions are answered.

        Raises
        ------
        InvalidRequest
            `not_parametric`: a tube or ribbon that is not made of patches, with the reason.
        """
        return self

    def bounds(self) -> Box:
        """Least and greatest coordinates of a box that contains the surface.

        Kinds with control points override this method: they need not be lowered for it.
        """
        return self.lower().bounds


class NetSurface(SurfaceKind):
    """The base of the kinds of surface that have one control net."""

    __slots__ = ()
    control_net: FloatArray
    weights: FloatArray | None
    channels: Channels

    def bounds(self) -> Box:
        """Least and greatest coordinates of the control points."""
        return find_box(self.control_net)


def tensor_size(
    patches: int,
    degree: tuple[int, int],
    weights: FloatArray | None,
    channels: Channels,
    *,
    name: str,
    is_triangular: bool = False,
) -> SurfaceSize:
    """The size of a surface whose patches have one degree and are views of its own arrays.

    Parameters
    ----------
    patches : int
        Number of patches.
    degree : (int, int)
        Their degree (p, q); (n, n) for triangles of degree n.
    weights : ndarray or None
        Not None if the patches are rational.
    channels : Channels
    name : str
        Name of the surface.
    is_triangular : bool
        Whether the patches are triangles.
    """
    numbers = 3 + (weights is not None)
    # The name counts twice: as name of the model, and as name of its part.
    size = _plain_size(patches, degree, numbers, 2 * len(name.encode()), is_triangular)
    if channels is NO_CHANNELS:
        return size
    colors, uvs = channels.colors, channels.uvs
    return replace(
        size,
        colors=0 if colors is None else colors.shape[-1],
        uvs=0 if uvs is None else 2,
        attributes=tuple((title, net.shape[-1]) for title, net in channels.attributes),
        surface_bytes=size.surface_bytes + sum(net.nbytes for *_, net in channels.each()),
    )


@lru_cache(256)
def _plain_size(
    patches: int, degree: tuple[int, int], numbers: int, name_bytes: int, is_triangular: bool
) -> SurfaceSize:
    """The size of patches without channels.

    A control point has 3 `numbers`, or 4 with its weight.
    """
    p, q = degree
    points = patches * ((p + 1) * (p + 2) // 2 if is_triangular else (p + 1) * (q + 1))
    return SurfaceSize(
        degree,
        grids=0 if is_triangular else patches,
        triangles=patches if is_triangular else 0,
        control_points=points * (1 + is_triangular),
        net_points=points,
        # At most two segments and one cell begin at a control point; on triangles, three segments.
        net_segments=points * (2 + is_triangular),
        net_cells=points,
        name_bytes=name_bytes,
        surface_bytes=points * numbers * NUMBER,
        nets=patches,
        side_bytes=patches * numbers * NUMBER * 2 * (p + q + 2),
    )


_SUM_FIELDS = (
    "grids", "triangles", "control_points", "net_points", "net_segments", "net_cells", "parts",
    "name_bytes", "surface_bytes", "lowered_bytes", "peak_bytes", "side_bytes", "nets", "curves",
    "swept_vertices", "extra_vertices", "faces", "edges", "coedges", "face_colors",
    "face_patches", "edge_pieces", "placed_faces", "defined_faces", "face_name_bytes",
)  # fmt: skip


def add_sizes(
    sizes: Sequence[SurfaceSize], *, name: str, counts: Sequence[int] | None = None
) -> SurfaceSize:
    """The size of one surface whose parts are surfaces of these sizes, with the same channels.

    If `counts` are given, `counts[k]` of the parts have size k.
    """
    counts = counts or [1] * len(sizes)
    sums = {
        field: sum(count * getattr(size, field) for size, count in zip(sizes, counts, strict=True))
        for field in _SUM_FIELDS
    }
    sums["name_bytes"] += 2 * len(name.encode())
    degree = max(size.degree[0] for size in sizes), max(size.degree[1] for size in sizes)
    return replace(sizes[0], degree=degree, **sums)


def group_sizes(
    sizes: Sequence[SurfaceSize],
    numbers: Sequence[int],
    path_bytes: Sequence[int],
    *,
    name: str,
    frame_bytes: Sequence[int] = (),
    is_colored: bool,
) -> tuple[SurfaceSize, SurfaceSize, SurfaceSize]:
    """Three sizes of a group: if each member counts, if equal members count once, and as written.

    The last one is that of a document with definitions.

    Parameters
    ----------
    sizes : sequence of SurfaceSize
        The sizes of the distinct surfaces.
    numbers : sequence of int
        For each member with a surface, the number of its surface.
    path_bytes : sequence of int
        The bytes of the names of these members, each after those of its parents.
    name : str
        Name of the group.
    frame_bytes : sequence of int
        The bytes of the names of all members without a surface.
    is_colored : bool
        Whether any member has a base color.
    """
    count = len(numbers)
    counts = [0] * len(sizes)
    part_name_bytes = face_label_bytes = 0
    for number, length in zip(numbers, path_bytes, strict=True):
        counts[number] += 1
        # In a scene the parts of a member, and the faces of a brep, are called "member/part".
        part_name_bytes += (sizes[number].parts + 1) * (length + 1)
        face_label_bytes += sizes[number].faces * (length + 1)
    all_members = add_sizes(sizes, name=name, counts=counts)
    distinct_members = add_sizes(sizes, name=name)
    member_count = count + len(frame_bytes)

    def sum_members(members: SurfaceSize, attributes: Attributes) -> SurfaceSize:
        return replace(
            members,
            # A node for every member, and below it a node for each of its parts, or for its turn.
            parts=all_members.parts + member_count,
            name_bytes=all_members.name_bytes + part_name_bytes + sum(frame_bytes),
            members=count,
            surfaces=len(sizes),
            label_bytes=sum(path_bytes) + count,
            member_bytes=MEMBER_BYTES * member_count + sum(path_bytes),
            placed_faces=all_members.faces,
            defined_faces=distinct_members.faces,
            face_name_bytes=all_members.face_name_bytes + face_label_bytes,
            colors=4 if is_colored else max(size.colors for size in sizes),
            uvs=max(size.uvs for size in sizes),
            attributes=attributes,
            lowered_bytes=distinct_members.lowered_bytes,
            # In addition to all models, temporary arrays of one surface at a time: those of its
            # lowering, or the copy of its arrays of which `content_key` takes the hash.
            peak_bytes=distinct_members.lowered_bytes
            + max(max(size.peak_bytes - size.lowered_bytes, size.surface_bytes) for size in sizes),
            side_bytes=distinct_members.side_bytes,
        )

    # A joined mesh keeps only those attributes that all members have.
    common = set.intersection(*(set(size.attributes) for size in sizes))
    # Separate meshes keep their own attributes. As an upper bound for each: the k-th attribute has
    # the longest name and the most values of any member's k-th attribute, counted from the largest.
    sorted_attributes = (
        sorted(size.attributes, key=lambda attribute: -attribute[1]) for size in sizes
    )
    largest_attributes = tuple(
        (max((title for title, _ in column), key=len), max(d for _, d in column))
        for column in zip_longest(*sorted_attributes, fillvalue=("", 0))
    )
    written_names = distinct_members.name_bytes + sum(path_bytes) + sum(frame_bytes)
    return (
        sum_members(all_members, tuple(sorted(common))),
        sum_members(distinct_members, largest_attributes),
        replace(distinct_members, name_bytes=written_names, members=member_count),
    )
