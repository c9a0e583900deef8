"""Surfaces lowered, where a test needs their patches."""

from service.surface import Surface
from service.surface.examples import find
from service.surface.lowered import PatchModel


def patches_of(source: str | Surface) -> PatchModel:
    """The Bézier patches of an example or a surface that lowers to patches and nothing else."""
    surface = find(source).surface() if isinstance(source, str) else source
    model = surface.lower()
    assert isinstance(model, PatchModel)
    return model
