"""The numbers that faces and patches of a model have in a request and in responses (`patch`).

The faces of a brep have their numbers, and Bézier patches those of the request. In a group, the
faces and patches of each member follow those of the member before.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Ints
from service.engine.models import to_patches
from service.surface.brep_model import BrepModel
from service.surface.lowered import GroupModel, Model, PatchModel, SingleModel


@dataclass(frozen=True, eq=False, slots=True)
class Numbering:
    """The numbers in the request of a model that may have several members.

    Attributes
    ----------
    starts : ndarray of int, shape (M+1,)
        The first number of each placed copy, and the number of all faces and patches. A model that
        is no group is one copy.
    """

    starts: Ints

    @classmethod
    def of(cls, model: Model) -> "Numbering":
        """The numbering of a model."""
        models: Sequence[SingleModel] = (model,) if not isinstance(model, GroupModel) else ()
        copies: Sequence[int] = (0,)
        if isinstance(model, GroupModel):
            models, copies = model.models, [member.model for member in model.members]
        counts = np.array([count_numbers(each) for each in models])[copies]
        return cls(np.concatenate([[0], counts.cumsum()]))

    def __len__(self) -> int:
        """The number of all faces and patches."""
        return int(self.starts[-1])

    def find_copies(self, number: Ints) -> tuple[Ints, Ints]:
        """The copies (m,) that have these numbers (m,), and the numbers (m,) in their models."""
        copy = np.searchsorted(self.starts, number, side="right") - 1
        return copy, number - self.starts[copy]


def count_numbers(model: SingleModel) -> int:
    """How many numbers a model has: one for each face or patch."""
    return model.face_count if isinstance(model, BrepModel) else model.patch_count


def list_numbers(model: SingleModel) -> Ints:
    """The numbers, from 0, of the faces of a brep, or of the patches in the order of batches."""
    if isinstance(model, PatchModel) and model.request_numbers is not None:
        return model.request_numbers
    return np.arange(count_numbers(model))


def number_patches(model: Model) -> PatchModel:
    """All patches of a model, placed, with their numbers in the request (`to_patches`).

    Raises
    ------
    InvalidRequest
        `not_parametric` for tubes, ribbons and breps; its pointer is relative to the surface.
    """
    patches = to_patches(model)
    if not isinstance(model, GroupModel):
        return patches
    starts = Numbering.of(model).starts.tolist()
    numbers = [
        start + list_numbers(model.models[member.model])
        for start, member in zip(starts, model.members, strict=False)  # `starts` has their end, too
    ]
    return replace(patches, request_numbers=np.concatenate(numbers))
