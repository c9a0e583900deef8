"""Builds parts from breps, and from groups that have breps.

Proof in docs/proofs.md: "Nets of a part".
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.kept import keep
from service.cancellation import checkpoint
from service.engine.brep.prepared import PreparedBrep
from service.engine.nets.nets import Nets, group_nets
from service.engine.nets.query_nets import UNIT_CORNERS, QueryNets, frame, surface_nets
from service.engine.parts.copies import BrepCopy, Members
from service.engine.parts.edge_nets import NO_EDGE, EdgeNets, EdgeRows, build_edge_nets
from service.engine.parts.face_nets import FaceNets, restrict_faces
from service.engine.parts.part import Part
from service.engine.parts.placed_nets import Frame, NetRows, place_nets
from service.engine.trims.border_tree import BorderTree
from service.engine.trims.inside import Regions
from service.engine.trims.places import SIZE, PlaceFrames
from service.engine.trims.splines import Splines
from service.engine.trims.trimmed_nets import COVER, WHOLE, NetTrims
from service.engine.vectors import project
from service.errors import InvalidRequest, Issue
from service.surface.brep_model import BrepModel
from service.surface.content_key import content_key
from service.surface.lowered import GroupModel, PatchModel
from service.surface.placement import Box


def build_part(model: BrepModel | GroupModel) -> Part:
    """The part of a brep, or of a group that has breps; or the one kept of an equal model.

    Raises
    ------
    InvalidRequest
        A brep is invalid (`prepare`), or a member is a tube or a ribbon; pointers are relative to
        the surface. `no_faces`: all faces are skipped, or have no area.
    """
    if isinstance(model, GroupModel) and len(model.members) > MOST_MEMBERS:
        return _build_part(model)
    return keep(("part", content_key(model)), partial(_build_part, model))


def _build_part(model: BrepModel | GroupModel) -> Part:
    """The part; see `build_part`."""
    members = Members.of(model)
    definitions, patches = members.definitions, members.patches
    low, high = members.bounds
    origin, scale, diagonal = frame(low, high)
    builder = _Builder(Frame(origin, scale))
    edge_parts: list[tuple[EdgeNets, BrepCopy]] = []
    of_definition, all_speeds = members.list_copies(), list[FloatArray]()
    for number, prepared in enumerate(definitions):
        faces = list(restrict_faces(prepared))
        speeds = _find_speeds(prepared, faces)
        all_speeds.append(speeds)
        edges = build_edge_nets(prepared, speeds)
        reaches = UNDECIDED_MARGINS * prepared.regions.margins * speeds
        for copy in of_definition[number]:
            checkpoint()
            for face_nets in faces:
                builder.add_faces(face_nets, reaches, copy)
            edge_parts += [(each, copy) for each in edges]
    if patches is not None:
        builder.add_patches(patches, (low, high))
    surface_count = builder.count
    if not surface_count:
        raise _refuse_empty(members)
    for edge_nets, copy in edge_parts:
        builder.add_edges(edge_nets, copy)
    groups, rows, edge_rows = builder.finish()
    nets = QueryNets(
        groups,
        origin,
        scale,
        rows.patch,
        np.ascontiguousarray(rows.corners.T).reshape(-1, 4, 2),
        diagonal,
        rows.errors,
    )
    trims = NetTrims(
        _join_regions(definitions),
        rows.face,
        rows.low.T.copy(),
        rows.high.T.copy(),
        rows.gaps,
        rows.reaches,
    )
    return Part(nets, trims, rows, surface_count, edge_rows, members, tuple(all_speeds))


MOST_MEMBERS = 1000
"""Parts of groups with more members are not kept: keys take some 200 bytes and 10 µs a member."""

UNDECIDED_MARGINS = 40.0
"""A place that is undecided is no further than this number of margins from the region."""


def _refuse_empty(members: Members) -> InvalidRequest:
    """The error for a part without any face."""
    message = "No face of the surface takes part: all are invalid, or have no area."
    reasons = sorted({each.issue.code for each in members.list_skipped()})
    got = f"no face; what is wrong: {', '.join(reasons)}" if reasons else "no face with an area"
    return InvalidRequest(Issue("no_faces", message, "", got, "a valid face"))


class _Builder:
    """Collects nets, group by group, with their faces and edges."""

    def __init__(self, frame: Frame) -> None:
        self._frame = frame
        self._parts: list[tuple[Ints, FloatArray]] = []
        self._rows: dict[tuple[int, ...], list[NetRows]] = {}
        self._edges: dict[tuple[int, ...], list[EdgeRows]] = {}
        self.count = 0

    def add_faces(self, nets: FaceNets, reaches: FloatArray, copy: BrepCopy) -> None:
        """Add the nets of faces of a copy of a brep."""
        values, errors = self._place(nets, copy)
        spans = nets.spans
        (a, c), (b, d) = spans.begin, spans.end
        corners = np.stack([a, c, b, c, a, d, b, d])
        rows = NetRows(
            copy.first_patch + spans.face,
            np.full(len(errors), copy.number),
            copy.first_face + spans.face,
            spans.patch,
            spans.low,
            spans.high,
            corners,
            errors,
            np.zeros(len(errors)),
            reaches[spans.face] * self._find_stretch(copy),
        )
        self._add(values, rows)

    def add_patches(self, patches: PatchModel, box: Box) -> None:
        """Add the nets of patches without trims."""
        nets = surface_nets(patches.batches, box)
        numbers = patches.request_numbers
        assert numbers is not None  # `build_part` numbers the patches
        for group in nets.groups:
            chosen = slice(group.first, group.first + len(group.patches))
            size = len(group.patches)
            none, zero = np.full(size, -1), np.zeros((2, size))
            corners = nets.corners[chosen].reshape(-1, 8).T
            rows = NetRows(
                numbers[group.patches],
                none,
                none,
                group.patches,
                zero,
                zero + 1.0,
                corners,
                *np.zeros((3, size)),
            )
            self._add(group.values, rows)

    def add_edges(self, nets: EdgeNets, copy: BrepCopy) -> None:
        """Add the nets of edges of a copy of a brep."""
        values, errors = self._place(nets, copy)
        edges = nets.rows
        size = len(errors)
        is_edge = edges.edge != NO_EDGE
        gaps = edges.gaps * self._find_stretch(copy)
        none, zero = np.full(size, -1), np.zeros((2, size))
        rows = NetRows(
            copy.first_patch + edges.face,
            np.full(size, copy.number),
            np.where(is_edge, WHOLE, COVER),
            none,
            zero,
            zero + 1.0,
            np.repeat(UNIT_CORNERS.reshape(8, 1), size, axis=1),
            errors,
            gaps,
            np.where(is_edge, 0.0, np.inf),
        )
        self._add(values, rows)
        placed = replace(
            edges,
            edge=np.where(is_edge, copy.first_edge + edges.edge, NO_EDGE),
            gaps=gaps,
            coedge=np.where(is_edge, copy.first_coedge + edges.coedge, -1),
            face=copy.first_face + edges.face,
        )
        self._edges.setdefault(values.shape[:3], []).append(placed)

    def finish(self) -> tuple[tuple[Nets, ...], NetRows, EdgeRows]:
        """All nets in groups, and their faces and edges in the same order."""
        rows = [row for rows in self._rows.values() for row in rows]
        if not rows:  # all faces are skipped
            rows = [_list_no_nets()]
        edges = [row for rows in self._edges.values() for row in rows]
        if not edges:
            none, zero = np.zeros(0, np.intp), np.zeros(0)
            edges = [EdgeRows(none, zero, zero, zero, none, none, np.zeros(0, bool))]
        return group_nets(self._parts), NetRows.join(rows), EdgeRows.join(edges)

    def _place(self, nets: FaceNets | EdgeNets, copy: BrepCopy) -> tuple[FloatArray, FloatArray]:
        """The nets of a copy of a brep in the frame of the part, and how far they may be off."""
        return place_nets(
            nets.values,
            nets.middles,
            nets.sizes,
            nets.errors,
            matrix=copy.matrix,
            frame=self._frame,
        )

    def _find_stretch(self, copy: BrepCopy) -> float:
        """The longest that a length 1 of a brep may be in the coordinates of the nets."""
        return copy.stretch / self._frame.scale * (1.0 + 2.0**-40)

    def _add(self, values: FloatArray, rows: NetRows) -> None:
        self._parts.append((rows.patch, values))
        self._rows.setdefault(values.shape[:3], []).append(rows)
        self.count += len(rows.patch)


def _list_no_nets() -> NetRows:
    """The rows of no nets."""
    none, zero, pairs = np.zeros(0, np.intp), np.zeros(0), np.zeros((2, 0))
    return NetRows(none, none, none, none, pairs, pairs, np.zeros((8, 0)), zero, zero, zero)


def _find_speeds(prepared: PreparedBrep, faces: Sequence[FaceNets]) -> FloatArray:
    """Bounds (F,) of how far points of faces move for one unit of places along both axes."""
    speeds = np.zeros(len(prepared.surfaces))
    units = SIZE / prepared.places.extent
    for nets in faces:
        points = project(nets.values, -3)
        low, high = points.min(axis=(2, 3), keepdims=True), points.max(axis=(2, 3), keepdims=True)
        weights = nets.values[:, 3:] if nets.values.shape[1] == 4 else 1.0
        values = nets.values.copy()
        values[:, :3] -= (low + (high - low) / 2) * weights
        values = np.ascontiguousarray(values.transpose(2, 3, 1, 0))
        bounds = Nets(nets.spans.face, values).partial_bounds
        sides = (nets.spans.high - nets.spans.low) * units[nets.spans.face].T
        np.maximum.at(speeds, nets.spans.face, (bounds / sides).sum(axis=0))
    return speeds


def _join_regions(definitions: Sequence[PreparedBrep]) -> Regions:
    """The regions of the faces of all breps, one brep after the other."""
    if len(definitions) == 1:
        return definitions[0].regions
    frames = PlaceFrames(
        np.concatenate([each.places.origin for each in definitions]),
        np.concatenate([each.places.extent for each in definitions]),
    )
    counts = np.cumsum([0, *(len(each.surfaces) for each in definitions)])
    loop_faces = np.concatenate(
        [each.loop_faces + k for each, k in zip(definitions, counts, strict=False)]
    )
    tree = BorderTree.of(
        Splines.join([each.pcurves for each in definitions]),
        np.concatenate([each.coedge_reversed for each in definitions]),
        np.concatenate([each.loop_counts for each in definitions]),
        loop_faces,
        int(counts[-1]),
    )
    return Regions.of(
        frames,
        tree,
        loop_faces=loop_faces,
        is_border=np.concatenate([each.is_border for each in definitions]),
        periods=np.concatenate([each.regions.periods for each in definitions]),
    )
