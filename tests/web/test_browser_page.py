"""docs/browser.md: an error, types for TypeScript, and headers.

The blocks of code run unchanged, except for the URL of the service. `test_clients.py` tests the
pages for three.js, model-viewer and Babylon.js.
"""

import json
import re
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest

from service.api.cors import ALLOWED, EXPOSED
from service.settings.environment import apply_flags
from service.settings.values import Settings
from tests.test_readme import run_shell
from tests.web.clients import (
    PAGE,
    SERVED_AT,
    read_blocks,
    read_page,
    serve_site,
    visit,
)
from tests.web.compiler import compile_project, write_project
from tools.browser import FOLDER, Stage
from tools.programs import find_node_package, find_program

TYPES = FOLDER.parents[1] / "openapi" / "surface-service.d.ts"
TEXT = PAGE.read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^## (.+?)\n(.*?)(?=^## |\Z)", TEXT, re.MULTILINE | re.DOTALL))
OpenPage = Callable[[str], Stage]
EMPTY_PAGE = "<!doctype html><html lang=en><title>Nothing yet</title><link rel=icon href='data:,'>"
IMPORTS = re.search(r"<script type=\"importmap\">.*?</script>", read_page("three"), re.DOTALL)


def read_rows(section: str) -> list[list[str]]:
    """The cells of the rows of the only table in a section, without the head of the table."""
    lines = re.findall(r"^\| (.*) \|$", SECTIONS[section], re.MULTILINE)
    return [line.split(" | ") for line in lines[2:]]


@pytest.fixture
def open_page(server: str, visitor: Stage) -> Iterator[OpenPage]:
    """A function that opens a page, given as HTML, at another origin than the service."""
    pages: dict[str, str] = {}

    def open_html(page: str) -> Stage:
        pages["/"] = page.replace(SERVED_AT, server)
        visit(visitor, f"{origin}/")
        return visitor

    with serve_site(pages) as origin:
        yield open_html


def test_the_page_shows_the_error_of_the_service(open_page: OpenPage) -> None:
    (code,) = read_blocks("js")
    assert IMPORTS is not None
    stage = open_page(f'{EMPTY_PAGE}{IMPORTS[0]}<script type="module">{code}</script>')
    stage.page.wait_for_function("document.body.textContent.includes(':')")
    assert stage.page.inner_text("body").startswith("resolution: ")
    # The browser itself writes a message for the status 422; other messages are not allowed.
    assert [re.findall(r"status of (\d+)", text) for text in stage.messages] == [["422"]]


def test_the_types_accept_valid_uses_and_refuse_mistakes(tmp_path: Path) -> None:
    """The compiler would report a valid use in `uses.ts` that the types refuse.

    After `@ts-expect-error` it would report an invalid use that the types accept.
    """
    find_node_package("openapi-fetch")
    assert compile_project(write_project(tmp_path, FOLDER / "uses.ts")) == ""


def test_the_committed_types_are_those_of_the_committed_document() -> None:
    find_node_package("openapi-typescript")
    command = [find_program("node"), str(FOLDER / "types.js")]
    types = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert TYPES.read_text(encoding="utf-8") == types, "run `make types`"


@pytest.mark.slow
def test_a_program_compiles_with_types_from_a_service(tmp_path: Path, server: str) -> None:
    (command,) = (block for block in read_blocks("sh") if block.startswith("npx "))
    generator = find_node_package("openapi-typescript") / "bin" / "cli.js"
    command = command.replace("npx openapi-typescript", f"{find_program('node')} {generator}")
    run_shell(command.replace(SERVED_AT, server), tmp_path)
    source = """import type { Mesh, MeshRequest } from './surface-service';
        const net = [[[-1, -1, 1], [-1, 1, -1]], [[1, -1, -1], [1, 1, 1]]];
        const request: MeshRequest = { surface: { control_net: net }, tolerance: 0.01 };
        export const read = (mesh: Mesh): number => mesh.report.triangles;
        // @ts-expect-error no option has this name
        export const misspelt: MeshRequest = { ...request, tolerances: 0.01 };"""
    (tmp_path / "client.ts").write_text(source, encoding="utf-8")
    assert compile_project(write_project(tmp_path, tmp_path / "client.ts")) == ""


def test_responses_may_be_cached_as_the_table_says(server: str) -> None:
    surface = {"surface": {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}}
    links = httpx.post(f"{server}/v1/surfaces", json=surface).json()["links"]
    mesh_url = links["mesh"]["glb"]
    urls = [mesh_url, mesh_url.partition("?")[0], links["self"], "/v1/surfaces/none/mesh.glb"]
    responses = [httpx.get(server + url) for url in urls]
    values_on_page = [cells[1].strip("`") for cells in read_rows("What is kept, and for how long")]
    assert [response.headers["Cache-Control"] for response in responses] == values_on_page
    link_header = f'<{mesh_url}>; rel="canonical"'
    assert [response.headers["Link"] for response in responses[:2]] == [link_header] * 2


def test_meshes_of_another_engine_are_gone_as_the_page_says(server: str) -> None:
    response = httpx.get(f"{server}/v1/surfaces/saddle/mesh.glb?engine=1")
    assert (response.status_code, response.json()["code"]) == (410, "engine_gone")
    assert "`410` and the code `engine_gone`" in " ".join(TEXT.split())


def test_the_table_lists_the_headers_that_scripts_may_read(server: str) -> None:
    names = {name for cells in read_rows("Headers of responses") for name in cells[0].split(", ")}
    assert {name.strip("`") for name in names} == set(EXPOSED)
    headers = httpx.get(f"{server}/v1/surfaces/saddle/mesh.glb").headers
    # A response with a mesh does not have these headers.
    rare_headers = {
        "Location",
        "Preference-Applied",
        "Retry-After",
        "RateLimit",
        "RateLimit-Policy",
        "Surface-Gap-Bound",
        "Surface-Reading",
        "Surface-Writing",
    }
    assert all(name in headers for name in set(EXPOSED) - rare_headers)


def test_the_table_lists_the_headers_that_scripts_may_send() -> None:
    names = {name for cells in read_rows("Headers of requests") for name in cells[0].split(", ")}
    assert {name.strip("`") for name in names} == set(ALLOWED)


def test_scripts_of_other_origins_may_send_these_headers(open_page: OpenPage, server: str) -> None:
    """A browser asks first, by a preflight request, and would otherwise refuse to send them."""
    page = open_page(EMPTY_PAGE).page
    headers = dict.fromkeys(ALLOWED, "x") | {"Content-Type": "application/json"}
    statuses = page.evaluate(
        """async ([url, headers]) => Promise.all(headers.map(async (header) =>
             (await fetch(url, { headers: Object.fromEntries([header]) })).status))""",
        [f"{server}/v1/formats", list(headers.items())],
    )
    assert statuses == [200] * len(headers)


def test_the_setting_of_origins_on_the_page_is_valid() -> None:
    (command,) = re.findall(r"^SURFACE_CORS_ORIGINS=\S+", TEXT, re.MULTILINE)
    _, _, origins = command.partition("=")
    allowed_origins = apply_flags(Settings(), {"cors_origins": origins}).cors_origins
    assert allowed_origins == tuple(origins.split(","))
    assert Settings().cors_origins == ("*",)


@pytest.mark.parametrize("option", ["quantize=true", "compression=meshopt"])
def test_the_page_names_the_extensions_of_compact_files(option: str, server: str) -> None:
    content = httpx.get(f"{server}/v1/surfaces/saddle/mesh.glb?{option}").content
    # A GLB file has 12 bytes of its own, then the length and the type of the JSON, then the JSON.
    length = int.from_bytes(content[12:16], "little")
    extensions = json.loads(content[20 : 20 + length])["extensionsRequired"]
    assert extensions
    assert all(f"`{name}`" in SECTIONS["Smaller files"] for name in extensions)
