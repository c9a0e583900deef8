"""What questions and exact forms need: surfaces that are made of patches."""

from service.engine.models import as_patches
from service.errors import InvalidRequest, Issue
from service.surface.lowered import GroupModel, Model, PatchModel

NOT_PARAMETRIC = Issue(
    "not_parametric",
    "Parameters mean nothing on a group; each of its surfaces has its own.",
    "/surface",
    "a group",
    "one of its members",
)


def parametric(model: Model) -> PatchModel:
    """A model that has points at parameters, and patches that can be converted.

    Raises
    ------
    InvalidRequest
        `not_parametric`, pointing into the request.
    """
    if isinstance(model, GroupModel):
        raise InvalidRequest(NOT_PARAMETRIC)
    return patches_of(model)


def patches_of(model: Model) -> PatchModel:
    """All patches of a model, in the coordinates of the whole.

    Raises
    ------
    InvalidRequest
        `not_parametric`, pointing into the request.
    """
    try:
        return as_patches(model)
    except InvalidRequest as error:
        raise error.within("/surface") from None
