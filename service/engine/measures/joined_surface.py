"""The patches of a surface for measures, after placement and joining.

Areas are measured on the patches of the request. Borders and volumes are measured on the patches
that `service.engine.joining` makes of these, as for meshes. `JoinedSurface.find_request_side` finds
the patch and the side in the request to which a side of a joined patch belongs.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.connectivity.connect import connect
from service.engine.connectivity.incidence import triangular_patches
from service.engine.connectivity.seams import Seams
from service.engine.joining.join import Allow, join
from service.engine.joining.members import join_members
from service.engine.models import to_patches
from service.engine.nets.patch_nets import bound_lowering_error
from service.engine.points.surface_columns import in_domains
from service.engine.vectors import UNIT
from service.surface.lowered import GroupModel, Model, PatchModel, PlacedModel
from service.surface.placement import is_mirroring
from service.surface.sides import BEGINS, ENDS

SIDES = ("u=0", "u=1", "v=0", "v=1")
TRIANGLE_SIDES = ("s=0", "r=0", "t=0", "t=1")
"""The fourth side of a triangle is the corner t = 1."""

CORNERS = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
"""(u, v) of the corners 0 to 3 of a patch."""


@dataclass(frozen=True, slots=True)
class RequestSide:
    """A side of a patch in the numbering of the request.

    Attributes
    ----------
    surface : int or None
        The number of a member of a group.
    patch : int or None
        The number of the patch of a multipatch; None for one parametric surface.
    side : str
    uv : tuple
        Parameters at both ends; (s, t) on triangles.
    """

    surface: int | None
    patch: int | None
    side: str
    uv: tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, eq=False, slots=True)
class _JoinedModel:
    """A joined model whose patches begin at `first`, and the `members` that became this model.

    For each member: its number in the group, the matrix of its placement, and its model in the
    request. A member alone is joined first and then placed; the members of a cluster are placed
    first and then joined.
    """

    first: int
    model: PatchModel
    members: tuple[tuple[int | None, FloatArray | None, PatchModel], ...]
    is_cluster: bool


@dataclass(frozen=True, eq=False, slots=True)
class JoinedSurface:
    """Patches in model coordinates.

    Attributes
    ----------
    model : PatchModel
    seams : Seams
    part : ndarray of int, shape (P,)
        The part of each patch: a named run of patches, or a member of a group.
    point_error : float
        A bound of the errors of control points by lowering and placing, in model units.
    moved : float
        An upper bound of the distance by which joining moved any point, in model units.
    """

    model: PatchModel
    seams: Seams
    part: Ints
    point_error: float
    moved: float
    _joined_models: tuple[_JoinedModel, ...]

    def find_request_patches(self) -> tuple[Ints, Ints]:
        """The member and the number of the patch or surface in it of each patch, (P,) each.

        A surface that is no group is member 0. A patch or B-spline that is alone has number 0.
        """
        ends = [joined.first for joined in self._joined_models[1:]] + [self.model.patch_count]
        members, numbers = [], []
        for joined, end in zip(self._joined_models, ends, strict=True):
            index = np.arange(end - joined.first)
            if joined.model.domains:
                first_patches = np.array([domain.first for domain in joined.model.domains])
                order = np.argsort(first_patches)
                index = order[np.searchsorted(first_patches[order], index, side="right") - 1]
            models = [patch_model for *_, patch_model in joined.members]
            counts = [len(each.domains) or each.patch_count for each in models]
            starts = np.cumsum([0, *counts])
            place = np.searchsorted(starts, index, side="right") - 1
            own = index - starts[place]
            for k, each in enumerate(models):
                if not each.domains and each.request_numbers is not None:
                    rows = np.flatnonzero(place == k)
                    own[rows] = each.request_numbers[own[rows]]
            surfaces = np.array([surface or 0 for surface, *_ in joined.members])
            members.append(surfaces[place])
            numbers.append(own)
        return np.concatenate(members), np.concatenate(numbers)

    def find_request_side(self, number: int) -> RequestSide:
        """The side of the request that became side `number` (patch · 4 + side) of `model`."""
        patch, side = divmod(number, 4)
        joined = [candidate for candidate in self._joined_models if candidate.first <= patch][-1]
        # `index` is the number of the patch in the joined model.
        index, model = patch - joined.first, joined.model
        ends = CORNERS[[BEGINS[side], ENDS[side]]]
        surface, matrix, patch_model = joined.members[0]
        # A mirrored patch was transposed: side ^ 2 exchanges the sides of u (0, 1) and of v (2, 3).
        # The side r = 0 (1) of a triangle stays.
        is_triangle = bool(triangular_patches(self.model.batches)[patch])
        exchanged_side = side if is_triangle and side == 1 else side ^ 2
        if is_triangle:
            ends = _on_triangle(ends)
        # Placement and joining are undone, the last of them first: `_JoinedModel` has their order.
        if not joined.is_cluster and is_mirroring(matrix):
            side, ends = exchanged_side, ends[:, ::-1]
        if model.domains:
            # From here on, `index` is the number of a parametric surface.
            ends, domain = in_domains(model.domains, np.array([index, index]), ends)
            index = int(domain[0])
        if joined.is_cluster:
            counts = [
                len(patch_model.domains) or patch_model.patch_count
                for *_, patch_model in joined.members
            ]
            end_numbers = np.cumsum(counts)
            member = int(np.searchsorted(end_numbers, index, side="right"))
            surface, matrix, patch_model = joined.members[member]
            index -= int(end_numbers[member]) - counts[member]
            if is_mirroring(matrix):
                side, ends = exchanged_side, ends[:, ::-1]
        names, patch_number = SIDES, None if len(patch_model.domains) == 1 else index
        if not patch_model.domains:
            if triangular_patches(patch_model.batches)[index]:
                # A mirrored triangle that was placed alone is a tensor-product patch with (u, v)
                # until here; the parameters of other triangles do not change.
                names, ends = TRIANGLE_SIDES, _on_triangle(ends)
            patch_number = index
            if patch_model.request_numbers is not None:
                patch_number = int(patch_model.request_numbers[index])
        (a, b), (c, d) = ends.tolist()
        return RequestSide(surface, patch_number, names[side], ((a, b), (c, d)))


def _on_triangle(ends: FloatArray) -> FloatArray:
    """(s, t) of corners (u, v): the side v = 1 is the point (0, 1). Corners (s, t) stay."""
    return np.asarray(np.where(ends[:, 1:] == 1, [[0.0, 1.0]], ends))


def place_and_join(
    lowered: Model, tolerance: float, allow: Allow
) -> tuple[PatchModel, Ints, JoinedSurface]:
    """The placed patches of the request, the part of each, and the joined patches.

    `tolerance` and `allow` are the parameters of `service.engine.joining.join.join`.

    Raises
    ------
    InvalidRequest
        `not_parametric`, of tubes and ribbons.
    """
    patch_model = to_patches(lowered)
    part = patch_model.part_numbers
    if isinstance(lowered, GroupModel):
        return patch_model, part, _join_group(lowered, tolerance, allow)
    assert isinstance(lowered, PatchModel)
    model, seams = join(lowered, tolerance, allow)
    point_error = bound_lowering_error(lowered)
    models = (_JoinedModel(0, model, ((None, None, lowered),), is_cluster=False),)
    joined = JoinedSurface(model, seams, model.part_numbers, point_error, model.moved, models)
    return patch_model, part, joined


def _join_group(group: GroupModel, tolerance: float, allow: Allow) -> JoinedSurface:
    """Place and join the members of a group."""
    joined = join_members(group, tolerance, allow)
    placed = to_patches(joined.group)
    # In the joined group each cluster is one member, so members have new numbers: the keys of both
    # dictionaries.
    clusters = {joined.new_numbers[cluster.members[0]]: cluster for cluster in joined.clusters}
    single_members = {new: old for old, new in enumerate(joined.new_numbers) if new not in clusters}
    part, joined_models, first = [], [], 0
    point_error = moved = 0.0
    for number, member in enumerate(joined.group.members):
        model = _find_model(joined.group, number)
        if number in clusters:
            cluster = clusters[number]
            numbers = cluster.members
            member_positions = np.searchsorted(cluster.ends, model.part_numbers, side="right") - 1
            part.append(np.array(numbers)[member_positions])
        else:
            numbers = (single_members[number],)
            part.append(np.full(model.patch_count, numbers[0]))
        members = tuple(
            (group.find_number(n), group.members[n].matrix, _find_model(group, n)) for n in numbers
        )
        joined_models.append(_JoinedModel(first, model, members, number in clusters))
        first += model.patch_count
        moved = max(moved, model.moved * _stretch(member))
        for n in numbers:
            point_error = max(
                point_error, _bound_placing_error(group.members[n], _find_model(group, n))
            )
    return JoinedSurface(
        placed, connect(placed), np.concatenate(part), point_error, moved, tuple(joined_models)
    )


def _find_model(group: GroupModel, number: int) -> PatchModel:
    """The model of member `number` of a group."""
    model = group.models[group.members[number].model]
    assert isinstance(model, PatchModel)  # other kinds have no patches
    return model


def _stretch(member: PlacedModel) -> float:
    """An upper bound of the factor by which a placement stretches a vector: a Frobenius norm."""
    return 1.0 if member.matrix is None else float(np.linalg.norm(member.matrix[:3, :3]))


def _bound_placing_error(member: PlacedModel, model: PatchModel) -> float:
    """A bound of the errors of control points by lowering and placing, in units of the group."""
    error = bound_lowering_error(model) * _stretch(member)
    if member.matrix is None:
        return error
    max_coordinates: FloatArray = np.maximum(np.abs(model.bounds[0]), np.abs(model.bounds[1]))
    max_placed = np.abs(member.matrix[:3, :3]) @ max_coordinates + np.abs(member.matrix[:3, 3])
    # Placing a point rounds each coordinate some 6 times; 16 is an upper bound. A mirrored triangle
    # becomes a tensor-product patch (`to_patches`): raising its degree adds up to 65 terms, and
    # 16 · 32 roundings are an upper bound.
    roundings = 16 * 32 if triangular_patches(model.batches).any() else 16
    return error + roundings * UNIT * float(np.linalg.norm(max_placed))
