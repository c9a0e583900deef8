"""Every built-in surface, through the pipeline, before the judges of glTF and OOGL."""

from pathlib import Path

import pytest

from service.encoders.format import EncodeOptions, OoglForm
from service.encoders.registry import BY_NAME
from service.engine.options import Faces, MeshOptions, OverlayName
from service.errors import InvalidRequest, UnsupportedByFormat
from service.pipeline.mesh import render
from service.surface.batches import TrianglePatches
from service.surface.examples import EXAMPLES
from service.surface.lowered import GroupModel
from service.surface.sweep_model import SweepModel
from tests.clients.geomview import read_oogl
from tests.clients.gltf_validator import issues

OVERLAYS: tuple[OverlayName, ...] = ("control_net", "boundary")

each_example = pytest.mark.parametrize("example", EXAMPLES)


@each_example
@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_the_validator_has_nothing_to_say(example: str, suffix: str, tmp_path: Path) -> None:
    options = MeshOptions(resolution=(7, 5), uvs=True, overlays=OVERLAYS)
    content = render(EXAMPLES[example].surface(), options, BY_NAME[suffix])
    assert issues(content, tmp_path / f"model.{suffix}") == []


@each_example
@pytest.mark.parametrize(
    ("form", "faces"),
    [
        ("mesh", "quads"),
        ("off", "triangles"),
        ("bez", "quads"),
    ],
)
def test_geomview_has_nothing_to_say(
    example: str, form: OoglForm, faces: Faces, tmp_path: Path
) -> None:
    options = MeshOptions(resolution=(7, 5), faces=faces, overlays=OVERLAYS)
    surface, oogl = EXAMPLES[example].surface(), BY_NAME["oogl"]
    model = surface.lower()
    if form == "bez" and isinstance(model, SweepModel):
        with pytest.raises(InvalidRequest, match="not made of Bézier patches"):
            render(surface, options, oogl, EncodeOptions(form))
        return
    models = model.models if isinstance(model, GroupModel) else (model,)
    kinds = {type(b) for m in models if not isinstance(m, SweepModel) for b in m.batches}
    if form == "mesh" and TrianglePatches in kinds:
        with pytest.raises(UnsupportedByFormat):
            render(surface, options, oogl, EncodeOptions(form))
        return
    assert read_oogl(render(surface, options, oogl, EncodeOptions(form)), tmp_path).faces
