"""Encoders leave nothing behind that only the garbage collector would find.

It counts objects, not bytes, and may not come for minutes: arrays in a cycle would wait for it, in
memory that nobody has counted.
"""

import gc

import pytest

from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.examples import find


@pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)
def test_memory_is_free_at_once(fmt: Format) -> None:
    surface, options = find("saddle").surface(), MeshOptions(resolution=(4, 4))
    render(surface, options, fmt)  # what is kept once for all is made now
    gc.collect()
    gc.disable()
    gc.freeze()  # whatever else there is need not be looked through
    try:
        render(surface, options, fmt)
        assert gc.collect() == 0
    finally:
        gc.unfreeze()
        gc.enable()
