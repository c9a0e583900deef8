"""Joins members of a group into one model where they share a curve, and separates the mesh again.

Members that have an open edge in common, after they are placed, become one model. So the steps that
join patches also join these members. A member stays unchanged if it is a sweep, or if its channels
differ from those of its neighbours, because all vertices of one mesh have the same channels.

The mesh of this model is then separated, so that each member is a node with its name and colour.
Positions on a common edge stay equal in all members. The report of the scene stays the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import IndexArray, Ints
from service.engine.connectivity.seams import Seams
from service.engine.joining.join import Allow, allow_any, join, join_each
from service.engine.joining.meeting_members import compose, find_neighbours
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.scenes.scene import Scene
from service.surface.lowered import (
    GroupModel,
    GroupNode,
    Part,
    PatchModel,
    PlacedModel,
    SingleModel,
)


@dataclass(frozen=True, slots=True)
class Cluster:
    """Members that became one model.

    `members` has their numbers in the original group. Member `members[k]` has the parts [ends[k],
    ends[k+1]) of the model. `are_uvs_swapped[k]` says whether its vertices have the parameters (v,
    u) as texture coordinates, because the member was mirrored.
    """

    members: tuple[int, ...]
    ends: tuple[int, ...]
    are_uvs_swapped: tuple[bool, ...]


@dataclass(frozen=True, eq=False, slots=True)
class JoinedGroup:
    """A group with one model for each cluster, and the original members.

    The original member `originals[k]` is in member `new_numbers[k]` of `group`, alone or, if it is
    in one of the `clusters`, together with other members.
    """

    group: GroupModel
    originals: tuple[PlacedModel, ...]
    new_numbers: tuple[int, ...]
    clusters: tuple[Cluster, ...]


def join_group(group: GroupModel, options: MeshOptions, allow: Allow = allow_any) -> JoinedGroup:
    """The group with its members joined, unless lines or wires are drawn on its members.

    A mesh without faces always has lines or wires.
    """
    if options.has_wires or options.overlays:
        joined = join_each(group, options.weld_tolerance)
        return JoinedGroup(joined, group.members, tuple(range(len(group.members))), ())
    return join_members(group, options.weld_tolerance, allow)


def join_members(group: GroupModel, tolerance: float, allow: Allow = allow_any) -> JoinedGroup:
    """The group with its members joined where they meet along an edge.

    Parameters
    ----------
    tolerance : float
        `MeshOptions.weld_tolerance`; with 0 no member is joined.
    allow : callable
        Called with each model that was cut or joined; it raises an error if the model is too large.
    """
    models: list[SingleModel] = []
    seams_of: dict[int, Seams] = {}
    for number, original in enumerate(group.models):
        model = original
        if isinstance(original, PatchModel):
            model, seams = join(original, tolerance, allow)
            seams_of[number] = seams
        models.append(model)
    group = replace(group, models=tuple(models))
    unjoined = JoinedGroup(group, group.members, tuple(range(len(group.members))), ())
    if not tolerance:
        return unjoined
    clusters: list[Cluster] = []
    members: list[PlacedModel] = []
    new_numbers = [-1] * len(group.members)
    for numbers in find_neighbours(group, seams_of, tolerance):
        joined_model, are_mirrored = compose(group, numbers)
        joined_model, seams = join(joined_model, tolerance, allow)
        member_of_patch = _find_owners(joined_model, group, numbers)
        # The lowest and the highest member at each edge. An edge joins two members if it has two
        # sides, one of each. Edges with more sides do not count: copies may lie on each other.
        low, high = np.full(seams.edge_count, len(numbers)), np.full(seams.edge_count, -1)
        is_line = ~seams.collapsed
        np.minimum.at(
            low,
            seams.edge[is_line],
            np.broadcast_to(member_of_patch[:, None], is_line.shape)[is_line],
        )
        np.maximum.at(
            high,
            seams.edge[is_line],
            np.broadcast_to(member_of_patch[:, None], is_line.shape)[is_line],
        )
        if not ((low < high) & (seams.sides_per_edge == 2)).any():
            continue
        allow(joined_model)
        parts = [len(_parts_of(group, n)) for n in numbers]
        has_uvs = any(channel.kind == "uvs" for channel in joined_model.batches[0].channels)
        are_uvs_swapped = tuple(is_mirrored and not has_uvs for is_mirrored in are_mirrored)
        clusters.append(
            Cluster(tuple(numbers), tuple(np.cumsum([0, *parts]).tolist()), are_uvs_swapped)
        )
        for n in numbers:
            new_numbers[n] = len(members)
        members.append(PlacedModel(joined_model.name, len(models)))
        models.append(joined_model)
    if not clusters:
        return unjoined
    for n, member in enumerate(group.members):
        if new_numbers[n] < 0:
            new_numbers[n] = len(members)
            members.append(member)
    used_models = sorted({member.model for member in members})
    # Each joined model alone was allowed above; now all of them together.
    allow(*(model for model in models[len(group.models) :] if isinstance(model, PatchModel)))
    new_model_numbers = {
        old_number: new_number for new_number, old_number in enumerate(used_models)
    }
    return JoinedGroup(
        replace(
            group,
            models=tuple(models[old_number] for old_number in used_models),
            members=tuple(replace(m, model=new_model_numbers[m.model]) for m in members),
        ),
        group.members,
        tuple(new_numbers),
        tuple(clusters),
    )


def _parts_of(group: GroupModel, number: int) -> tuple[Part, ...]:
    """The parts of a member that is not a sweep."""
    model = group.models[group.members[number].model]
    assert isinstance(model, PatchModel)
    return model.parts


def _find_owners(joined_model: PatchModel, group: GroupModel, numbers: Sequence[int]) -> Ints:
    """For each patch of the joined model, the position of its member in `numbers`."""
    sequence = (
        np.arange(joined_model.patch_count)
        if joined_model.sequence is None
        else joined_model.sequence
    )
    parts = np.repeat(np.arange(len(numbers)), [len(_parts_of(group, n)) for n in numbers])
    member_of_patch = np.empty(joined_model.patch_count, dtype=np.intp)
    member_of_patch[sequence] = np.repeat(
        parts, [part.last - part.first for part in joined_model.parts]
    )
    return member_of_patch


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
    # The meshes of joined members are in the coordinates of the scene: their nodes are below the
    # root, so that no product of placements moves their common edges apart.
    tree = [replace(node, copy=None) if node.copy in new_nodes else node for node in scene.tree] + [
        GroupNode(new_nodes[k].name, copy=k) for k in sorted(new_nodes) if scene.tree
    ]
    used_meshes = sorted({node.model for node in nodes})
    new_mesh_numbers = {old: new for new, old in enumerate(used_meshes)}
    return replace(
        scene,
        joined=tuple(cluster.members for cluster in joined.clusters) if is_welded else (),
        tree=tuple(tree),
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
        places=None if mesh.places is None else mesh.places.take(rows),
        overlays=(),  # members with overlays are not joined
    )


def _take_welds(welds: IndexArray | None, rows: Ints) -> IndexArray | None:
    """The first of the vertices `rows` at each position, numbered within `rows`."""
    if welds is None:
        return None
    _, first, inverse = np.unique(welds[rows], return_index=True, return_inverse=True)
    leader = first[inverse.reshape(-1)].astype(np.uint32)
    return None if (leader == np.arange(len(leader))).all() else leader
