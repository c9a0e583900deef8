"""Closest points of whole parts: of faces within their trims, of edges, and of whole patches.

Proof in docs/proofs.md: "Closest points of a part".
"""

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.brep.edge_tree import EdgeTree
from service.engine.closest.nearest import ClosestPoints
from service.engine.closest.open_sides import find_open_sides
from service.engine.closest.project import ProjectQuery, find_closest
from service.engine.nets.partials import net_partials
from service.engine.parts.columns import PartColumns
from service.engine.parts.part import Part
from service.engine.parts.signs import compute_part_signs
from service.engine.points.surface_columns import Columns


def project_on_part(part: Part, query: ProjectQuery) -> Columns:
    """Find the closest points of a part.

    Returns
    -------
    dict of ndarray
        - positions (m, 3); distances (m,); distance_bounds (m, 2), which contain the least distance
          to the part, with its edges and with the borders of its faces on their surfaces
        - reached, tied (m,): as for a surface
        - patch (m,): the number of the face or patch in the request; on an edge, of its faces that
          with the lowest number
        - uv (m, 2): parameters of the surface of the face, or of the patch
        - normals (m, 3): those of faces, out of the material
        - near_edge (m,): whether the point is on an edge, or nearer to one than its gap
        - signs (m,), if requested: −1 inside, +1 outside, NaN where this is uncertain
        - on_boundary (m,): whether it is on an edge, or near one, that no other face has; or on an
          open side of a patch
    """
    nets = part.nets
    local_points = nets.to_near_points(query.points)
    closest, columns = find_closest(nets, local_points, query, part.trims)
    is_edge = closest.net >= part.surface_nets
    described = PartColumns(part)
    on_faces, on_edges = np.flatnonzero(~is_edge), np.flatnonzero(is_edge)
    net, parameters = closest.net[on_faces], closest.parameters[:, on_faces]
    _, du, dv = net_partials(nets, net, parameters, 1)
    of_faces = described.describe(net, parameters, du, dv)
    edge = closest.net[on_edges] - part.surface_nets
    of_edges = described.describe_edges(edge, closest.parameters[0, on_edges])
    for name, values in of_faces.items():
        joined = np.empty((len(closest.net), *values.shape[1:]), values.dtype)
        joined[on_faces], joined[on_edges] = values, of_edges[name]
        columns[name] = joined
    near, is_open = find_near_edges(part, closest, on_faces)
    near[on_edges], is_open[on_edges] = True, part.edges.is_open[edge]
    near |= ~closest.is_certain
    is_open |= _find_open_patches(part, closest)
    if query.sign:
        columns["signs"] = compute_part_signs(part, local_points.points, closest.low)
    return columns | {"near_edge": near, "on_boundary": is_open}


def find_near_edges(part: Part, closest: ClosestPoints, rows: Ints) -> tuple[Bools, Bools]:
    """Which points `rows` on faces are nearer to edges than their gaps, (m,).

    The second result is which of them are so near to an edge that no other face has.
    """
    near, is_open = np.zeros((2, len(closest.net)), bool)
    copy = part.rows.copy[closest.net[rows]]
    definitions = part.members.definitions
    lists = part.members.list_copies()
    of_copy = np.array([each.definition for each in part.members.copies], np.intp)
    rows, copy = rows[copy >= 0], copy[copy >= 0]
    for number in np.unique(of_copy[copy]).tolist():
        mine = rows[of_copy[copy] == number]
        prepared, net = definitions[number], closest.net[mine]
        face = part.trims.face[net] - lists[number][0].first_face
        uv = part.trims.to_face(net, closest.parameters[:, mine])
        # Gaps are lengths before the placement.
        points = prepared.surfaces.evaluate(face, uv)
        near[mine] = EdgeTree.of_borders(prepared, len(mine)).find_near(face, points)
        found = mine[near[mine]]
        if len(found):
            uses = np.bincount(prepared.coedge_edges, minlength=len(prepared.edge_curves))
            chosen = near[mine]
            tree = EdgeTree.of_borders(prepared, len(found), uses[prepared.coedge_edges] == 1)
            is_open[found] = tree.find_near(face[chosen], points[chosen])
    return near, is_open


def _find_open_patches(part: Part, closest: ClosestPoints) -> Bools:
    """Which points (m,) are on open sides of patches without trims."""
    is_open = np.zeros(len(closest.net), bool)
    patches = part.members.patches
    rows = np.flatnonzero(part.rows.copy[closest.net] < 0)
    if patches is not None and len(rows):
        net = closest.net[rows]
        local = part.nets.parameters(net, closest.parameters[:, rows].T)
        is_open[rows] = find_open_sides(patches, part.rows.span[net], local)
    return is_open
