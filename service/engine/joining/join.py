"""Makes the borders of a model equal where they are the same curve, before meshing.

1. Control points that are equal up to rounding are made equal (`snap`).
2. A surface is cut where one of its open borders is the same curve as pieces of other borders
   (`shared_curves`, `cutting`). A cut reaches the opposite border, where the next surface may then
   need a cut. So this step is repeated until no border needs a cut.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

from service.cancellation import checkpoint
from service.engine.connectivity.connect import connect, connect_if_apart, may_be_cut
from service.engine.connectivity.equal_points import find_weld_distance
from service.engine.connectivity.seams import Seams
from service.engine.joining.cutting import cut, find_lines
from service.engine.joining.shared_curves import find_cuts
from service.engine.joining.snap import snap
from service.surface.lowered import GroupModel, PatchModel

ROUNDS = 64
"""The most repetitions of cutting: they are enough for a row of 64 surfaces."""

GROWTH, SQUARE_GROWTH, MAX_SQUARE_GROWTH, EXTRA_PATCHES = 16, 8, 1 << 13, 256
"""Cutting P patches may make at most max(16 P, min(8 P², 8192)) + 256 patches, because P faces with
different knots become about P² patches. If cutting makes more patches, the model is not cut at all:
cuts that run around a body and never meet would not end."""

EXTRA_POINTS = 1 << 17
"""The most control points that cutting may add to `GROWTH` times the number of control points."""


Allow: TypeAlias = Callable[..., None]
"""Raises an error if the models (`PatchModel`) in its arguments are too large together."""


def allow_any(*_models: PatchModel) -> None:
    """Accepts every model."""


def join(model: PatchModel, tolerance: float, allow: Allow = allow_any) -> tuple[PatchModel, Seams]:
    """The model, with borders that are nearly the same curve made equal, and its seams.

    Parameters
    ----------
    tolerance : float
        `MeshOptions.weld_tolerance`; 0 changes nothing.
    allow : callable
        Called with each model that was cut; it raises an error if the model is too large.
    """
    return join_further(model, connect_if_apart(model, tolerance), tolerance, allow)


def join_further(
    model: PatchModel, seams: Seams | None, tolerance: float, allow: Allow
) -> tuple[PatchModel, Seams]:
    """The result of `join`, given the `seams` of `connect_if_apart`, which may be None."""
    model, seams = _snap_model(model, seams, tolerance)
    if not (tolerance and may_be_cut(model, seams)):
        return model, seams
    uncut = model, seams
    count = model.patch_count
    max_patches = (
        max(GROWTH * count, min(SQUARE_GROWTH * count**2, MAX_SQUARE_GROWTH)) + EXTRA_PATCHES
    )
    max_points = GROWTH * _count_points(model) + EXTRA_POINTS
    for _ in range(ROUNDS):
        cuts = find_cuts(seams, find_weld_distance(model, tolerance))
        if not len(cuts.at):
            break
        lines = find_lines(model, cuts)
        if not len(lines.at):
            break
        checkpoint()
        model = cut(model, lines)
        if model.patch_count > max_patches or _count_points(model) > max_points:
            return uncut
        model, seams = _snap_model(model, connect_if_apart(model, tolerance), tolerance)
    else:
        return uncut
    if model.patch_count > uncut[0].patch_count:
        allow(model)
    return model, seams


def _count_points(model: PatchModel) -> int:
    """The number of control points of all patches."""
    return sum(batch.points.size // 3 for batch in model.batches)


def _snap_model(
    model: PatchModel, seams: Seams | None, tolerance: float
) -> tuple[PatchModel, Seams]:
    """The model with near points made equal, and its seams.

    If `seams` is not None, the model has no near points that differ, and both are returned as they
    are.
    """
    if seams is not None:
        return model, seams
    model = snap(model, tolerance)
    return model, connect(model)


def join_each(group: GroupModel, tolerance: float) -> GroupModel:
    """The group with each of its models joined separately."""
    models = (join(m, tolerance)[0] if isinstance(m, PatchModel) else m for m in group.models)
    return replace(group, models=tuple(models))
