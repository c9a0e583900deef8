"""The faces of all patches, and the border of a mesh: edges that only one face uses.

Faces are index patterns in which samples are replaced by vertices.
"""

import numpy as np

from service.bases.arrays import AnyInts, IndexArray, Ints
from service.bases.row_batches import split_runs
from service.engine.options import Faces, MeshOptions
from service.engine.plans.layout import Layout
from service.engine.plans.patterns import build_faces
from service.engine.plans.vertices import Welding


def join_faces(
    layout: Layout, welding: Welding | None, kind: Faces, sequence: Ints | None
) -> tuple[IndexArray, IndexArray, Ints]:
    """Triangles (T, 3) and quads (Q, 4) of all patches, in the order `sequence`.

    Without a welding, sample k is vertex k. The third result, (2, P + 1), counts the triangles and
    the quads before each patch; the last column has the totals.
    """
    groups = layout.shapes
    patterns = [build_faces(shape, kind) for shape, _ in groups]
    total = len(layout.base)
    counts = np.zeros((2, total), dtype=np.intp)
    for (_, patches), pattern in zip(groups, patterns, strict=True):
        counts[0, patches], counts[1, patches] = len(pattern[0]), len(pattern[1])
    if welding is None and total == 1:
        return (*patterns[0], _count_before(counts))
    # The position of each patch in the mesh. From here on, `counts` is in the order of the mesh.
    position = np.arange(total)
    if sequence is not None:
        position[sequence] = position.copy()
        counts = counts[:, sequence]
    faces: list[IndexArray] = []
    for kind_of_face, corners in enumerate((3, 4)):
        ends = counts[kind_of_face].cumsum()
        out = np.empty((ends[-1], corners), dtype=np.uint32)
        for (shape, patches), pattern in zip(groups, patterns, strict=True):
            pattern_faces = pattern[kind_of_face]
            if not len(pattern_faces):
                continue
            for some_patches in layout.split_patches(patches, shape):
                vertices = layout.patch_samples(some_patches, shape)
                if welding is not None:
                    vertices = welding.vertex[vertices].astype(np.uint32, copy=False)
                corner_numbers = vertices.take(pattern_faces, axis=1)
                # The faces of patches that follow each other in the mesh are written together.
                for run in split_runs(np.diff(position[some_patches]) != 1):
                    first = ends[position[some_patches[run.start]]] - len(pattern_faces)
                    rows = slice(first, first + (run.stop - run.start) * len(pattern_faces))
                    out[rows] = corner_numbers[run].reshape(-1, corners)
        faces.append(out)
    triangles, quads = faces
    # A patch folds if two of its sides are one edge, and may fold if it has only one division. Then
    # faces may have two vertices at one position.
    if welding is not None and layout.may_fold:
        triangles, quads, counts = drop_slivers(triangles, quads, counts, welding.welds)
    return triangles, quads, _count_before(counts)


def _count_before(counts: Ints) -> Ints:
    """The number of faces before each patch, and the totals, (2, P + 1), from counts (2, P)."""
    return np.concatenate([np.zeros((2, 1), dtype=np.intp), counts.cumsum(axis=1)], axis=1)


def drop_slivers(
    triangles: IndexArray, quads: IndexArray, counts: Ints, welds: AnyInts
) -> tuple[IndexArray, IndexArray, Ints]:
    """Drops faces with two vertices at one position.

    But a quad becomes a triangle if one pair of neighbouring vertices is at one position.

    Patterns already handle sides that are one point. But if two sides that meet are one edge, the
    diagonal of the cell between them is a point, too. With one division, a side that returns to its
    beginning is a point, and a patch that closes is a line.

    `counts` (2, P) are the numbers of triangles and quads of each patch, `welds` (V,) is one vertex
    at the position of each vertex. Returns the new triangles, quads and counts.
    """
    total = counts.shape[1]
    patch_of_triangle, patch_of_quad = (np.repeat(np.arange(total), n) for n in counts)
    first_vertices = welds[quads]
    is_repeated = first_vertices == np.roll(first_vertices, -1, axis=1)
    is_quad = (
        ~is_repeated.any(axis=1)
        & (first_vertices[:, 0] != first_vertices[:, 2])
        & (first_vertices[:, 1] != first_vertices[:, 3])
    )
    quads_to_halve = np.flatnonzero(is_repeated.sum(axis=1) == 1)
    # If corner k and the next corner coincide, the triangle has the corners other than k.
    other_corners = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])
    triangles_of_quads = np.take_along_axis(
        quads[quads_to_halve], other_corners[is_repeated[quads_to_halve].argmax(axis=1)], axis=1
    )
    triangles = np.concatenate([triangles, triangles_of_quads])
    patch_of_triangle = np.concatenate([patch_of_triangle, patch_of_quad[quads_to_halve]])
    first_vertices = welds[triangles]
    is_proper = (first_vertices != np.roll(first_vertices, -1, axis=1)).all(axis=1)
    order = np.flatnonzero(is_proper)[np.argsort(patch_of_triangle[is_proper], kind="stable")]
    new_counts = np.stack(
        [
            np.bincount(patch_of_triangle[order], minlength=total),
            np.bincount(patch_of_quad[is_quad], minlength=total),
        ]
    )
    return triangles[order], quads[is_quad], new_counts


def find_mesh_borders(
    layout: Layout,
    options: MeshOptions,
    mesh_faces: tuple[IndexArray, IndexArray],
    welds: IndexArray | None,
) -> tuple[int, bool]:
    """The number of edges that only one face uses, and whether exactly two faces use each edge.

    Usually that number is the sum of the divisions of open edges. All edges of faces are counted
    only if this sum may be wrong: faces of different patches may share an edge that is not on an
    edge of the patches, or two faces on an edge of a patch may not share it. The parameters
    `mesh_faces` and `welds` are those of `count_borders`.
    """
    connectivity = layout.connectivity
    divisions, is_line = layout.divisions, connectivity.is_line
    # With one division, two edges of patches between the same corners are one line of the mesh, and
    # a patch between two poles vanishes.
    is_coarse = divisions[is_line].min(initial=2) < 2
    # With two divisions, both halves of an edge that returns to its beginning are one line.
    begin, end = connectivity.ends
    is_coarse |= divisions[is_line & (begin == end)].min(initial=3) < 3
    if options.weld:
        must_count = is_coarse or connectivity.is_folded or _share_cut_corner(layout)
    else:
        # Each face at a pole has a different vertex there, so neighbours share no edge there.
        must_count = is_coarse or layout.has_poles
    if must_count:
        return count_borders(mesh_faces, welds)
    if not options.weld:
        # Patches share no vertex, so every side that is a line is a border.
        sides = connectivity.sides_per_edge[is_line]
        return int((divisions[is_line] * sides).sum()), not is_line.any()
    boundary_edges = int(divisions[connectivity.open_lines].sum())
    has_at_most_two = bool((connectivity.sides_per_edge[is_line] <= 2).all())
    return boundary_edges, boundary_edges == 0 and has_at_most_two


def _share_cut_corner(layout: Layout) -> bool:
    """Whether two patches share both sides of a corner that a line of the mesh cuts off.

    The meshes of both patches then contain this line. It joins the samples of both sides next to
    the corner. With two divisions, the middle of a side is next to both of its ends: so only the
    sides are compared, and not at which of their ends the corner is.
    """
    # `cut_corners` has 2 · edge, or 2 · edge + 1, for each side of a corner; the shift leaves the
    # edge.
    edges = layout.connectivity.cut_corners >> 1
    codes = (edges[..., 0] * len(layout.divisions) + edges[..., 1])[edges[..., 0] >= 0]
    return len(np.unique(codes)) < len(codes)


def count_borders(
    mesh_faces: tuple[IndexArray, IndexArray], welds: IndexArray | None
) -> tuple[int, bool]:
    """Counts the edges that only one face uses; also returns whether exactly two use each edge.

    `mesh_faces` are triangles (T, 3) and quads (Q, 4). `welds` has for each vertex the first vertex
    at its position; None if all positions differ.
    """
    # One number for each line: its lower vertex times 2^32, plus its higher vertex.
    lines = np.empty(sum(rows.size for rows in mesh_faces), dtype=np.int64)
    count = 0
    for rows in mesh_faces:
        for corner in range(rows.shape[1]):
            begin, end = rows[:, corner - 1], rows[:, corner]
            if welds is not None:
                begin, end = welds[begin], welds[end]
            line = lines[count : count + len(rows)]
            np.minimum(begin, end, out=line)
            line <<= 32
            line |= np.maximum(begin, end)
            count += len(rows)
    lines.sort()
    # Equal lines are now consecutive. `is_first` marks the first of them, and the end of the array.
    is_first = np.ones(count + 1, dtype=bool)
    is_first[1:-1] = lines[1:] != lines[:-1]
    boundary_edges = int((is_first[:-1] & is_first[1:]).sum())
    # Two faces use each edge if the first lines of runs are exactly those at even positions.
    return boundary_edges, bool(is_first[::2].all() and not is_first[1::2].any())
