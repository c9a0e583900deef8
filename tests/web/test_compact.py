"""Compact glTF in three.js and Babylon.js: the same mesh and the same picture as plain glTF."""

import base64
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from service.engine.stored_positions import MAX_STEPS
from tests.web.clients import TESTED_LIBRARIES, serve_site, visit, write_client
from tests.web.pictures import compare_pictures
from tools.browser import FILL_PIXELS_SCRIPT, Stage

pytest.importorskip("meshopt")

SURFACE = "/v1/surfaces/bourke-1111-colors/mesh.glb?resolution=24,20"
FORMS = {
    "plain": "",
    "both": "&quantize=true&compression=meshopt",
}
# `make test-libraries` also tests each option alone; tests/encoders/gltf/ tests the bytes.
if len(TESTED_LIBRARIES) > 1:
    FORMS |= {"quantized": "&quantize=true", "compressed": "&compression=meshopt"}
FRAMES = """<!doctype html><title>Forms</title><link rel="icon" href="data:,">
<style>body { margin: 0 } iframe { border: 0; width: 240px; height: 160px; float: left }</style>
"""
MAX_NORMAL_ERROR = {"quantized": 0.002, "compressed": 0.001, "both": 0.1}
"""The largest error of normals in degrees, including the float32 of the libraries.

Quantized normals have 16 bits, and 12 if they are also compressed; compression alone keeps float32.
"""

STEP = 2.0**-13
"""The step of the grid to which quantization rounds: the least power of two for which the surface,
which is 5 units long, has at most `MAX_STEPS` steps."""
assert STEP / 2 < 5 / MAX_STEPS <= STEP

MAX_MOVE = 3**0.5 / 2 * STEP
"""The largest distance by which quantization moves a vertex: half of the diagonal of a cell."""


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
"""Script that waits until the page is drawn; returns the canvas of Babylon.js, else an empty text.

A screenshot of Babylon.js would show its loading screen, which fades out slowly.
"""

Pictures = dict[str, tuple[Any, bytes]]
"""The mesh, as a library read it, and its picture as a PNG file, by the name of the form."""


@pytest.fixture(
    scope="module", params=[each for each in TESTED_LIBRARIES if each != "model-viewer"]
)
def pictures(request: pytest.FixtureRequest, server: str, visitor: Stage) -> Pictures:
    """The surface in all forms, each in a frame of one page."""
    pages = {
        f"/{name}": write_client(request.param, server + SURFACE + FORMS[name]) for name in FORMS
    }
    frames = "".join(f'<iframe name="{name}" src="{name}"></iframe>' for name in FORMS)
    pictures: Pictures = {}
    with serve_site({"/": FRAMES + frames, **pages}) as origin:
        visit(visitor, f"{origin}/", width=480, height=320)
        page = visitor.page
        for frame in page.frames[1:]:
            frame.wait_for_function("window.readMeshes().length > 0")
            (mesh,) = frame.evaluate("window.readMeshes()")
            # Other tests need no pictures, so the page of `visitor` draws none before this script.
            frame.evaluate(FILL_PIXELS_SCRIPT)
            canvas = base64.b64decode(frame.evaluate(PICTURE))
            pictures[frame.name] = mesh, canvas or frame.frame_element().screenshot()
            # To save time, Chromium need not draw this frame any more.
            visitor.page.evaluate(
                "name => document.getElementsByName(name)[0].remove()", frame.name
            )
        assert visitor.messages == []
    return pictures


@pytest.mark.parametrize("form", [name for name in FORMS if name != "plain"])
def test_compact_forms_give_the_same_mesh_and_picture(
    pictures: Pictures, form: str, viewer: Stage
) -> None:
    (expected, expected_picture), (mesh, picture) = pictures["plain"], pictures[form]
    positions = np.array(expected["positions"])
    moves, rows = cKDTree(positions).query(mesh["positions"])
    assert sorted(rows.tolist()) == list(range(len(positions)))
    assert moves.max() <= (MAX_MOVE if "quantize" in FORMS[form] else 0) + 1e-6
    normals = [np.array(each["normals"]) for each in (expected, mesh)]
    chords = np.linalg.norm(normals[0][rows] - normals[1], axis=1)
    assert np.degrees(2 * np.arcsin(chords / 2)).max() < MAX_NORMAL_ERROR[form]
    colors = [np.array(each["colors"])[:, :3] for each in (expected, mesh)]
    assert np.abs(colors[0][rows] - colors[1]).max() < 1e-5
    assert list_faces(mesh["triangles"], rows) == list_faces(expected["triangles"], None)
    difference = compare_pictures(viewer, expected_picture, picture)
    # Steps of 1/255: a picture that differs visibly has more and larger differences.
    assert difference.covered > 0.02
    assert difference.mean < 0.1
    assert difference.different < 0.002
    assert difference.largest == 0 or "quantize" in FORMS[form]


def list_faces(indices: list[int], rows: Any) -> set[tuple[int, ...]]:
    """The triangles as vertices of the plain mesh; each begins with its lowest vertex.

    `rows` maps each vertex of the mesh to the vertex of the plain mesh; for the plain mesh itself
    it is None.
    """
    corners = np.array(indices) if rows is None else rows[np.array(indices)]
    faces = (np.roll(face, -face.argmin()) for face in corners.reshape(-1, 3))
    return {tuple(face.tolist()) for face in faces}


def test_three_reads_lines_of_a_compact_gltf(server: str, stage: Stage) -> None:
    options = "overlays=control_net&quantize=true&compression=meshopt"
    stage.show(f"{server}/v1/surfaces/utah-teapot/mesh.gltf?resolution=4&{options}")
    (net,) = stage.read_lines()
    stage.show(f"{server}/v1/surfaces/utah-teapot/mesh.glb?resolution=4&overlays=control_net")
    (expected,) = stage.read_lines()
    assert net["segments"] == expected["segments"]
    assert len(net["positions"]) == len(expected["positions"])
