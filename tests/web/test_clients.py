"""The pages of `docs/browser.md` load a mesh by URL from another origin, and draw it.

The numbers that each page's library then has are those of the same mesh as JSON.
"""

import json
from dataclasses import dataclass
from time import monotonic
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser

from tests.test_readme import run_shell
from tests.web.clients import (
    LIBRARIES,
    MODEL,
    SERVED_AT,
    TESTED_LIBRARIES,
    open_blank_page,
    read_blocks,
    read_meshes,
    read_page,
    serve_site,
    to_linear,
    turn_upright,
    visit,
)
from tools.browser import Stage
from tools.programs import find_program

RESOLUTION = 32


@pytest.fixture(scope="module")
def stored_surface(server: str, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The response to the first command of docs/browser.md, which stores a surface."""
    find_program("curl")
    command = read_blocks("sh")[0].replace(SERVED_AT, server)
    response: dict[str, Any] = json.loads(run_shell(command, tmp_path_factory.mktemp("stored")))
    return response


@pytest.fixture(scope="module")
def json_mesh(server: str, stored_surface: dict[str, Any]) -> dict[str, Any]:
    """The mesh of the stored surface as JSON."""
    response = httpx.get(
        f"{server}{stored_surface['links']['mesh']['json']}&resolution={RESOLUTION}"
    )
    mesh: dict[str, Any] = response.raise_for_status().json()
    return mesh


@dataclass(frozen=True)
class DrawnMesh:
    """A mesh as a library read it, the picture of the page, and the messages in the console."""

    mesh: dict[str, Any]
    picture: NDArray[np.int64]
    messages: list[str]


def wait_for_picture(stage: Stage) -> NDArray[np.int64]:
    """The picture of the page, when it is not blank and does not change any more."""
    deadline = monotonic() + 20
    earlier_picture, picture = stage.take_picture(), stage.take_picture()
    while (not np.ptp(picture) or np.any(picture != earlier_picture)) and monotonic() < deadline:
        earlier_picture, picture = picture, stage.take_picture()
    return picture


@pytest.fixture(scope="module", params=TESTED_LIBRARIES)
def drawn_mesh(
    request: pytest.FixtureRequest, server: str, stored_surface: dict[str, Any], browser: Browser
) -> DrawnMesh:
    """The mesh on the page of a library, which loads the mesh of the stored surface."""
    page = read_page(request.param).replace(SERVED_AT, server)
    assert stored_surface["id"] in page
    with serve_site({"/": page}) as origin:
        stage = open_blank_page(browser, has_pictures=True)
        visit(stage, f"{origin}/")
        (mesh,) = read_meshes(stage)
        picture = wait_for_picture(stage)
        stage.page.close()
    return DrawnMesh(mesh, picture, stage.messages)


def test_the_surface_is_stored_as_the_page_shows(stored_surface: dict[str, Any]) -> None:
    assert stored_surface == json.loads(read_blocks("json")[0])


def test_the_pages_have_the_url_of_the_stored_mesh(stored_surface: dict[str, Any]) -> None:
    link = SERVED_AT + stored_surface["links"]["mesh"]["glb"]
    expected = link.replace("?", f"?resolution={RESOLUTION}&")
    for library in LIBRARIES:
        assert MODEL.findall(read_page(library)) == [expected], library


def test_positions_and_triangles_are_as_in_json(
    drawn_mesh: DrawnMesh, json_mesh: dict[str, Any]
) -> None:
    np.testing.assert_allclose(
        drawn_mesh.mesh["positions"], turn_upright(json_mesh["vertices"]), atol=1e-6
    )
    assert np.reshape(drawn_mesh.mesh["triangles"], (-1, 3)).tolist() == json_mesh["faces"]


def test_normals_are_as_in_json(drawn_mesh: DrawnMesh, json_mesh: dict[str, Any]) -> None:
    np.testing.assert_allclose(
        drawn_mesh.mesh["normals"], turn_upright(json_mesh["normals"]), atol=1e-6
    )


def test_colours_are_as_in_json_and_linear(
    drawn_mesh: DrawnMesh, json_mesh: dict[str, Any]
) -> None:
    colors = np.array(drawn_mesh.mesh["colors"])[:, :3]
    assert np.ptp(colors, axis=0).min() > 0.1
    np.testing.assert_allclose(colors, to_linear(np.array(json_mesh["colors"])), atol=1e-6)


def test_the_mesh_is_drawn_in_its_colours_without_messages(drawn_mesh: DrawnMesh) -> None:
    """The page is white; a part of the picture is mainly red, and another part mainly blue."""
    rgb = drawn_mesh.picture
    is_colored = np.ptp(rgb, axis=1) > 40
    is_red = rgb[:, 0] > rgb[:, 2] + 60
    is_blue = rgb[:, 2] > rgb[:, 0] + 40
    assert is_colored.mean() > 0.05
    assert is_red.mean() > 0.01
    assert is_blue.mean() > 0.01
    assert drawn_mesh.messages == []
