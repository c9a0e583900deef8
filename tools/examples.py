"""Lowers surfaces for tests and tools that need their patches."""

from service.surface.batches import TensorPatches
from service.surface.examples.catalogue import find
from service.surface.kinds import Surface
from service.surface.lowered import PatchModel


def lower_patches(source: str | Surface) -> PatchModel:
    """The Bézier patches of a surface, or of the built-in example of that name."""
    surface = find(source).surface() if isinstance(source, str) else source
    model = surface.lower()
    assert isinstance(model, PatchModel)
    return model


def lower_example(name: str) -> TensorPatches:
    """The patches of a built-in example that lowers to one batch of tensor-product patches."""
    (batch,) = lower_patches(name).batches
    assert isinstance(batch, TensorPatches)
    return batch
