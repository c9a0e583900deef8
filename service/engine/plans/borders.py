"""The border of a mesh: edges that only one face uses."""

import numpy as np

from service.bases.arrays import IndexArray
from service.engine.options import MeshOptions
from service.engine.plans.layout import Layout
from service.surface.sides import BEGINS, ENDS


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
    is_line = ~connectivity.collapsed
    # With one division, two edges of patches between the same corners are one line of the mesh, and
    # a patch between two poles vanishes.
    is_coarse = layout.divisions[connectivity.edge[is_line]].min(initial=2) < 2
    # With two divisions, both halves of a side that returns to its beginning are one line.
    is_loop = is_line & (connectivity.corner[:, BEGINS] == connectivity.corner[:, ENDS])
    is_coarse |= layout.divisions[connectivity.edge[is_loop]].min(initial=3) < 3
    if options.weld:
        must_count = is_coarse or connectivity.is_folded or _share_cut_corner(layout)
    else:
        # Each face at a pole has a different vertex there, so neighbours share no edge there.
        must_count = is_coarse or layout.has_poles
    if must_count:
        return count_borders(mesh_faces, welds)
    if not options.weld:
        # Patches share no vertex, so every side that is a line is a border.
        return int(layout.divisions[connectivity.edge[is_line]].sum()), not is_line.any()
    uses = np.bincount(connectivity.edge[is_line], minlength=len(layout.divisions))
    boundary_edges = int(layout.divisions[uses == 1].sum())
    return boundary_edges, boundary_edges == 0 and bool((uses <= 2).all())


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
