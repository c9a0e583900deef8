"""The effect of placements on curvatures, as stretches of the models of a group.

A rotation or a reflection does not change curvatures; a scaling does. With the singular values L =
U Σ Vᵀ of a placement, L = (U Vᵀ)(V Σ Vᵀ): first the stretch V Σ Vᵀ, then a rotation or a
reflection. So a copy has the curvatures of its stretched model.
"""

from dataclasses import replace
from typing import TypeVar

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sweep_model import SweepModel

EVEN = 1e-10
"""Scalings that differ by at most this, relatively, count as equal."""

DIGITS = 10
"""Digits to which a scaling is rounded, so that the rotation of a copy does not change it."""

AnyModel = TypeVar("AnyModel", bound=Model)


def add_stretches(model: AnyModel) -> AnyModel:
    """The model; a group gets one model for each pair of a surface and a stretch.

    Copies that are only moved, rotated or reflected share one model. Stretched models share their
    arrays. The function is idempotent.
    """
    if not isinstance(model, GroupModel):
        return model
    numbers: dict[tuple[int, bytes], int] = {}
    models: list[PatchModel | SweepModel] = []
    members = []
    for member in model.members:
        unplaced = model.models[member.model]
        stretch = None if isinstance(unplaced, SweepModel) else find_stretch(member.matrix)
        key = member.model, b"" if stretch is None else stretch.tobytes()
        number = numbers.setdefault(key, len(models))
        if number == len(models):
            if not isinstance(unplaced, SweepModel):
                unplaced = replace(unplaced, stretch=stretch)
            models.append(unplaced)
        members.append(replace(member, model=number))
    return replace(model, models=tuple(models), members=tuple(members))


def find_stretch(matrix: FloatArray | None) -> FloatArray | None:
    """The stretch V Σ Vᵀ of a placement (4, 4); None if the placement keeps all lengths."""
    if matrix is None:
        return None
    _, scalings, rotation = np.linalg.svd(matrix[:3, :3])
    most, least = float(scalings[0]), float(scalings[2])
    if abs(most - 1.0) <= EVEN and abs(least - 1.0) <= EVEN:
        return None
    stretch = np.eye(4)
    if most - least <= EVEN * most:
        stretch[:3, :3] *= float(f"{most:.{DIGITS}g}")
    else:
        stretch[:3, :3] = (rotation.T * scalings) @ rotation
    return stretch
