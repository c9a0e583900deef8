"""The pages of the editor and of Swagger UI; the service without their scripts."""

import json
import re
from html import unescape
from pathlib import Path
from urllib.parse import quote

import pytest
from pydantic import SecretStr

from service.api import page_files
from service.api.app import create_app
from service.decoders.mesh_registry import MESH_BY_SUFFIX
from service.decoders.registry import BY_SUFFIX
from service.settings.values import Settings
from tools import page_build
from tools.client import Client, start_client
from tools.page_build import hash_source, need_bundles

FILES = page_files.list_files(dict, Settings())
"""All static files by name; `dict` stands for the function that makes the OpenAPI document."""

MAX_SCRIPT_BYTES = 240_000
"""Most bytes of the scripts and styles of the first picture in gzip, the longer of two codings."""

BUNDLES = page_files.Bundles.read(page_files.STATIC)

needs_bundles = pytest.mark.skipif(
    not BUNDLES.files, reason="the scripts of the page are not built ('make web')"
)


@needs_bundles
def test_the_bundles_are_made_of_the_sources_as_they_are() -> None:
    need_bundles()


def test_old_bundles_are_noticed_by_the_content_of_their_sources(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A changed and a missing source are named, an equal one is not."""
    manifest = tmp_path / "manifest.json"
    sources = {"a.js": hash_source(tmp_path / "none"), "b.js": "", "c.js": "0" * 64}
    manifest.write_text(json.dumps({"sources": sources}))
    for name in ("b.js", "c.js"):
        (tmp_path / name).write_text(name)
    monkeypatch.setattr(page_build, "MANIFEST", manifest)
    monkeypatch.setattr(page_build, "ROOT", tmp_path)
    assert page_build.find_changed_sources() == ["b.js", "c.js"]
    with pytest.raises(pytest.fail.Exception, match=r"Run 'make web' .* Changed: b\.js, c\.js\."):
        need_bundles()


@needs_bundles
def test_all_files_of_the_page_come_from_this_service(client: Client) -> None:
    """All URLs are relative, so that the page works behind any prefix."""
    response = client.get("/")
    assert response.status_code == 200
    assert response.headers["content-type"] == "text/html; charset=utf-8"
    sources = re.findall(r'(?:src|href)="([^"#]+)"', response.text)
    assert {*map(BUNDLES.url, ("main.js", "page.css", "icon.svg")), "docs"} <= set(sources)
    for source in sources:
        assert not source.startswith(("/", "http"))
        assert client.get(f"/{source}").status_code == 200, source


@needs_bundles
def test_browsers_keep_bundles_for_ever_and_ask_for_the_page_again(client: Client) -> None:
    """The page names its bundles by hashes of their contents; both have entity tags."""
    page = client.get("/")
    assert page.headers["cache-control"] == "no-cache"
    assert client.get("/", {"If-None-Match": page.headers["etag"]}).status_code == 304
    for name in BUNDLES.names:
        assert re.fullmatch(r"[\w-]+-[0-9A-Z]{8}\.(js|css|svg)", name), name
        kept = client.get(f"/page/{name}")
        assert kept.headers["cache-control"] == "public, max-age=31536000, immutable"
        tag = {"If-None-Match": kept.headers["etag"]}
        assert client.get(f"/page/{name}", tag).status_code == 304
    assert client.get("/docs/start.js").headers["cache-control"] == "no-cache"


@needs_bundles
def test_the_first_picture_needs_few_bytes_of_scripts_and_styles(client: Client) -> None:
    """Two scripts and one style, compressed; what is needed at once is fetched at once.

    The second script has what files that are opened need, too; their own code is loaded later.
    """
    scripts = ["meshopt.js"] if page_files.COMPRESSIONS else []
    imports = BUNDLES.files["main.js"]["imports"]
    names = {BUNDLES.url(name) for name in ("main.js", "page.css", *scripts)}
    names |= {f"page/{name}" for name in imports}
    responses = [client.get(f"/{name}", {"Accept-Encoding": "gzip"}) for name in names]
    assert sum(int(each.headers["content-length"]) for each in responses) < MAX_SCRIPT_BYTES
    page = client.get("/").text
    preloaded = re.findall(r'<link rel="modulepreload" href="page/([^"]+)">', page)
    assert preloaded == [*imports, *(BUNDLES.files[name]["file"] for name in scripts)]
    assert len(names) <= 5


@needs_bundles
def test_the_browser_asks_for_an_example_while_the_scripts_are_on_their_way() -> None:
    """Only for names of examples, and only if reading them needs no key."""

    def list_asked(client: Client, query: str) -> list[str]:
        return re.findall(r'<link rel="preload" as="fetch" crossorigin href="([^"]+)">',
                          client.get(f"/{query}").text)  # fmt: skip

    main = (page_files.PAGE / "main.js").read_text(encoding="utf-8")
    assert f"FIRST_SURFACE = '{page_files.FIRST_SURFACE}'" in main
    settings = Settings(public_reads=False, signing_keys=(SecretStr("0123456789abcdef" * 2),))
    with start_client(create_app(Settings())) as client:
        assert list_asked(client, "") == ["v1/surfaces", "v1/surfaces/utah-teapot"]
        saddle = ["v1/surfaces", "v1/surfaces/saddle"]
        assert list_asked(client, "?surface=saddle&look=mean") == saddle
        for name in ("none", "0" * 64, '"><script>', "../docs", ""):
            assert list_asked(client, f"?surface={quote(name)}") == []
    with start_client(create_app(settings)) as client:
        assert list_asked(client, "?surface=saddle") == []


def test_the_page_asks_for_no_compression_that_this_service_lacks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(page_files, "COMPRESSIONS", ())
    with start_client(create_app(Settings())) as client:
        page = client.get("/").text
    assert 'data-compression=""' in page
    assert "meshopt" not in page


@needs_bundles
def test_the_content_security_policy_allows_only_this_service(client: Client) -> None:
    response = client.get("/")
    policy = dict(
        directive.strip().split(" ", 1)
        for directive in response.headers["content-security-policy"].split(";")
    )
    assert policy["default-src"] == "'none'"
    for directive in ("style-src", "connect-src"):
        assert policy[directive] == "'self'"
    # Only for the decoder of meshopt; of all pages, only the editor has it.
    decoder = " 'wasm-unsafe-eval'" if page_files.COMPRESSIONS else ""
    assert policy["script-src"] == f"'self'{decoder}"
    assert "wasm" not in client.get("/docs").headers["content-security-policy"]
    for directive in ("base-uri", "form-action", "frame-ancestors"):
        assert policy[directive] == "'none'"
    assert response.headers["x-content-type-options"] == "nosniff"
    assert response.headers["referrer-policy"] == "no-referrer"
    # The policy forbids inline scripts and inline styles, so the page must have none.
    assert re.findall(r"<script(?![^>]* src=)|<style|\sstyle=|\son\w+=", response.text) == []


@needs_bundles
def test_the_page_lists_all_file_types(client: Client) -> None:
    text = client.get("/").text
    (accepted,) = re.findall(r'type="file" multiple accept="([^"]+)"', text)
    (files,) = re.findall(r'data-files="([^"]+)"', text)
    expected = {suffix: decoder.media_type for suffix, decoder in BY_SUFFIX.items()}
    facts = json.loads(unescape(files))
    listed = {suffix: each["media_type"] for each in facts["read"] for suffix in each["suffixes"]}
    # Files of the teapot often have the suffix `.txt`.
    assert listed == expected | {"txt": "text/x-teapot"}
    assert {suffix for each in facts["refused"] for suffix in each["suffixes"]}.isdisjoint(listed)
    meshes = {suffix: each["format"] for each in facts["meshes"] for suffix in each["suffixes"]}
    assert meshes == {suffix: decoder.name for suffix, decoder in MESH_BY_SUFFIX.items()}
    assert facts["max_json_bytes"] <= facts["max_bytes"] == Settings().max_body_bytes
    only_meshes = [suffix for suffix in meshes if suffix not in expected]
    known = ["json", *expected, "txt", *only_meshes]
    assert accepted.split(",") == [f".{suffix}" for suffix in known]


def test_modules_are_short_and_begin_with_a_comment() -> None:
    for path in page_files.PAGE.glob("*.js"):
        lines = path.read_text(encoding="utf-8").splitlines()
        assert len(lines) <= 250, (
            f"{path.name} has more than 250 lines; move a part to another module"
        )
        assert lines[0].startswith("// "), path.name


@pytest.mark.parametrize(
    "url",
    [
        *("/page/..%2fpage.py", "/page/index.html", "/page/LICENSE", "/page/manifest.json"),
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
    monkeypatch.setattr(page_files, "STATIC", tmp_path)
    with start_client(create_app(Settings())) as client:
        for url in ("/", "/docs"):
            response = client.get(url)
            assert response.status_code == 503
            assert "make web" in response.text
        for url in ("/page/main.js", "/docs/swagger-ui.css"):
            assert client.get(url).status_code == 404
        for url in ("/v1/formats", "/openapi.json"):
            assert client.get(url).status_code == 200
