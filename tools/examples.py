"""Lowers surfaces for tests that need their patches."""

from service.surface.examples.catalogue import find
from service.surface.kinds import Surface
from service.surface.lowered import PatchModel


def lower_patches(source: str | Surface) -> PatchModel:
    """The Bézier patches of a surface, or of the built-in example of that name."""
    surface = find(source).surface() if isinstance(source, str) else source
    model = surface.lower()
    assert isinstance(model, PatchModel)
    return model
