"""Models with other patches: pieces of the patches of a model, or some of its patches."""

from dataclasses import replace

import numpy as np

from service.bases.arrays import Ints
from service.surface.batches import Patches
from service.surface.lowered import Domain, Part, PatchModel
from service.surface.multipatch import join_batches

UNIT = np.array([0.0, 1.0])
UNIT.flags.writeable = False


def surfaces_of(model: PatchModel) -> tuple[Domain, ...]:
    """The parametric surfaces of a model, in the order of their patches."""
    domains = model.domains or tuple(Domain(UNIT, UNIT, k) for k in range(model.patch_count))
    return tuple(sorted(domains, key=lambda domain: domain.first))


def rebuild(
    model: PatchModel, pieces: list[list[Patches]], owner: Ints, domains: tuple[Domain, ...]
) -> PatchModel:
    """The model with other patches, the pieces of each batch.

    Patch k is a piece of patch `owner[k]` of the model, or is this patch; `owner` has shape (P',).
    The patches of one part must be consecutive, and the parts in the order of the model.
    """
    batches = tuple(join_batches(group) for group in pieces if group)
    listed = np.arange(model.patch_count) if model.sequence is None else model.sequence
    position = np.empty(model.patch_count, dtype=np.intp)
    position[listed] = np.arange(model.patch_count)
    places = position[owner]
    ends = np.concatenate([[0], np.cumsum(np.bincount(places, minlength=model.patch_count))])
    parts = tuple(Part(p.name, int(ends[p.first]), int(ends[p.last])) for p in model.parts)
    sequence = None if model.sequence is None else np.argsort(places, kind="stable")
    return replace(
        model,
        batches=batches,
        parts=parts,
        domains=domains,
        order=None,
        sequence=sequence,
        control_nets=model.nets,
    )
