"""Compact glTF in three.js and Babylon.js: the same mesh, and the same picture."""

import base64
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from service.engine.grid import CORNER
from tests.web.browser import FILL_PIXELS, Stage
from tests.web.clients import TRIED, serve_site, visit, write_client
from tests.web.pictures import compare_pictures

pytest.importorskip("meshopt")

SURFACE = "/v1/surfaces/bourke-1111-colors/mesh.glb?resolution=24,20"
FORMS = {
    "plain": "",
    "both": "&quantize=true&compression=meshopt",
}
if len(TRIED) > 1:  # each option alone; tests/encoders/gltf/ tests the bytes
    FORMS |= {"quantized": "&quantize=true", "compressed": "&compression=meshopt"}
FRAMES = """<!doctype html><title>Forms</title><link rel="icon" href="data:,">
<style>body { margin: 0 } iframe { border: 0; width: 240px; height: 160px; float: left }</style>
"""
NORMAL = {"quantized": 0.002, "compressed": 0.001, "both": 0.1}
"""The largest error of normals in degrees, including the float32 of the libraries."""

MOVED = 2.0**-13 * CORNER
"""The largest move of a vertex by the grid, for a surface 5 units long."""


PICTURE = """async () => {
  const frame = () => new Promise(requestAnimationFrame);
  const scene = window.BABYLON?.EngineStore.LastCreatedScene;
  if (!scene) {
    for (let k = 0; k < 5; k += 1) await frame();
    return '';
  }
  await scene.whenReadyAsync();
  scene.render();
  return document.querySelector('canvas').toDataURL().split(',')[1];
}"""
"""Waits until the page has drawn; returns the canvas of Babylon.js, which is covered by a fading
curtain."""


Shown = dict[str, tuple[Any, bytes]]


@pytest.fixture(scope="module", params=[each for each in TRIED if each != "model-viewer"])
def shown(request: pytest.FixtureRequest, server: str, visitor: Stage) -> Shown:
    """The surface in every form as a library read it, with pictures, all on one page."""
    pages = {
        f"/{name}": write_client(request.param, server + SURFACE + FORMS[name]) for name in FORMS
    }
    frames = "".join(f'<iframe name="{name}" src="{name}"></iframe>' for name in FORMS)
    result: Shown = {}
    with serve_site({"/": FRAMES + frames, **pages}) as origin:
        visit(visitor, f"{origin}/", width=480, height=320)
        page = visitor.page
        for frame in page.frames[1:]:
            frame.wait_for_function("window.held().length > 0")
            (mesh,) = frame.evaluate("window.held()")
            frame.evaluate(FILL_PIXELS)
            canvas = base64.b64decode(frame.evaluate(PICTURE))
            result[frame.name] = mesh, canvas or frame.frame_element().screenshot()
            visitor.page.evaluate(
                "name => document.getElementsByName(name)[0].remove()", frame.name
            )
        assert visitor.complaints == []
    return result


@pytest.mark.parametrize("form", [name for name in FORMS if name != "plain"])
def test_libraries_hold_and_draw_the_same(shown: Shown, form: str, viewer: Stage) -> None:
    (expected, plain), (result, picture) = shown["plain"], shown[form]
    places = np.array(expected["positions"])
    moved, rows = cKDTree(places).query(result["positions"])
    assert sorted(rows.tolist()) == list(range(len(places)))
    assert moved.max() <= (MOVED if "quantize" in FORMS[form] else 0) + 1e-6
    normals = [np.array(mesh["normals"]) for mesh in (expected, result)]
    apart = np.linalg.norm(normals[0][rows] - normals[1], axis=1)
    assert np.degrees(2 * np.arcsin(apart / 2)).max() < NORMAL[form]
    colors = [np.array(mesh["colors"])[:, :3] for mesh in (expected, result)]
    assert np.abs(colors[0][rows] - colors[1]).max() < 1e-5
    assert list_faces(result["triangles"], rows) == list_faces(expected["triangles"], None)
    unlike = compare_pictures(viewer, plain, picture)
    assert unlike.inside > 0.02
    assert unlike.mean < 0.1
    assert unlike.apart < 0.002
    assert unlike.most == 0 or "quantize" in FORMS[form]


def list_faces(indices: list[int], rows: Any) -> set[tuple[int, ...]]:
    """Triangles by the vertices of the plain mesh, each from the least of them on."""
    corners = np.array(indices) if rows is None else rows[np.array(indices)]
    turned = (np.roll(face, -face.argmin()) for face in corners.reshape(-1, 3))
    return {tuple(face.tolist()) for face in turned}


def test_the_json_form_and_lines(server: str, stage: Stage) -> None:
    both = "overlays=control_net&quantize=true&compression=meshopt"
    stage.show(f"{server}/v1/surfaces/utah-teapot/mesh.gltf?resolution=4&{both}")
    (net,) = stage.lines()
    stage.show(f"{server}/v1/surfaces/utah-teapot/mesh.glb?resolution=4&overlays=control_net")
    (expected,) = stage.lines()
    assert net["segments"] == expected["segments"]
    assert len(net["positions"]) == len(expected["positions"])
