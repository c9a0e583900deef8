"""Examples by what they are, and their patches, for tests and tools."""

from service.surface.batches import TensorPatches
from service.surface.brep import BrepSurface
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.kinds import Surface
from service.surface.lowered import PatchModel

PARTS = tuple(
    name for name, example in EXAMPLES.items() if isinstance(example.surface(), BrepSurface)
)
"""Examples of whole parts, which have meshes by tolerance only."""

UNTRIMMED = tuple(name for name in EXAMPLES if name not in PARTS)
"""Examples of all other kinds."""


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
