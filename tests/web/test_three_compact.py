"""The teapot in whole numbers and compressed, as three.js draws it in headless Chromium."""

import pytest

from tests.web.browser import Stage
from tests.web.pictures import difference

pytest.importorskip("meshopt")

TEAPOT = "/v1/surfaces/utah-teapot/mesh"
PARTS = ["body", "bottom", "handle", "lid", "rim", "spout"]


@pytest.mark.parametrize(
    "form", ["quantize=true", "compression=meshopt", "quantize=true&compression=meshopt"]
)
def test_the_picture_is_the_same(server: str, stage: Stage, form: str) -> None:
    stage.show(f"{server}{TEAPOT}.glb?resolution=16", 400, 300)
    plain, wanted = stage.page.screenshot(), stage.page.evaluate("window.viewer.measure()")
    stage.show(f"{server}{TEAPOT}.glb?resolution=16&{form}", 400, 300)
    assert sorted(mesh["name"] for mesh in stage.meshes()) == PARTS
    smooth = stage.page.evaluate("window.viewer.measure()")
    unlike = difference(stage, plain, stage.page.screenshot())
    assert unlike.mean < 0.1
    assert unlike.apart < 0.0005
    # The eye sees no edges between triangles, whatever normals were rounded to.
    assert smooth["edges"] < wanted["edges"] + 0.001


def test_the_json_form_and_lines(server: str, stage: Stage) -> None:
    both = "overlays=control_net&quantize=true&compression=meshopt"
    stage.show(f"{server}{TEAPOT}.gltf?resolution=4&{both}")
    (net,) = stage.lines()
    stage.show(f"{server}{TEAPOT}.glb?resolution=4&overlays=control_net")
    (wanted,) = stage.lines()
    assert net["segments"] == wanted["segments"]
    assert len(net["positions"]) == len(wanted["positions"])
