"""Models whose borders are equal where they are the same curve, before anything is meshed.

1. Control points that are equal up to rounding are made equal (`snap`).
2. Surfaces are cut where an open border of theirs is one curve with pieces of others, or of the
   same surface (`shared_curves`, `cutting`). A cut reaches the opposite border, where the next
   surface may need one: so this is repeated until no border needs any.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

from service.cancellation import checkpoint
from service.engine.joining.cutting import cut, lines_of
from service.engine.joining.shared_curves import find_cuts
from service.engine.joining.snap import snap
from service.engine.mesh.connect import connect, connect_if_apart, may_be_cut
from service.engine.mesh.equal_points import find_weld_distance
from service.engine.mesh.seams import Seams
from service.surface.lowered import GroupModel, PatchModel

ROUNDS = 64
"""How often surfaces are cut: enough for this number of surfaces in one row."""

GROWTH, SQUARED, MOST, ALWAYS = 16, 8, 1 << 13, 256
"""Cuts of P patches may make max(16 P, min(8 P², 8192)) + 256: faces with knots of their own become
some P². If more come, the model is not cut at all. Cuts that run around a body and never meet would
not end."""

POINTS = 1 << 17
"""Control points that cuts may add, besides multiplying them by `GROWTH`."""


Allow: TypeAlias = Callable[..., None]
"""Refuses models (`PatchModel`) that have become too large together."""


def allow_any(*_models: PatchModel) -> None:
    """Refuses nothing."""


def join(model: PatchModel, tolerance: float, allow: Allow = allow_any) -> tuple[PatchModel, Seams]:
    """The model with equal borders where they are one curve up to a tolerance, and its seams.

    Parameters
    ----------
    tolerance : float
        Part of the diagonal of the box about the control points; 0 changes nothing.
    allow : callable
        Looks at a model that was cut, before anything is made of it.
    """
    return join_further(model, connect_if_apart(model, tolerance), tolerance, allow)


def join_further(
    model: PatchModel, seams: Seams | None, tolerance: float, allow: Allow
) -> tuple[PatchModel, Seams]:
    """The result of `join`, given the `seams` of `connect_if_apart`."""
    model, seams = _snapped(model, seams, tolerance)
    if not (tolerance and may_be_cut(model, seams)):
        return model, seams
    known = model, seams
    count = model.patch_count
    most = max(GROWTH * count, min(SQUARED * count**2, MOST)) + ALWAYS
    most_points = GROWTH * _count_points(model) + POINTS
    for _ in range(ROUNDS):
        cuts = find_cuts(seams, find_weld_distance(model, tolerance))
        if not len(cuts.at):
            break
        lines = lines_of(model, cuts)
        if not len(lines.at):
            break
        checkpoint()
        model = cut(model, lines)
        if model.patch_count > most or _count_points(model) > most_points:
            return known
        model, seams = _snapped(model, connect_if_apart(model, tolerance), tolerance)
    else:
        return known
    if model.patch_count > known[0].patch_count:
        allow(model)
    return model, seams


def _count_points(model: PatchModel) -> int:
    """The control points of all patches."""
    return sum(batch.points.size // 3 for batch in model.batches)


def _snapped(model: PatchModel, seams: Seams | None, tolerance: float) -> tuple[PatchModel, Seams]:
    """The model with equal points where they are near, and its seams; `seams` if none are."""
    if seams is not None:
        return model, seams
    model = snap(model, tolerance)
    return model, connect(model)


def join_each(group: GroupModel, tolerance: float) -> GroupModel:
    """The group with each of its models joined by itself."""
    models = (join(m, tolerance)[0] if isinstance(m, PatchModel) else m for m in group.models)
    return replace(group, models=tuple(models))
