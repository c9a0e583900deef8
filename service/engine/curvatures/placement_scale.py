"""The effect of placements on curvatures, as stretches of the models of a group.

A rotation or a reflection does not change curvatures; a scaling does. Let L = U Σ Vᵀ be the
singular value decomposition of the linear part of a placement. Then L = (U Vᵀ)(V Σ Vᵀ): the
placement first applies the stretch V Σ Vᵀ, then a rotation or a reflection. So a copy has the
curvatures of its stretched model.
"""

from dataclasses import replace
from typing import TypeVar

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.curve_model import SweepModel
from service.surface.lowered import GroupModel, Model, SingleModel

EQUAL_SCALINGS = 1e-10
"""The largest relative difference of two scalings that count as equal."""

SCALING_DIGITS = 10
"""Decimal digits to which an equal scaling in all directions is rounded. A rotation changes only
later digits, so rotated copies have the same stretch."""

AnyModel = TypeVar("AnyModel", bound=Model)


def add_stretches(model: AnyModel) -> AnyModel:
    """The model with stretches: a group gets one model for each pair of a surface and a stretch.

    A model that is not a group is returned as it is. Copies that are only moved, rotated or
    reflected share one model. Models that differ in their stretches share their arrays. Tubes and
    ribbons (`SweepModel`) have no curvatures, so they get no stretch. The function is idempotent.
    """
    if not isinstance(model, GroupModel):
        return model
    numbers: dict[tuple[int, bytes], int] = {}
    models: list[SingleModel] = []
    members = []
    for member in model.members:
        model_of_member = model.models[member.model]
        stretch = None if isinstance(model_of_member, SweepModel) else find_stretch(member.matrix)
        key = member.model, b"" if stretch is None else stretch.tobytes()
        number = numbers.setdefault(key, len(models))
        if number == len(models):
            if not isinstance(model_of_member, SweepModel):
                model_of_member = replace(model_of_member, stretch=stretch)
            models.append(model_of_member)
        members.append(replace(member, model=number))
    return replace(model, models=tuple(models), members=tuple(members))


def find_stretch(matrix: FloatArray | None) -> FloatArray | None:
    """The stretch V Σ Vᵀ of a placement (4, 4); None if the placement keeps all lengths."""
    if matrix is None:
        return None
    _, scalings, rotation = np.linalg.svd(matrix[:3, :3])
    max_scaling, min_scaling = float(scalings[0]), float(scalings[2])
    if abs(max_scaling - 1.0) <= EQUAL_SCALINGS and abs(min_scaling - 1.0) <= EQUAL_SCALINGS:
        return None
    stretch = np.eye(4)
    if max_scaling - min_scaling <= EQUAL_SCALINGS * max_scaling:
        stretch[:3, :3] *= float(f"{max_scaling:.{SCALING_DIGITS}g}")
    else:
        stretch[:3, :3] = (rotation.T * scalings) @ rotation
    return stretch
