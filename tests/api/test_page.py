"""The pages of the editor and of Swagger UI; the service without their scripts."""

import json
import re
from html import unescape
from pathlib import Path

import pytest

from service.api.app import create_app
from service.api.routes import pages
from service.decoders.registry import BY_SUFFIX
from service.settings.values import Settings
from service.surface.examples.catalogue import EXAMPLES
from tools.client import Client, start_client

MAIN = "page/main.js"
FILES = pages.files(dict)
"""All static files by name; `dict` stands for the function that makes the OpenAPI document."""

needs_three = pytest.mark.skipif(
    not (pages.STATIC / pages.THREE).is_file(), reason="three.js is not built ('make web')"
)


@needs_three
def test_all_files_of_the_page_come_from_this_service(client: Client) -> None:
    """All URLs are relative, so that the page works behind any prefix."""
    response = client.get("/")
    assert response.status_code == 200
    assert response.headers["content-type"] == "text/html; charset=utf-8"
    sources = re.findall(r'(?:src|href)="([^"#]+)"', response.text)
    assert {MAIN, "page/style.css", "page/three.js", "docs"} <= set(sources)
    for source in sources:
        assert not source.startswith(("/", "http"))
        assert client.get(f"/{source}").status_code == 200, source


@needs_three
def test_the_content_security_policy_allows_only_this_service(client: Client) -> None:
    response = client.get("/")
    policy = dict(
        directive.strip().split(" ", 1)
        for directive in response.headers["content-security-policy"].split(";")
    )
    assert policy["default-src"] == "'none'"
    for directive in ("script-src", "style-src", "connect-src"):
        assert policy[directive] == "'self'"
    for directive in ("base-uri", "form-action", "frame-ancestors"):
        assert policy[directive] == "'none'"
    assert response.headers["x-content-type-options"] == "nosniff"
    assert response.headers["referrer-policy"] == "no-referrer"
    # The policy forbids inline scripts and inline styles, so the page must have none.
    assert re.findall(r"<script(?![^>]* src=)|<style|\sstyle=|\son\w+=", response.text) == []


@needs_three
def test_the_page_lists_all_modules_and_file_types(client: Client) -> None:
    """The list of modules lets the browser fetch all of them at once."""
    text = client.get("/").text
    preloaded = re.findall(r'<link rel="modulepreload" href="([^"]+)">', text)
    assert preloaded == sorted({name for name in FILES if re.match(r"page/.*\.js", name)} - {MAIN})
    (accepted,) = re.findall(r'type="file" accept="([^"]+)"', text)
    (media_types,) = re.findall(r'data-media-types="([^"]+)"', text)
    expected = {suffix: decoder.media_type for suffix, decoder in BY_SUFFIX.items()}
    # Files of the teapot often have the suffix `.txt`.
    assert json.loads(unescape(media_types)) == expected | {"txt": "text/x-teapot"}
    assert accepted.split(",") == [".json", *(f".{suffix}" for suffix in expected), ".txt"]


def test_every_example_has_a_thumbnail(client: Client) -> None:
    assert {path.stem for path in pages.THUMBNAILS.iterdir()} == set(EXAMPLES)
    pictures = [client.get(f"/page/{name}.webp") for name in EXAMPLES]
    assert {picture.headers["content-type"] for picture in pictures} == {"image/webp"}
    # Bytes 8 to 11 of a WebP file.
    assert {picture.content[8:12] for picture in pictures} == {b"WEBP"}
    assert sum(len(picture.content) for picture in pictures) < 100_000


def test_modules_are_short_and_begin_with_a_comment() -> None:
    for path in pages.PAGE.glob("*.js"):
        lines = path.read_text(encoding="utf-8").splitlines()
        assert len(lines) <= 250, (
            f"{path.name} has more than 250 lines; move a part to another module"
        )
        assert lines[0].startswith("// "), path.name


@pytest.mark.parametrize(
    "url",
    [
        *("/page/..%2fpage.py", "/page/index.html", "/page/LICENSE", "/page/three.d.ts"),
        *("/docs/..%2f..%2fapp.py", "/docs/LICENSE", "/docs/swagger-ui.css.map"),
    ],
)
def test_other_files_are_not_served(client: Client, url: str) -> None:
    assert client.get(url).status_code == 404


def test_all_files_of_swagger_ui_come_from_this_service(client: Client) -> None:
    page = client.get("/docs")
    assert page.status_code == 200
    icon, *sources = re.findall(r'(?:src|href)="([^"]+)"', page.text)
    assert icon == "data:,"  # so that the browser does not ask for `/favicon.ico`
    assert sources
    for source in sources:
        assert source.startswith("docs/")
        assert client.get(f"/{source}").status_code == 200
    assert "<script>" not in page.text
    assert "script-src 'self';" in page.headers["content-security-policy"]


def test_pages_without_their_scripts_name_the_command_to_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pages, "STATIC", tmp_path)
    with start_client(create_app(Settings())) as client:
        for url in ("/", "/docs"):
            response = client.get(url)
            assert response.status_code == 503
            assert "make web" in response.text
        for url in ("/page/three.js", "/docs/swagger-ui.css"):
            assert client.get(url).status_code == 404
        for url in ("/v1/formats", "/openapi.json"):
            assert client.get(url).status_code == 200
