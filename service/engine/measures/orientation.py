"""Which patches to turn so that neighbours agree, and closed surfaces have a positive volume.

Patches are joined as for a mesh. A *unit* is what is turned as a whole: a patch, a B-spline. Two
units agree if the walks around their patches, with the patches on the left, pass along each common
edge in opposite directions (`service.engine.connectivity.orientation`). An edge on which more than
two sides count says nothing. Each unit becomes two vertices of a graph, one for each orientation,
and an edge joins the orientations that agree. A connected set of units is orientable if and only if
the two orientations of a unit are in different components of this graph.

Which of its two orientations an orientable set gets: one that is closed that with positive volume,
whose sign is proved; another one that in which fewer units are turned, or else the first unit is
not.

Proof in docs/proofs.md: "Volumes by Gauss's theorem".
"""

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.clustering import find_components
from service.engine.connectivity.orientation import OrientedSides, orient_sides
from service.engine.joining.join import Allow, allow_any
from service.engine.measures.cells import UPWARDS, CellNets
from service.engine.measures.integrals import refine
from service.engine.measures.joined_surface import JoinedSurface, place_and_join
from service.engine.measures.patch_cells import PatchCells, group_cells
from service.engine.nets.query_nets import surface_nets
from service.surface.lowered import GroupModel, Model, PatchModel

BUDGET = 1 << 14
"""The most control points of the cells that decide the signs of volumes."""

MAX_ROUNDS = 12
"""The most times that the allowed error of undecided volumes is divided by `REFINEMENT`."""

REFINEMENT = 8.0


@dataclass(frozen=True, eq=False, slots=True)
class Turns:
    """The units of a surface, U of them in the order of members and of numbers; and which to turn.

    Attributes
    ----------
    member, number : ndarray of int, shape (U,)
        The member of a group, 0 for other surfaces; and the number of the patch or of the surface
        of a multipatch in it, 0 for a single patch or B-spline.
    is_turned : ndarray of bool, shape (U,)
    is_orientable : ndarray of bool, shape (U,)
        Whether the connected set of units has an orientation; others are not turned.
    """

    member: Ints
    number: Ints
    is_turned: Bools
    is_orientable: Bools


def find_turns(model: Model, tolerance: float, allow: Allow = allow_any) -> Turns:
    """Find the units to turn; sweeps and breps, whose faces have an orientation, are left out.

    Parameters
    ----------
    tolerance : float
        `MeshOptions.weld_tolerance`.
    allow : callable
        Called with each model that joining has cut; raises an error if it is too large.
    """
    patches = _take_patches(model)
    if patches is None:
        nothing = np.zeros(0, np.intp)
        return Turns(nothing, nothing, np.zeros(0, bool), np.zeros(0, bool))
    _, _, joined = place_and_join(patches, tolerance, allow)
    member, number = joined.find_request_patches()
    pairs, unit = np.unique(np.stack([member, number]), axis=1, return_inverse=True)
    unit, count = unit.reshape(-1), pairs.shape[1]  # NumPy 2.0 returns a row
    sides = orient_sides(joined.seams)
    low, high = _find_orientations(sides, unit, count)
    is_orientable, is_second = low != high, low > high
    component = np.minimum(low, high)
    components, component = np.unique(component, return_inverse=True)
    component_count = len(components)
    first = np.full(component_count, count)
    np.minimum.at(first, component, np.arange(count))
    # Relative to the first unit of each connected set, which stays as it is for now.
    is_turned = (is_second ^ is_second[first][component]) & is_orientable
    passage = np.where(is_turned[unit, np.newaxis], -sides.passage, sides.passage)
    is_closed = replace(sides, passage=passage).find_closed_parts(component[unit], component_count)
    is_closed[component[~is_orientable]] = False
    sign = _find_signs(joined, component[unit], is_turned[unit], is_closed)
    # Without a sign, the majority stays.
    sizes = np.bincount(component, minlength=component_count)
    turned = np.bincount(component[is_turned], minlength=component_count)
    is_flipped = (sign < 0) | ((sign == 0) & (2 * turned > sizes))
    is_turned = (is_turned ^ is_flipped[component]) & is_orientable
    return Turns(pairs[0], pairs[1], is_turned, is_orientable)


def _take_patches(model: Model) -> PatchModel | GroupModel | None:
    """The model with its patches alone; None if it has none."""
    if isinstance(model, PatchModel):
        return model
    if not isinstance(model, GroupModel):
        return None
    is_kept = [isinstance(model.models[member.model], PatchModel) for member in model.members]
    if all(is_kept):
        return model
    members = [member for member, kept in zip(model.members, is_kept, strict=True) if kept]
    if not members:
        return None
    used = sorted({member.model for member in members})
    new_number = {old: new for new, old in enumerate(used)}
    return replace(
        model,
        models=tuple(model.models[old] for old in used),
        members=tuple(replace(each, model=new_number[each.model]) for each in members),
        nodes=(),
        numbers=tuple(model.find_number(k) for k, kept in enumerate(is_kept) if kept),
        definitions=(),
    )


def _find_orientations(sides: OrientedSides, unit: Ints, count: int) -> tuple[Ints, Ints]:
    """The components of both orientations of each unit, (count,) each.

    Vertex 2 k of the graph is unit k as it is, vertex 2 k + 1 is unit k turned.
    """
    counted = np.flatnonzero(sides.passage.ravel())
    edges = sides.edge.ravel()[counted]
    order = np.argsort(edges, kind="stable")
    counted, edges = counted[order], edges[order]
    starts = np.flatnonzero(np.append(True, edges[1:] != edges[:-1])) if len(edges) else edges
    is_pair = np.diff(np.append(starts, len(edges))) == 2
    first, second = counted[starts[is_pair]], counted[starts[is_pair] + 1]
    passage = sides.passage.ravel()
    disagrees = (passage[first] == passage[second]).astype(np.intp)
    a, b = 2 * unit[first // 4], 2 * unit[second // 4]
    root = find_components(
        2 * count, np.concatenate([a, a + 1]), np.concatenate([b + disagrees, b + 1 - disagrees])
    )
    return root[::2], root[1::2]


def _find_signs(joined: JoinedSurface, component: Ints, is_turned: Bools, is_closed: Bools) -> Ints:
    """The sign of the volume of each closed component, (C,); 0 if it is open or undecided.

    `component` and `is_turned` (P,) are those of patches: the flux through a turned patch has the
    other sign. The intervals include the errors of control points, and every closing of the gaps
    that joining closed, as those of `service.engine.measures.solids`.
    """
    sign = np.zeros(len(is_closed), np.intp)
    nets = surface_nets(joined.model.batches)
    pending, allowed = is_closed.copy(), inf
    for _ in range(MAX_ROUNDS):
        if not pending.any():
            break
        checkpoint()
        patches = pending[component]
        groups = group_cells(nets, joined.point_error + 2 * joined.moved, patches)
        refinement = refine(groups, "flux", np.array([allowed, inf]), BUDGET)
        # Two columns for each component: its patches that stay, and those that are turned.
        column = 2 * component + is_turned
        sums, errors = refinement.integrate().over_parts(column, 2 * len(is_closed))
        flux = sums[0, 1::2] - sums[0, 2::2]
        error = errors[0, 1::2] + errors[0, 2::2]
        error += 3 * float(groups[0].point_error[0]) * _bound_areas(groups, component, len(sign))
        error = (
            error * UPWARDS + 2.0**-50 * np.abs(sums[0, 1::2]) + 2.0**-50 * np.abs(sums[0, 2::2])
        )
        is_decided = pending & (np.abs(flux) > error)
        sign[is_decided] = np.sign(flux[is_decided]).astype(np.intp)
        pending &= ~is_decided
        if refinement.used_budget or not refinement.bounded:
            break  # more cells would exceed the budget, or change nothing
        largest = float(error[pending].max(initial=0.0))
        allowed = min(allowed, largest) / REFINEMENT
    return sign


def _bound_areas(groups: list[PatchCells], component: Ints, count: int) -> FloatArray:
    """Upper bounds of the areas of components, (count,), while control points move."""
    areas = np.zeros(count)
    for cells in groups:
        for rows in cells.chunks(1):
            chunk = cells.take(rows)
            along_u, along_v = CellNets(chunk, chunk.point_error).stretches
            np.add.at(areas, component[chunk.patch], along_u * along_v)
    return areas * UPWARDS
