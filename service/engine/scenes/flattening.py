"""A scene as one mesh: all copies of one mesh are placed and written at once."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, Ints, RealArray
from service.bases.row_batches import unique_rows
from service.cancellation import checkpoint
from service.engine.extent import AT_ZERO
from service.engine.mesh.mesh import Mesh, MeshPart, Overlay
from service.engine.scenes.colors import tint
from service.engine.scenes.copies import (
    Placements,
    batch_copies,
    list_copies,
    place_copies_of_normals,
    place_copies_of_points,
    stack_placements,
)
from service.engine.scenes.painting import paint_parts
from service.engine.scenes.placing import place_points, reverse_faces
from service.engine.scenes.reports import find_spreads
from service.engine.scenes.scene import Scene, place_parts
from service.surface.lowered import Color, PlacedModel


@dataclass(frozen=True, eq=False, slots=True)
class _Copies:
    """The copies of a scene, and where each of them begins in the flat mesh.

    Attributes
    ----------
    bases : list of Mesh
        Meshes in float64 about 0; a mesh that copies show in several colours is there for each.
    copies : tuple of PlacedModel
        `model` is the number of the base.
    numbers : list of ndarray of int
        The numbers of the copies of each base.
    placements : Placements
    vertices, triangles, quads : ndarray of int, shape (N + 1,)
        The first row of each copy; at last, the number of all rows.
    """

    bases: list[Mesh]
    copies: tuple[PlacedModel, ...]
    numbers: list[Ints]
    placements: Placements
    vertices: Ints
    triangles: Ints
    quads: Ints


def flatten(scene: Scene) -> Mesh:
    """All copies as one mesh, float64, in the coordinates of the scene.

    A part has the name of its member. If the surface of the member has several parts, the name is
    "member/part". Points are L x + t, and normals the unit vectors of L⁻ᵀ n. If L mirrors, faces
    are reversed, so that they stay counter-clockwise about their normals, and grids are transposed.

    The meshes have the same vertical axis and attributes, and all or none have normals. If only
    some have colours or texture coordinates, the vertices of the others become white or get (0, 0).
    """
    all_copies = _paint_bases(scene)
    bases, copies = all_copies.bases, all_copies.copies
    first = bases[copies[0].model]
    titles = [title for title, _ in first.attributes]
    welds = _join_welds(all_copies)
    positions = _place_rows(all_copies, lambda mesh: mesh.positions, place_copies_of_points)
    assert positions is not None  # every mesh has positions
    if scene.joined:
        welds = _weld_joined(positions, welds, all_copies, scene.joined)
    return replace(
        first,
        name=scene.name,
        positions=positions,
        normals=_place_rows(all_copies, lambda mesh: mesh.normals, place_copies_of_normals),
        uvs=_repeat_rows(all_copies, lambda mesh: mesh.uvs, 0.0),
        colors=_repeat_rows(all_copies, lambda mesh: mesh.colors, 1.0),
        attributes=tuple((title, _repeat_attribute(all_copies, title)) for title in titles),
        triangles=_repeat_faces(
            all_copies, [mesh.triangles for mesh in bases], all_copies.triangles
        ),
        quads=_repeat_faces(all_copies, [mesh.quads for mesh in bases], all_copies.quads),
        parts=_list_parts(scene, all_copies),
        grids=_list_grids(all_copies),
        welds=welds,
        overlays=_list_overlays(all_copies),
        origin=np.zeros(3),
        step=0.0,  # placed positions are not on a grid
        up=scene.up,
        report=scene.report,
    )


def _paint_bases(scene: Scene) -> _Copies:
    """The copies with their meshes in the colours of the copies, about 0 and not placed."""
    number_of: dict[tuple[int, Color | None], int] = {}
    bases: list[Mesh] = []
    copies = []
    for node in scene.nodes:
        key = node.model, node.color
        number = number_of.setdefault(key, len(bases))
        if number == len(bases):
            checkpoint()
            bases.append(_paint(scene.meshes[node.model], node.color))
        copies.append(replace(node, model=number))
    numbers = np.array([copy.model for copy in copies])

    def count(rows: Sequence[RealArray | IndexArray]) -> Ints:
        """Where each copy begins, from the rows of each base."""
        lengths = np.array([len(each) for each in rows])[numbers]
        return np.concatenate([[0], np.cumsum(lengths)])

    return _Copies(
        bases,
        tuple(copies),
        list_copies(copies, len(bases)),
        stack_placements(copies),
        count([mesh.positions for mesh in bases]),
        count([mesh.triangles for mesh in bases]),
        count([mesh.quads for mesh in bases]),
    )


def _paint(mesh: Mesh, color: Color | None) -> Mesh:
    """A mesh about 0, whose vertices have the colour of a copy."""
    base = replace(
        mesh,
        positions=place_points(mesh.positions, None, mesh.origin),
        normals=None if mesh.normals is None else mesh.normals.astype(np.float64),
        origin=np.zeros(3),
    )
    if mesh.report.brep is not None:
        parts = tuple(replace(part, color=part.color or color) for part in mesh.parts)
        return paint_parts(replace(base, parts=parts))
    if color is None:
        return base
    return replace(base, colors=tint(base.colors, np.array(color), len(base.positions)))


def _place_rows(
    flat: _Copies,
    take: Callable[[Mesh], RealArray | None],
    place: Callable[[RealArray, FloatArray], FloatArray],
) -> FloatArray | None:
    """Points or normals of all copies; 0 where a mesh has none, None if no mesh has any."""
    values = [take(mesh) for mesh in flat.bases]
    if all(each is None for each in values):
        return None
    rows = np.zeros((int(flat.vertices[-1]), 3))
    for each, copies in zip(values, flat.numbers, strict=True):
        if each is None or not len(each):
            continue
        is_moved = flat.placements.is_moved[copies]
        for number in copies[~is_moved].tolist():
            first = flat.vertices[number]
            rows[first : first + len(each)] = each
        moved = copies[is_moved]
        for batch in batch_copies(len(moved), len(each)):
            numbers = moved[batch]
            placed = place(each, flat.placements.matrices[numbers])
            _write(rows, placed, flat.vertices[numbers])
    return rows


def _repeat_rows(
    flat: _Copies, take: Callable[[Mesh], RealArray | None], value: float
) -> RealArray | None:
    """Rows of all copies, as wide as the widest; None if no mesh has any.

    Missing rows and columns are filled with `value`.
    """
    values = [take(mesh) for mesh in flat.bases]
    present = [values[copy.model] for copy in flat.copies[:1]]
    present += [each for each in values if each is not None]
    arrays = [each for each in present if each is not None]
    if not arrays:
        return None
    width = max(each.shape[1] for each in arrays)
    rows = np.full((int(flat.vertices[-1]), width), value, dtype=arrays[0].dtype)
    for each, copies in zip(values, flat.numbers, strict=True):
        if each is not None and len(each):
            for batch in batch_copies(len(copies), len(each)):
                _write(rows[:, : each.shape[1]], each[np.newaxis], flat.vertices[copies[batch]])
    return rows


def _repeat_attribute(flat: _Copies, title: str) -> RealArray:
    """The rows of an attribute, which all meshes have."""
    rows = _repeat_rows(flat, lambda mesh: dict(mesh.attributes)[title], 0.0)
    assert rows is not None  # each mesh has the attributes of the first
    return rows


def _repeat_faces(flat: _Copies, faces: Sequence[IndexArray], starts: Ints) -> IndexArray:
    """Faces of all copies, with the vertex numbers of the flat mesh; reversed in mirror images."""
    rows = np.empty((int(starts[-1]), faces[0].shape[1]), np.uint32)
    for each, copies in zip(faces, flat.numbers, strict=True):
        if not len(each):
            continue
        is_mirrored = flat.placements.is_mirrored[copies]
        for turned, chosen in ((False, copies[~is_mirrored]), (True, copies[is_mirrored])):
            if not len(chosen):
                continue
            corners = reverse_faces(each) if turned else each
            for batch in batch_copies(len(chosen), len(each)):
                numbers = chosen[batch]
                first = flat.vertices[numbers].astype(np.uint32)
                _write(rows, corners + first[:, np.newaxis, np.newaxis], starts[numbers])
    return rows


def _write(rows: RealArray | IndexArray, block: RealArray | IndexArray, starts: Ints) -> None:
    """Write blocks (n, K, d), or one block for all, to the rows that begin at `starts`, (n,)."""
    if len(starts) == 1:
        rows[starts[0] : starts[0] + block.shape[1]] = block[0]
    else:
        rows[starts[:, np.newaxis] + np.arange(block.shape[1])] = block


def _list_parts(scene: Scene, flat: _Copies) -> tuple[MeshPart, ...]:
    """The parts of all copies, with the face numbers of the flat mesh."""
    stretches, errors = find_spreads(scene.meshes, scene.nodes, flat.placements)
    parts: list[MeshPart] = []
    rows = zip(
        scene.nodes,
        stretches.tolist(),
        errors.tolist(),
        flat.triangles.tolist(),
        flat.quads.tolist(),
        strict=False,  # the last two have one number more
    )
    for node, stretch, error, triangles, quads in rows:
        parts += place_parts(scene.meshes[node.model], node, (stretch, error), (triangles, quads))
    return tuple(parts)


def _list_grids(flat: _Copies) -> tuple[IndexArray, ...]:
    """The grids of all copies; none unless all meshes have grids."""
    if not all(mesh.grids for mesh in flat.bases):
        return ()
    grids: list[IndexArray] = []
    for number, copy in enumerate(flat.copies):
        start = flat.vertices[number].astype(np.uint32)
        is_mirrored = flat.placements.is_mirrored[number]
        grids += (
            (grid.swapaxes(1, 2) if is_mirrored else grid) + start
            for grid in flat.bases[copy.model].grids
        )
    return tuple(grids)


def _list_overlays(flat: _Copies) -> tuple[Overlay, ...]:
    """The overlays of all copies, placed, under the names of the copies."""
    return tuple(
        replace(
            overlay,
            name=f"{copy.name}/{overlay.name}",
            positions=place_points(overlay.positions, copy.matrix, AT_ZERO),
        )
        for copy in flat.copies
        for overlay in flat.bases[copy.model].overlays
    )


def _join_welds(flat: _Copies) -> IndexArray | None:
    """For each vertex, the first vertex of its copy at its position; None if no mesh has any."""
    if all(mesh.welds is None for mesh in flat.bases):
        return None
    welds = np.arange(flat.vertices[-1], dtype=np.uint32)
    for mesh, copies in zip(flat.bases, flat.numbers, strict=True):
        if mesh.welds is not None:
            for batch in batch_copies(len(copies), len(mesh.welds)):
                first = flat.vertices[copies[batch]]
                block = mesh.welds + first[:, np.newaxis].astype(np.uint32)
                welds[first[:, np.newaxis] + np.arange(block.shape[1])] = block
    return welds


def _weld_joined(
    positions: FloatArray,
    welds: IndexArray | None,
    flat: _Copies,
    joined: Sequence[tuple[int, ...]],
) -> IndexArray:
    """For each vertex, the first vertex at its position; only joined copies share positions."""
    welds = np.arange(len(positions), dtype=np.uint32) if welds is None else welds
    first = flat.vertices
    for copies in joined:
        rows = np.concatenate([np.arange(first[n], first[n + 1]) for n in copies])
        # + 0.0 turns −0.0 into 0.0, because rows are compared bit by bit.
        first_at_position, position_number = unique_rows(positions[rows] + 0.0)
        welds[rows] = rows[first_at_position[position_number]]
    return welds
