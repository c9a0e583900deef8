"""Compact glTF in three.js and Babylon.js: the same mesh, and the same picture."""

import base64
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser
from scipy.spatial import cKDTree

from service.engine.grid import CORNER
from tests.web.browser import Stage
from tests.web.clients import client, held, open_client, site
from tests.web.pictures import difference

pytest.importorskip("meshopt")

SURFACE = "/v1/surfaces/bourke-1111-colors/mesh.glb?resolution=24,20"
FORMS = {
    "quantized": "quantize=true",
    "compressed": "compression=meshopt",
    "both": "quantize=true&compression=meshopt",
}
NORMAL = {"quantized": 0.002, "compressed": 0.001, "both": 0.1}
"""Degrees that normals may be off, the float32 of the libraries included."""

MOVED = 2.0**-13 * CORNER
"""How far the grid may move a vertex: the surface is 5 units long."""


class Shown:
    """What a library made of a file."""

    def __init__(self, browser: Browser, library: str, model: str) -> None:
        with site({"/": client(library, model)}) as origin:
            stage = open_client(browser, f"{origin}/")
            (self.mesh,) = held(stage)
            canvas = base64.b64decode(stage.page.evaluate(PICTURE))
            self.picture = canvas or stage.page.screenshot()
            self.complaints = stage.complaints
            stage.page.close()


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
"""The canvas of Babylon.js, before which a curtain is still fading; else nothing, once drawn."""


@pytest.fixture(scope="module", params=["three", "babylon"])
def plain(request: pytest.FixtureRequest, server: str, browser: Browser) -> tuple[str, Shown]:
    """A library, and what it holds of the surface in float32."""
    return request.param, Shown(browser, request.param, server + SURFACE)


@pytest.mark.parametrize("form", FORMS)
def test_libraries_hold_and_draw_the_same(
    plain: tuple[str, Shown], form: str, server: str, browser: Browser, viewer: Stage
) -> None:
    library, wanted = plain
    found = Shown(browser, library, f"{server}{SURFACE}&{FORMS[form]}")
    assert found.complaints == []
    places = np.array(wanted.mesh["positions"])
    moved, rows = cKDTree(places).query(found.mesh["positions"])
    assert sorted(rows.tolist()) == list(range(len(places)))
    assert moved.max() <= (MOVED if "quantize" in FORMS[form] else 0) + 1e-6
    normals = [np.array(mesh["normals"]) for mesh in (wanted.mesh, found.mesh)]
    apart = np.linalg.norm(normals[0][rows] - normals[1], axis=1)
    assert np.degrees(2 * np.arcsin(apart / 2)).max() < NORMAL[form]
    colors = [np.array(mesh["colors"])[:, :3] for mesh in (wanted.mesh, found.mesh)]
    assert np.abs(colors[0][rows] - colors[1]).max() < 1e-5
    assert faces(found.mesh["triangles"], rows) == faces(wanted.mesh["triangles"], None)
    unlike = difference(viewer, wanted.picture, found.picture)
    assert unlike.inside > 0.02
    assert unlike.mean < 0.1
    assert unlike.apart < 0.002
    assert unlike.most == 0 or "quantize" in FORMS[form]


def faces(indices: list[int], rows: Any) -> set[tuple[int, ...]]:
    """Triangles by the vertices of the plain mesh, each from the least of them on."""
    corners = np.array(indices) if rows is None else rows[np.array(indices)]
    turned = (np.roll(face, -face.argmin()) for face in corners.reshape(-1, 3))
    return {tuple(face.tolist()) for face in turned}
