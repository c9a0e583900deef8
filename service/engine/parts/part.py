"""A whole part, ready for questions: a brep, or a group with breps.

Proof in docs/proofs.md: "Nets of a part".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.prepared import PreparedBrep
from service.engine.nets.nets import Nets, group_nets
from service.engine.nets.query_nets import UNIT_CORNERS, QueryNets, frame, surface_nets
from service.engine.parts.copies import BrepCopy, Members
from service.engine.parts.edge_nets import NO_EDGE, EdgeNets, EdgeRows, build_edge_nets
from service.engine.parts.face_nets import FaceNets, restrict_faces
from service.engine.parts.placed_nets import Frame, NetRows, place_nets
from service.engine.scenes.placing import scalings
from service.engine.trims.border_tree import BorderTree
from service.engine.trims.inside import Regions
from service.engine.trims.places import SIZE, PlaceFrames
from service.engine.trims.splines import Splines
from service.engine.trims.trimmed_nets import NetTrims
from service.surface.brep_model import BrepModel, SkippedFace
from service.surface.lowered import GroupModel, PatchModel
from service.surface.placement import Box, is_mirroring, join_boxes, place_box


@dataclass(frozen=True, eq=False)
class Part:
    """A part: the trimmed regions of all faces on their surfaces, its edges, and whole patches.

    Attributes
    ----------
    nets : QueryNets
        First the nets of faces and of patches without trims, then those of edges, of degree (n, 0).
        `patch` has numbers of the request, `corners` parameters of the patches `rows.span`.
    trims : NetTrims
    rows : NetRows
        The faces and patches of the nets.
    surface_nets : int
        How many nets come before those of edges.
    edges : EdgeRows
        The edges of nets: row k is that of net `surface_nets` + k. Edges, coedges and faces
        are counted over all breps, each brep once, whatever its copies; gaps are in the
        coordinates of the nets, and errors of the nets are not in them.
    members : Members
    """

    nets: QueryNets
    trims: NetTrims
    rows: NetRows
    surface_nets: int
    edges: EdgeRows
    members: Members

    @cached_property
    def faces(self) -> QueryNets:
        """The nets of faces and patches alone, with the same numbers."""
        return self._choose_nets(slice(self.surface_nets))

    @cached_property
    def curves(self) -> QueryNets | None:
        """The nets of edges alone, numbered from 0; None if there are none."""
        if self.surface_nets == len(self.nets.patch):
            return None
        return self._choose_nets(slice(self.surface_nets, None))

    @cached_property
    def is_reversed(self) -> Bools:
        """Whether the normal of a face or patch, (P,), is −(du × dv) after its placement."""
        is_reversed = np.zeros(self.members.patch_count, bool)
        for copy in self.members.copies:
            own = self.members.definitions[copy.definition].is_reversed
            faces = slice(copy.first_patch, copy.first_patch + len(own))
            is_reversed[faces] = own != is_mirroring(copy.matrix)
        return is_reversed

    @cached_property
    def solids(self) -> Ints:
        """The copy of a brep of which each face or patch (P,) is, if all shells are closed; or −1.

        A brep with skipped faces is not closed.
        """
        solids = np.full(self.members.patch_count, -1)
        for number, copy in enumerate(self.members.copies):
            prepared = self.members.definitions[copy.definition]
            if prepared.model.is_closed.all() and not prepared.skipped_faces:
                faces = slice(copy.first_patch, copy.first_patch + len(prepared.surfaces))
                solids[faces] = number
        return solids

    @cached_property
    def skipped_faces(self) -> tuple[SkippedFace, ...]:
        """The faces that take no part, by their numbers in the request; once for each brep."""
        return tuple(self.members.list_skipped())

    def _choose_nets(self, nets: slice) -> QueryNets:
        """The nets of a run of groups alone."""
        first = nets.start or 0
        last = len(self.nets.patch) if nets.stop is None else nets.stop
        groups = tuple(
            replace(group, first=group.first - first)
            for group in self.nets.groups
            if first <= group.first < last
        )
        errors = self.nets.errors
        return replace(
            self.nets,
            groups=groups,
            patch=self.nets.patch[nets],
            corners=self.nets.corners[nets],
            errors=None if errors is None else errors[nets],
        )


def build_part(model: BrepModel | GroupModel) -> Part:
    """The part of a brep, or of a group that has breps.

    Raises
    ------
    InvalidRequest
        A brep is invalid (`prepare`), or a member is a tube or a ribbon; pointers are relative to
        the surface.
    """
    members = Members.of(model)
    definitions, copies, patches = members.definitions, members.copies, members.patches
    boxes = [_find_box(definitions[copy.definition], copy.matrix) for copy in copies]
    if patches is not None:
        boxes.append(patches.bounds)
    low, high = join_boxes(boxes)
    origin, scale, diagonal = frame(low, high)
    builder = _Builder(Frame(origin, scale))
    edge_parts: list[tuple[EdgeNets, int]] = []
    for number, prepared in enumerate(definitions):
        faces = list(restrict_faces(prepared))
        edges = build_edge_nets(prepared, _find_speeds(prepared, faces))
        for k, copy in enumerate(copies):
            if copy.definition == number:
                for face_nets in faces:
                    builder.add_faces(face_nets, k, copy)
                edge_parts += [(each, k) for each in edges]
    if patches is not None:
        builder.add_patches(patches, (low, high))
    surface_count = builder.count
    for edge_nets, k in edge_parts:
        builder.add_edges(edge_nets, k, copies[k])
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
    trims = NetTrims(_join_regions(definitions), rows.face, rows.low.T.copy(), rows.high.T.copy())
    return Part(nets, trims, rows, surface_count, edge_rows, members)


class _Builder:
    """Collects nets, group by group, with their faces and edges."""

    def __init__(self, frame: Frame) -> None:
        self._frame = frame
        self._parts: list[tuple[Ints, FloatArray]] = []
        self._rows: dict[tuple[int, ...], list[NetRows]] = {}
        self._edges: dict[tuple[int, ...], list[EdgeRows]] = {}
        self.count = 0

    def add_faces(self, nets: FaceNets, number: int, copy: BrepCopy) -> None:
        """Add the nets of faces of a copy of a brep."""
        values, errors = place_nets(
            nets.values,
            nets.middles,
            nets.sizes,
            nets.errors,
            matrix=copy.matrix,
            frame=self._frame,
        )
        spans = nets.spans
        (a, c), (b, d) = spans.begin, spans.end
        corners = np.stack([a, c, b, c, a, d, b, d])
        rows = NetRows(
            copy.first_patch + spans.face,
            np.full(len(errors), number),
            copy.first_face + spans.face,
            spans.patch,
            spans.low,
            spans.high,
            corners,
            errors,
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
                np.zeros(size),
            )
            self._add(group.values, rows)

    def add_edges(self, nets: EdgeNets, number: int, copy: BrepCopy) -> None:
        """Add the nets of edges of a copy of a brep."""
        values, errors = place_nets(
            nets.values,
            nets.middles,
            nets.sizes,
            nets.errors,
            matrix=copy.matrix,
            frame=self._frame,
        )
        edges = nets.rows
        size = len(errors)
        none, zero = np.full(size, -1), np.zeros((2, size))
        rows = NetRows(
            copy.first_patch + edges.face,
            np.full(size, number),
            none,
            none,
            zero,
            zero + 1.0,
            np.repeat(UNIT_CORNERS.reshape(8, 1), size, axis=1),
            errors,
        )
        self._add(values, rows)
        is_edge = edges.edge != NO_EDGE
        stretch = scalings(copy.matrix)[1] / self._frame.scale * (1.0 + 2.0**-40)
        placed = replace(
            edges,
            edge=np.where(is_edge, copy.first_edge + edges.edge, NO_EDGE),
            gaps=edges.gaps * stretch,
            coedge=np.where(is_edge, copy.first_coedge + edges.coedge, -1),
            face=copy.first_face + edges.face,
        )
        self._edges.setdefault(values.shape[:3], []).append(placed)

    def finish(self) -> tuple[tuple[Nets, ...], NetRows, EdgeRows]:
        """All nets in groups, and their faces and edges in the same order."""
        rows = [row for rows in self._rows.values() for row in rows]
        edges = [row for rows in self._edges.values() for row in rows]
        if not edges:
            none, zero = np.zeros(0, np.intp), np.zeros(0)
            edges = [EdgeRows(none, zero, zero, zero, none, none, np.zeros(0, bool))]
        return group_nets(self._parts), NetRows.join(rows), EdgeRows.join(edges)

    def _add(self, values: FloatArray, rows: NetRows) -> None:
        self._parts.append((rows.patch, values))
        self._rows.setdefault(values.shape[:3], []).append(rows)
        self.count += len(rows.patch)


def _find_box(prepared: PreparedBrep, matrix: FloatArray | None) -> Box:
    """The box of a copy of a brep."""
    return place_box((prepared.box[0], prepared.box[1]), matrix)


def _find_speeds(prepared: PreparedBrep, faces: Sequence[FaceNets]) -> FloatArray:
    """Bounds (F,) of how far points of faces move for one unit of places along both axes."""
    speeds = np.zeros(len(prepared.surfaces))
    units = SIZE / prepared.places.extent
    for nets in faces:
        values = np.ascontiguousarray(nets.values.transpose(2, 3, 1, 0))
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
    tree = BorderTree.of(
        Splines.join([each.pcurves for each in definitions]),
        np.concatenate([each.coedge_reversed for each in definitions]),
        np.concatenate([each.loop_counts for each in definitions]),
    )
    return Regions.of(
        frames,
        tree,
        loop_faces=np.concatenate(
            [each.loop_faces + k for each, k in zip(definitions, counts, strict=False)]
        ),
        is_border=np.concatenate([each.is_border for each in definitions]),
        periods=np.concatenate([each.regions.periods for each in definitions]),
    )
