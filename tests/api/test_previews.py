"""Previews of shared links: the tags from which other sites draw a card with a picture."""

import re
from collections.abc import Iterator
from html import unescape
from io import BytesIO
from urllib.parse import quote, urlsplit

import numpy as np
import pytest
from PIL import Image
from pydantic import SecretStr

from service.api import page_files, previews
from service.api.app import create_app
from service.engine.mesh.mesh import ENGINE
from service.errors import StoreFailed
from service.settings.values import Settings
from service.storage.store import SurfaceStore
from tools.client import Client, start_client

pytestmark = pytest.mark.skipif(
    not page_files.Bundles.read(page_files.STATIC).files,
    reason="the scripts of the page are not built ('make web')",
)

NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]
PICTURE = f"image.png?width=1200&height=630&background=f4f1ec&engine={ENGINE}"
HOSTILE = "\"><script src=//evil.example></script>'&amp;</title>$style ’ü"


def read_tags(client: Client, path: str, headers: dict[str, str] | None = None) -> dict[str, str]:
    """The tags of the preview in a page, by name; `og:` is left out."""
    response = client.get(path, {"Host": "shapes.example"} | (headers or {}))
    assert response.status_code == 200
    head = response.text.partition("</head>")[0]
    tags = re.findall(r'<meta (?:property|name)="((?:og|twitter):[\w:]+)" content="(.*?)">', head)
    return {name.removeprefix("og:"): unescape(text) for name, text in tags}


def embed(path: str) -> str:
    """The path of the view that shows a mesh."""
    return f"/embed?src={quote(path, safe='')}"


def store(client: Client, name: str, **fields: object) -> str:
    surface = {"name": name, "control_net": NET} | fields
    return str(client.post("/v1/surfaces", {"surface": surface}).json()["id"])


@pytest.mark.parametrize(
    ("path", "surface", "title"),
    [
        ("/", "utah-teapot", "Utah teapot"),
        ("/?surface=saddle&resolution=9", "saddle", "Saddle"),
        (embed("/v1/surfaces/saddle/mesh.glb"), "saddle", "Saddle"),
        (embed("/v1/surfaces/saddle/mesh.glb?resolution=8&engine=4"), "saddle", "Saddle"),
    ],
)
def test_a_page_names_the_picture_of_its_surface(
    client: Client, path: str, surface: str, title: str
) -> None:
    tags = read_tags(client, path)
    assert tags["image"] == f"http://shapes.example/v1/surfaces/{surface}/{PICTURE}"
    assert tags["title"] == tags["image:alt"] == title
    assert tags["twitter:card"] == "summary_large_image"
    assert len(tags["description"]) > 20
    assert "`" not in tags["description"]


def test_the_picture_exists_in_the_size_that_the_page_says(client: Client) -> None:
    tags = read_tags(client, "/?surface=saddle")
    url = urlsplit(tags["image"])
    picture = client.get(f"{url.path}?{url.query}")
    assert (picture.status_code, picture.headers["content-type"]) == (200, tags["image:type"])
    # The address in the tag is the canonical one.
    assert picture.headers["link"] == f'<{url.path}?{url.query}>; rel="canonical"'
    with Image.open(BytesIO(picture.content)) as image:
        assert image.size == (int(tags["image:width"]), int(tags["image:height"]))
        assert np.asarray(image.convert("RGBA"))[..., 3].min() == 255  # nothing is transparent


def test_a_stored_surface_has_a_preview_with_its_name(client: Client) -> None:
    id = store(client, HOSTILE)
    for path in (f"/?surface={id}", embed(f"/v1/surfaces/{id}/mesh.glb")):
        tags = read_tags(client, path)
        assert tags["title"] == HOSTILE
        assert tags["image"] == f"http://shapes.example/v1/surfaces/{id}/{PICTURE}"
        page = client.get(path).text
        assert "evil.example>" not in page
        # The name adds no tag to the page, in any quotes.
        assert re.findall(r"<script(?![^>]* src=\"page/)|<style|\sstyle=", page) == []
        assert page.count("</title>") == 1


@pytest.mark.parametrize(
    "surface", ["none", "0" * 64, "A" * 64, '"><script>', "../docs", "", "saddle/../torus", "é"]
)
def test_an_unknown_surface_has_no_preview(client: Client, surface: str) -> None:
    paths = [f"/?surface={quote(surface, safe='')}", embed(f"/v1/surfaces/{surface}/mesh.glb")]
    for path in paths:
        assert read_tags(client, path) == {}


@pytest.mark.parametrize(
    "src",
    [
        *("", "/v1/surfaces/saddle/mesh.stl", "//evil.example/v1/surfaces/saddle/mesh.glb"),
        *("https://evil.example/v1/surfaces/saddle/mesh.glb", "/v1/surfaces/saddle/mesh.glb/x"),
    ],
)
def test_the_view_has_a_preview_only_of_meshes_of_this_service(client: Client, src: str) -> None:
    assert read_tags(client, embed(src)) == {}


def test_the_name_of_a_large_surface_is_not_read(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    id = store(client, "large")
    monkeypatch.setattr(previews, "MAX_BYTES", 100)
    tags = read_tags(client, f"/?surface={id}")
    assert tags["title"] == "A surface"
    assert id in tags["image"]


@pytest.fixture(scope="module")
def proxied() -> Iterator[Client]:
    """A service behind a proxy with https that it trusts, below a path."""
    app = create_app(Settings(trusted_proxies=("127.0.0.0/8",)))
    app.root_path = "/shapes"
    with start_client(app) as client:
        yield client


def test_addresses_have_the_scheme_of_the_proxy_and_the_path_of_the_service(
    proxied: Client,
) -> None:
    https = {"X-Forwarded-Proto": "https", "X-Forwarded-For": "192.0.2.1"}
    for path in ("/?surface=saddle", embed("/shapes/v1/surfaces/saddle/mesh.glb")):
        tags = read_tags(proxied, path, https)
        assert tags["image"] == f"https://shapes.example/shapes/v1/surfaces/saddle/{PICTURE}"


@pytest.mark.parametrize("host", ["a b", 'x"><script>', "x/y", "x@y", "", "x:port", "[::1"])
def test_without_a_valid_host_there_is_no_preview(client: Client, host: str) -> None:
    assert read_tags(client, "/?surface=saddle", {"Host": host}) == {}


def test_a_service_with_private_reads_tells_nothing_about_its_surfaces() -> None:
    settings = Settings(public_reads=False, signing_keys=(SecretStr("0123456789abcdef" * 2),))
    with start_client(create_app(settings)) as client:
        id = store(client, "secret")
        for path in ("/", "/?surface=saddle", f"/?surface={id}"):
            assert read_tags(client, path) == {}
            assert "secret" not in client.get(path).text


def test_a_page_is_asked_for_again_and_differs_by_surface_and_host(client: Client) -> None:
    id = store(client, "kept")
    pages = [
        client.get(path, {"Host": host, "Accept-Encoding": coding})
        for path in ("/?surface=saddle", f"/?surface={id}")
        for host in ("a.example", "b.example")
        for coding in ("identity", "gzip")
    ]
    assert len({page.headers["etag"] for page in pages}) == len(pages)
    assert {page.headers["cache-control"] for page in pages} == {"no-cache"}
    policies = {page.headers["content-security-policy"] for page in pages}
    assert policies == {page_files.EDITOR_HEADERS["Content-Security-Policy"]}
    unchanged = client.get(
        f"/?surface={id}", {"Host": "b.example", "If-None-Match": pages[-2].headers["etag"]}
    )
    assert unchanged.status_code == 304


def test_the_page_is_served_if_the_store_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """The page asks for the surface itself, and then says what is wrong."""

    async def fail(*_: object) -> bytes:
        raise StoreFailed

    with start_client(create_app(Settings())) as client:
        id = store(client, "away")
        monkeypatch.setattr(SurfaceStore, "get", fail)
        assert read_tags(client, f"/?surface={id}") == {}
