"""The breps of a model, each prepared once, and their copies; and its members without trims."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.brep.preparation.prepare import prepare
from service.engine.brep.prepared import PreparedBrep
from service.engine.models import to_patches
from service.engine.numbering import Numbering, list_numbers
from service.engine.scenes.placing import scalings
from service.errors import InvalidRequest
from service.surface.brep_model import BrepModel, SkippedFace
from service.surface.lowered import GroupModel, PatchModel
from service.surface.placement import Box, join_boxes, place_box


@dataclass(frozen=True, eq=False, slots=True)
class BrepCopy:
    """A placed copy of a brep.

    Attributes
    ----------
    definition : int
        The number of the brep among the distinct ones.
    number : int
        Its own number among the copies.
    matrix : ndarray of float64, shape (4, 4), or None
        Affine placement; None stands for the identity.
    first_patch : int
        The number of its first face in the request.
    first_face, first_edge, first_coedge : int
        The first face, edge and coedge of the brep among those of all distinct breps.
    """

    definition: int
    number: int
    matrix: FloatArray | None
    first_patch: int
    first_face: int
    first_edge: int
    first_coedge: int

    def place(self, points: FloatArray) -> FloatArray:
        """Points (…, 3) after the placement."""
        if self.matrix is None:
            return points
        # One term after another, so that equal points stay equal, bit for bit.
        rows = [
            points[..., 0] * a + points[..., 1] * b + points[..., 2] * c + d
            for a, b, c, d in self.matrix[:3].tolist()
        ]
        return np.stack(rows, axis=-1)

    @property
    def stretch(self) -> float:
        """No length becomes longer than by this factor."""
        return scalings(self.matrix)[1]


@dataclass(frozen=True, eq=False, slots=True)
class Members:
    """The members of a part.

    Attributes
    ----------
    definitions : tuple of PreparedBrep
        The distinct breps. Models that differ only in their stretch are one.
    copies : tuple of BrepCopy
        In the order of the request.
    patches : PatchModel or None
        The patches of all other members, placed, with their numbers in the request; None if there
        are no others.
    patch_count : int
        The number of faces and patches of the request.
    """

    definitions: tuple[PreparedBrep, ...]
    copies: tuple[BrepCopy, ...]
    patches: PatchModel | None
    patch_count: int

    @classmethod
    def of(cls, model: BrepModel | GroupModel) -> "Members":
        """The members of a brep, or of a group.

        Raises
        ------
        InvalidRequest
            A brep is invalid, or a member is a tube or a ribbon; pointers are relative to the
            model.
        """
        if isinstance(model, BrepModel):
            copy = BrepCopy(0, 0, None, 0, 0, 0, 0)
            return cls((prepare(model),), (copy,), None, model.face_count)
        definitions, numbers = _prepare_breps(model)
        faces = _count([len(each.surfaces) for each in definitions])
        edges = _count([len(each.edge_curves) for each in definitions])
        coedges = _count([len(each.coedge_edges) for each in definitions])
        starts = Numbering.of(model).starts.tolist()
        copies: list[BrepCopy] = []
        others, patches = [], []
        for member, start in zip(model.members, starts, strict=False):  # `starts` has the end, too
            each = model.models[member.model]
            if isinstance(each, BrepModel):
                k = numbers[id(each.vertices)]
                first = start, faces[k], edges[k], coedges[k]
                copies.append(BrepCopy(k, len(copies), member.matrix, *first))
            else:
                others.append(member)
                patches.append(start + list_numbers(each))
        placed = None
        if others:
            placed = to_patches(replace(model, members=tuple(others)))
            placed = replace(placed, request_numbers=np.concatenate(patches))
        return cls(tuple(definitions), tuple(copies), placed, starts[-1])

    @property
    def bounds(self) -> Box:
        """Least and greatest coordinates of all copies and patches."""
        boxes = [
            place_box((box[0], box[1]), copy.matrix)
            for copy in self.copies
            for box in (self.definitions[copy.definition].box,)
        ]
        return join_boxes(boxes if self.patches is None else [*boxes, self.patches.bounds])

    def list_skipped(self) -> Iterator[SkippedFace]:
        """The faces that are skipped, in the first copy of their brep, with their numbers there."""
        for copy, *_ in self.list_copies():
            for skipped in self.definitions[copy.definition].skipped_faces:
                yield replace(skipped, face=copy.first_patch + skipped.face)

    def list_copies(self) -> list[list[BrepCopy]]:
        """The copies of each distinct brep."""
        lists: list[list[BrepCopy]] = [[] for _ in self.definitions]
        for copy in self.copies:
            lists[copy.definition].append(copy)
        return lists


def _prepare_breps(model: GroupModel) -> tuple[list[PreparedBrep], dict[int, int]]:
    """The distinct breps of a group, and their numbers by the identity of their vertices."""
    definitions: list[PreparedBrep] = []
    numbers: dict[int, int] = {}
    for number, each in enumerate(model.models):
        if isinstance(each, BrepModel) and id(each.vertices) not in numbers:
            try:
                prepared = prepare(each)
            except InvalidRequest as error:
                raise error.within(model.locate(number)) from None
            numbers[id(each.vertices)] = len(definitions)
            definitions.append(prepared)
    return definitions, numbers


def _count(counts: Sequence[int]) -> list[int]:
    """0, and the sums of the first counts."""
    sums: list[int] = np.cumsum([0, *counts]).tolist()
    return sums
