"""Replaces patches of a model by pieces of them, or removes patches."""

from dataclasses import replace

import numpy as np

from service.bases.arrays import Ints
from service.surface.batches import Patches
from service.surface.bezier import UNIT_SQUARE
from service.surface.lowered import Domain, Part, PatchModel
from service.surface.multipatch import join_batches


def surfaces_of(model: PatchModel) -> tuple[Domain, ...]:
    """The domains of the parametric surfaces of a model, in the order of their patches.

    If the model has no domains, each patch is such a surface, over [0, 1]².
    """
    domains = model.domains or tuple(
        replace(UNIT_SQUARE, first=k) for k in range(model.patch_count)
    )
    return tuple(sorted(domains, key=lambda domain: domain.first))


def rebuild(
    model: PatchModel, pieces: list[list[Patches]], owner: Ints, domains: tuple[Domain, ...]
) -> PatchModel:
    """A model whose patches are replaced by pieces of them.

    Parameters
    ----------
    model : PatchModel
    pieces : list of list of TensorPatches or TrianglePatches
        The new patches; each inner list becomes one batch.
    owner : ndarray of int, shape (P',)
        New patch k, counted through all of `pieces`, is a piece of patch `owner[k]` of `model`, or
        the whole patch. If `model.sequence` is None, the new patches must be in the order of the
        parts.
    domains : tuple of Domain
        The domains of the new model.
    """
    batches = tuple(join_batches(group) for group in pieces if group)
    part_order = np.arange(model.patch_count) if model.sequence is None else model.sequence
    position = np.empty(model.patch_count, dtype=np.intp)
    position[part_order] = np.arange(model.patch_count)
    owner_positions = position[owner]
    # offsets[k]: how many new patches come from the first k old patches in the order of the parts.
    offsets = np.concatenate(
        [[0], np.cumsum(np.bincount(owner_positions, minlength=model.patch_count))]
    )
    parts = tuple(Part(p.name, int(offsets[p.first]), int(offsets[p.last])) for p in model.parts)
    sequence = None if model.sequence is None else np.argsort(owner_positions, kind="stable")
    return replace(
        model,
        batches=batches,
        parts=parts,
        domains=domains,
        request_numbers=None,
        sequence=sequence,
        control_nets=model.nets,
    )
