"""Breps, and groups with breps, ready for questions."""

from typing import TypeGuard

from service.encoders.content import list_skipped_faces
from service.engine.parts.build import build_part
from service.engine.parts.part import Part
from service.errors import InvalidRequest
from service.pipeline.brep_checks import check_edges
from service.pipeline.checks import check_surface, require_no_sweeps
from service.pipeline.limits import Limits
from service.surface.brep_model import BrepModel
from service.surface.lowered import GroupModel, Model
from service.surface.sizes import SurfaceKind, SurfaceSize


def check_asked(size: SurfaceSize, limits: Limits) -> SurfaceSize:
    """The size, unless questions to a surface of this size take too much memory or time.

    Raises
    ------
    TooLarge
    """
    check_surface(size, limits)
    check_edges(size, limits)
    return size


def require_exact(surface: SurfaceKind) -> SurfaceKind:
    """The surface with tubes as exact patches, for questions to its points.

    Raises
    ------
    InvalidRequest
        `not_parametric`: a ribbon, or a tube that is not made of patches, with the reason.
    """
    try:
        return surface.exact_patches()
    except InvalidRequest as error:
        raise error.within("/surface") from None


def has_breps(model: Model) -> TypeGuard[BrepModel | GroupModel]:
    """Whether a model is a brep, or a group that has breps."""
    models = model.models if isinstance(model, GroupModel) else (model,)
    return any(isinstance(each, BrepModel) for each in models)


def prepare_part(model: BrepModel | GroupModel) -> Part:
    """Prepare a brep, or a group with breps, for questions.

    Raises
    ------
    InvalidRequest
        `not_parametric`: the group has tubes or ribbons; `no_faces`; or a face is invalid.
    """
    require_no_sweeps(model)
    try:
        return build_part(model)
    except InvalidRequest as error:
        raise error.within("/surface") from None


def describe_skipped(part: Part) -> dict[str, object]:
    """The field `skipped_faces` of an answer: the faces that took no part; no field without any."""
    if not part.skipped_faces:
        return {}
    return {"skipped_faces": list_skipped_faces(part.skipped_faces, "patch")}
