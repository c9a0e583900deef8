"""Separates the meshes of joined members: a node for each member, with its name and colour.

Members of a group that share a curve were joined into one model (`service.engine.joining.members`).
Positions on a common edge stay equal in all members. The report of the scene stays the same.
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import IndexArray, Ints
from service.engine.joining.members import Cluster, JoinedGroup
from service.engine.mesh.mesh import Mesh
from service.engine.scenes.scene import Scene
from service.surface.lowered import PlacedModel


def separate_members(scene: Scene, joined: JoinedGroup, *, is_welded: bool) -> Scene:
    """The scene of the original members, from the scene of joined members.

    `is_welded` says whether patches share the vertices of their edges.
    """
    if not joined.clusters:
        return scene
    meshes = list(scene.meshes)
    new_nodes: dict[int, PlacedModel] = {}
    for cluster in joined.clusters:
        mesh = scene.meshes[scene.nodes[joined.new_numbers[cluster.members[0]]].model]
        for k, number in enumerate(cluster.members):
            placed = joined.originals[number]
            # Without a matrix: the mesh of joined members is in the coordinates of the scene.
            new_nodes[number] = PlacedModel(placed.name, len(meshes), placed.color)
            meshes.append(_take_member(mesh, cluster, k, placed.name))
    nodes = [new_nodes.get(k) or scene.nodes[number] for k, number in enumerate(joined.new_numbers)]
    used_meshes = sorted({node.model for node in nodes})
    new_mesh_numbers = {old: new for new, old in enumerate(used_meshes)}
    return replace(
        scene,
        joined=tuple(cluster.members for cluster in joined.clusters) if is_welded else (),
        nodes=tuple(replace(node, model=new_mesh_numbers[node.model]) for node in nodes),
        meshes=tuple(meshes[number] for number in used_meshes),
    )


def _take_member(mesh: Mesh, cluster: Cluster, k: int, name: str) -> Mesh:
    """The mesh of member k of a cluster, taken from the mesh of the cluster."""
    parts = mesh.parts[cluster.ends[k] : cluster.ends[k + 1]]
    triangles = mesh.triangles[parts[0].triangles[0] : parts[-1].triangles[1]]
    quads = mesh.quads[parts[0].quads[0] : parts[-1].quads[1]]
    rows = np.unique(np.concatenate([triangles.ravel(), quads.ravel()])).astype(np.intp)
    number = np.zeros(len(mesh.positions), dtype=np.uint32)
    number[rows] = np.arange(len(rows))
    uvs = None if mesh.uvs is None else mesh.uvs[rows]
    if uvs is not None and cluster.are_uvs_swapped[k]:
        uvs = uvs[:, ::-1]
    prefix = f"{name}/" if len(parts) > 1 else ""
    start = parts[0].triangles[0], parts[0].quads[0]
    return replace(
        mesh,
        name=name,
        positions=mesh.positions[rows],
        normals=None if mesh.normals is None else mesh.normals[rows],
        uvs=uvs,
        colors=None if mesh.colors is None else mesh.colors[rows],
        attributes=tuple((title, values[rows]) for title, values in mesh.attributes),
        triangles=number[triangles],
        quads=number[quads],
        parts=tuple(
            replace(
                part,
                name=part.name.removeprefix(prefix),
                triangles=(part.triangles[0] - start[0], part.triangles[1] - start[0]),
                quads=(part.quads[0] - start[1], part.quads[1] - start[1]),
            )
            for part in parts
        ),
        grids=(),
        welds=_take_welds(mesh.welds, rows),
        overlays=(),  # members with overlays are not joined
    )


def _take_welds(welds: IndexArray | None, rows: Ints) -> IndexArray | None:
    """The first of the vertices `rows` at each position, numbered within `rows`."""
    if welds is None:
        return None
    _, first, inverse = np.unique(welds[rows], return_index=True, return_inverse=True)
    leader = first[inverse.reshape(-1)].astype(np.uint32)
    return None if (leader == np.arange(len(leader))).all() else leader
