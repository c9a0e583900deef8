"""Points of faces and patches of breps and groups, at parameters of each face or patch.

Only the patches that have a place are placed: a group may have far more patches than places.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import split_runs
from service.cancellation import checkpoint
from service.engine.brep.inside import find_inside
from service.engine.brep.prepared import PreparedBrep
from service.engine.connectivity.incidence import triangular_patches
from service.engine.evaluation.normals import group_by_batch
from service.engine.numbering import Numbering, list_numbers
from service.engine.points.evaluate import Column, Columns, estimate_effort, evaluate_points
from service.engine.points.places import (
    ParameterPoints,
    PointsQuery,
    check_coordinates,
    check_inside,
    find_patch_numbers,
    normalize_sums,
    round_to_ends,
)
from service.engine.scenes.placing import place_nets
from service.engine.trims.inside import INSIDE
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.brep_model import BrepModel
from service.surface.lowered import GroupModel, Part, PatchModel, SingleModel

CHUNK = 1 << 20
"""Numbers of the nets that are placed together: it limits memory."""


@dataclass(frozen=True, eq=False, slots=True)
class Copies:
    """The placed copies of the models of a group; a brep alone is one copy.

    Attributes
    ----------
    models : sequence of PatchModel, SweepModel and BrepModel
    numbers : ndarray of int, shape (M,)
        The model of each copy.
    matrices : ndarray of float64, shape (M, 4, 4)
    is_exchanged : ndarray of bool, shape (M,)
        Whether u and v of the patches of a copy are exchanged, as they are where it is mirrored
        (`to_patches`). The parameters of faces are always those of their surfaces.
    """

    models: Sequence[SingleModel]
    numbers: Ints
    matrices: FloatArray
    is_exchanged: Bools

    @classmethod
    def of(cls, model: GroupModel | BrepModel) -> "Copies":
        """The copies of a group, or a brep as one copy."""
        if isinstance(model, BrepModel):
            return cls((model,), np.zeros(1, np.intp), np.eye(4)[np.newaxis], np.zeros(1, bool))
        numbers = np.array([copy.model for copy in model.members])
        unmoved = np.eye(4)
        matrices = np.array(
            [unmoved if copy.matrix is None else copy.matrix for copy in model.members]
        )
        is_brep = np.array([isinstance(each, BrepModel) for each in model.models])[numbers]
        is_mirroring = np.linalg.det(matrices[:, :3, :3]) < 0
        return cls(model.models, numbers, matrices, is_mirroring & ~is_brep)

    def split(self, copy: Ints) -> Iterator[tuple[int, SingleModel, Ints]]:
        """The models of some copies (m,), each with its number and the rows of `copy` it has."""
        number = self.numbers[copy]
        for each in np.unique(number).tolist():
            yield each, self.models[each], np.flatnonzero(number == each)


@dataclass(frozen=True, eq=False, slots=True)
class PartPoints:
    """m places on faces and patches of a brep or a group.

    Attributes
    ----------
    copies : Copies
    batches : mapping of int to tuples of TensorPatches and TrianglePatches
        The patches of each model that has a place, before they are placed.
    copy, number : ndarray of int, shape (m,)
        The copy of each place, and the number of its face or patch in the copy.
    parameters : ndarray of float64, shape (m, 2)
        Parameters of the surface of a face, or of a patch.
    places : ParameterPoints
        The places on the patches of the models.
    """

    copies: Copies
    batches: Mapping[int, tuple[Patches, ...]]
    copy: Ints
    number: Ints
    parameters: FloatArray
    places: ParameterPoints

    def place(self) -> Iterator[tuple[PatchModel, ParameterPoints, Ints]]:
        """Place the patches, some at a time: yields them, places on them, and the rows of these."""
        order = np.lexsort([self.places.patch, self.copy])
        pairs = np.stack([self.copy[order], self.places.patch[order]])
        # Nets are placed once, where their first place is.
        is_new = np.append(True, (pairs[:, 1:] != pairs[:, :-1]).any(axis=0))
        sizes = np.zeros(len(order), np.intp)
        for number, _, among in self.copies.split(pairs[0]):
            for batch, _, which in group_by_batch(self.batches[number], pairs[1, among]):
                sizes[among[which]] = batch.points[0].size
        chunk = (sizes * is_new).cumsum() // CHUNK
        places = self.places
        for run in split_runs(chunk[1:] != chunk[:-1]):
            checkpoint()
            rows = order[run]
            model, patch = self._place_patches(rows)
            yield model, ParameterPoints(patch, places.local[rows], places.widths[rows]), rows

    def _place_patches(self, rows: Ints) -> tuple[PatchModel, Ints]:
        """A model of the patches of some places, each patch once; and their numbers in it."""
        copies, copy, patch = self.copies, self.copy[rows], self.places.patch[rows]
        placed: list[Patches] = []
        numbers, count = np.empty(len(rows), np.intp), 0
        for model, _, of_model in copies.split(copy):
            pairs = np.stack([copy[of_model], patch[of_model]])
            pairs, inverse = np.unique(pairs, axis=1, return_inverse=True)
            of_pair = np.empty(pairs.shape[1], np.intp)
            for batch, first, among in group_by_batch(self.batches[model], pairs[1]):
                is_exchanged = copies.is_exchanged[pairs[0, among]]
                for flag in (False, True):
                    chosen = among[is_exchanged == flag]
                    if len(chosen):
                        of_pair[chosen] = count + np.arange(len(chosen))
                        count += len(chosen)
                        taken = replace(batch, channels=()).take(pairs[1, chosen] - first)
                        placed.append(_place(taken, copies.matrices[pairs[0, chosen]], flag))
            numbers[of_model] = of_pair[inverse.reshape(-1)]  # NumPy 2.0 returns a row
        return PatchModel("points", tuple(placed), (Part("points", 0, count),)), numbers


def locate_on_part(model: GroupModel | BrepModel, query: PointsQuery) -> PartPoints:
    """Find the face or patch of each place of a query, and its parameters there.

    A knot of the surface of a face belongs to the span that begins there, and the end of the domain
    to the last span. The parameters of a patch are from 0 to 1.

    Raises
    ------
    InvalidRequest
        `outside_domain`, `wrong_parameters`, or an error of the patch numbers, with a pointer into
        the request.
    """
    copies, numbering = Copies.of(model), Numbering.of(model)
    copy, own = numbering.find_copies(find_patch_numbers(len(numbering), query))
    is_uv = query.field == "uv"
    parameters = query.places.copy() if is_uv else normalize_sums(query.places)[:, 1:]
    patch, is_triangle = own.copy(), np.zeros(len(own), bool)
    low, high = np.zeros(parameters.shape), np.ones(parameters.shape)
    local, widths = parameters.copy(), np.ones(parameters.shape)
    batches: dict[int, tuple[Patches, ...]] = {}
    for number, each, rows in copies.split(copy):
        if isinstance(each, BrepModel):
            surfaces, face = FaceSurfaces.of(each.surfaces), own[rows]
            low[rows], high[rows] = surfaces.low[face], surfaces.high[face]
            parameters[rows] = round_to_ends(parameters[rows], low[rows], high[rows])
            patch[rows], spans, sides = surfaces.locate(face, parameters[rows])
            local[rows], widths[rows] = spans.T, sides.T
            batches[number] = surfaces.model.batches
        elif isinstance(each, PatchModel):
            parameters[rows] = round_to_ends(parameters[rows], low[rows], high[rows])
            local[rows] = parameters[rows]
            patch[rows] = np.argsort(list_numbers(each))[own[rows]]
            is_triangle[rows] = triangular_patches(each.batches)[patch[rows]]
            batches[number] = each.batches
    # A mirrored triangle is a tensor-product patch with a side that is one point.
    check_coordinates(is_triangle & ~copies.is_exchanged[copy], query)
    if is_uv:
        check_inside(parameters, low, high)
    places = ParameterPoints(patch, local, widths)
    return PartPoints(copies, batches, copy, own, parameters, places)


def evaluate_on_part(points: PartPoints, order: int, check: Callable[[int], None]) -> Columns:
    """The columns up to an order of derivatives, as `evaluate_points`, with one row for each place.

    `check` gets an estimate of all multiplications so far before they are done.
    """
    columns: dict[str, Column] = {}
    effort = 0
    for model, places, rows in points.place():
        effort += estimate_effort(model, places, order)
        check(effort)
        for name, column in evaluate_points(model, places, order).items():
            if name not in columns:
                columns[name] = np.empty((len(points.copy), *column.shape[1:]), column.dtype)
            columns[name][rows] = column
    return columns


def _place(batch: Patches, matrices: FloatArray, is_exchanged: bool) -> Patches:
    """The patches of a batch, each after its own placement (P, 4, 4)."""
    if is_exchanged:
        tensor = batch.to_tensor() if isinstance(batch, TrianglePatches) else batch
        batch = tensor.exchange_parameters()
    points = place_nets(batch.points, matrices)
    if isinstance(batch, TensorPatches):
        return TensorPatches(points, batch.weights)
    return TrianglePatches(points, batch.weights)


def find_inside_trims(
    points: PartPoints, prepare: Callable[[int, BrepModel], PreparedBrep]
) -> Ints | None:
    """Whether places are inside the trims of their faces: `INSIDE`, `OUTSIDE` or `UNDECIDED`, (m,).

    Patches have no trims, so all their points are inside. None if no model is a brep. `prepare`
    prepares a model with its number in `Copies`.
    """
    copies = points.copies
    if not any(isinstance(each, BrepModel) for each in copies.models):
        return None
    inside = np.full(len(points.copy), INSIDE, np.intp)
    for number, model, rows in copies.split(points.copy):
        if isinstance(model, BrepModel):
            prepared, face = prepare(number, model), points.number[rows]
            # Gaps are lengths before the placement.
            parameters = points.parameters[rows]
            positions = prepared.surfaces.evaluate(face, parameters)
            inside[rows] = find_inside(prepared, face, parameters, positions)
    return inside
