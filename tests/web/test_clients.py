"""The pages of `docs/browser.md` load a stored surface by its URL from another origin. Their
libraries then have the numbers of the service's JSON."""

import json
from dataclasses import dataclass
from time import monotonic
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser

from tests.programs import find_program
from tests.test_readme import run_shell
from tests.web.browser import Stage
from tests.web.clients import (
    LIBRARIES,
    MODEL,
    SERVED_AT,
    TRIED,
    open_blank_page,
    read_blocks,
    read_meshes,
    read_page,
    serve_site,
    to_linear,
    turn_upright,
    visit,
)

RESOLUTION = 32


@pytest.fixture(scope="module")
def stored(server: str, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The response to the first command of docs/browser.md, which stores a surface."""
    find_program("curl")
    command = read_blocks("sh")[0].replace(SERVED_AT, server)
    response: dict[str, Any] = json.loads(run_shell(command, tmp_path_factory.mktemp("stored")))
    return response


@pytest.fixture(scope="module")
def computed(server: str, stored: dict[str, Any]) -> dict[str, Any]:
    """The mesh in the service's JSON."""
    response = httpx.get(f"{server}{stored['links']['mesh']['json']}&resolution={RESOLUTION}")
    mesh: dict[str, Any] = response.raise_for_status().json()
    return mesh


@dataclass(frozen=True)
class Drawn:
    """The mesh as a library read it, its picture, and the library's warnings."""

    mesh: dict[str, Any]
    picture: NDArray[np.int64]
    complaints: list[str]


def wait_for_picture(stage: Stage) -> NDArray[np.int64]:
    """Waits until the picture is not blank and does not change, and returns it."""
    deadline = monotonic() + 20
    before, picture = stage.picture(), stage.picture()
    while (not np.ptp(picture) or np.any(picture != before)) and monotonic() < deadline:
        before, picture = picture, stage.picture()
    return picture


@pytest.fixture(scope="module", params=TRIED)
def drawn(
    request: pytest.FixtureRequest, server: str, stored: dict[str, Any], browser: Browser
) -> Drawn:
    """The page of the documentation, opened for the first time."""
    page = read_page(request.param).replace(SERVED_AT, server)
    assert stored["id"] in page
    with serve_site({"/": page}) as origin:
        stage = open_blank_page(browser, pixels=True)
        visit(stage, f"{origin}/")
        (mesh,) = read_meshes(stage)
        picture = wait_for_picture(stage)
        stage.page.close()
    return Drawn(mesh, picture, stage.complaints)


def test_the_surface_is_stored_as_the_page_shows(stored: dict[str, Any]) -> None:
    assert stored == json.loads(read_blocks("json")[0])


def test_the_pages_load_stored_meshes(stored: dict[str, Any]) -> None:
    link = SERVED_AT + stored["links"]["mesh"]["glb"]
    expected = link.replace("?", f"?resolution={RESOLUTION}&")
    assert [MODEL.findall(read_page(library)) for library in LIBRARIES] == [[expected]] * 3


def test_positions_and_triangles_are_those_of_the_service(
    drawn: Drawn, computed: dict[str, Any]
) -> None:
    np.testing.assert_allclose(
        drawn.mesh["positions"], turn_upright(computed["vertices"]), atol=1e-6
    )
    assert np.reshape(drawn.mesh["triangles"], (-1, 3)).tolist() == computed["faces"]


def test_normals_are_those_of_the_service(drawn: Drawn, computed: dict[str, Any]) -> None:
    np.testing.assert_allclose(drawn.mesh["normals"], turn_upright(computed["normals"]), atol=1e-6)


def test_colours_are_those_of_the_service_and_linear(
    drawn: Drawn, computed: dict[str, Any]
) -> None:
    colors = np.array(drawn.mesh["colors"])[:, :3]
    assert np.ptp(colors, axis=0).min() > 0.1
    np.testing.assert_allclose(colors, to_linear(np.array(computed["colors"])), atol=1e-6)


def test_it_is_drawn_in_its_colours_without_warnings(drawn: Drawn) -> None:
    """On a white page, a part of the picture is mainly red, and another mainly blue."""
    rgb = drawn.picture
    covered = np.ptp(rgb, axis=1) > 40
    warm = rgb[:, 0] > rgb[:, 2] + 60
    cold = rgb[:, 2] > rgb[:, 0] + 40
    assert covered.mean() > 0.05
    assert warm.mean() > 0.01
    assert cold.mean() > 0.01
    assert drawn.complaints == []
