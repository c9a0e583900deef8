"""three.js, model-viewer and Babylon.js, as `docs/browser.md` has them, load a surface by its URL
from another origin, and hold what the service computed: the mesh as JSON, number by number."""

from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser

from tests.web.clients import LIBRARIES, client, held, open_client, site

# A surface of four colours that stands upright along z, at a resolution of two numbers.
SURFACE = "/v1/surfaces/bourke-1111-colors"
OPTIONS = "resolution=6,4"


@pytest.fixture(scope="module")
def computed(server: str) -> dict[str, Any]:
    """The mesh as the service answers it in JSON."""
    answer = httpx.get(f"{server}{SURFACE}/mesh.json?{OPTIONS}").raise_for_status()
    mesh: dict[str, Any] = answer.json()
    return mesh


@pytest.fixture(scope="module", params=LIBRARIES)
def drawn(request: pytest.FixtureRequest, server: str, browser: Browser) -> Iterator[Any]:
    """What a library holds of the mesh, and what the console of its page had to say."""
    page = client(request.param, f"{server}{SURFACE}/mesh.glb?{OPTIONS}")
    with site({"/": page}) as origin:
        stage = open_client(browser, f"{origin}/")
        (mesh,) = held(stage)
        yield mesh, stage.complaints
        stage.page.close()


def upright(rows: list[list[float]]) -> NDArray[np.float64]:
    """Points whose third coordinate points up, as glTF has them: (x, y, z) → (x, z, −y)."""
    x, y, z = np.array(rows).T
    return np.stack([x, z, -y], axis=1)


def linear(srgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """IEC 61966-2-1: the light that a value of sRGB stands for."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def test_the_console_stays_silent(drawn: Any) -> None:
    _, complaints = drawn
    assert complaints == []


def test_positions_and_triangles_are_those_of_the_service(
    drawn: Any, computed: dict[str, Any]
) -> None:
    mesh, _ = drawn
    np.testing.assert_allclose(mesh["positions"], upright(computed["vertices"]), atol=1e-6)
    assert np.reshape(mesh["triangles"], (-1, 3)).tolist() == computed["faces"]


def test_normals_are_those_of_the_service(drawn: Any, computed: dict[str, Any]) -> None:
    mesh, _ = drawn
    np.testing.assert_allclose(mesh["normals"], upright(computed["normals"]), atol=1e-6)


def test_colours_are_those_of_the_service_and_linear(drawn: Any, computed: dict[str, Any]) -> None:
    mesh, _ = drawn
    colors = np.array(mesh["colors"])[:, :3]
    assert np.ptp(colors, axis=0).min() > 0.1
    np.testing.assert_allclose(colors, linear(np.array(computed["colors"])), atol=1e-6)
