"""docs/browser.md: a mesh as numbers, an error, TypeScript, and headers.

The blocks of code run unchanged, except for the URL of the service. `test_clients.py` tests the
pages for three.js, model-viewer and Babylon.js.
"""

import json
import re
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import numpy as np
import pytest

from service.api.cors import ALLOWED, EXPOSED
from service.settings.environment import apply_flags
from service.settings.values import Settings
from tests.test_readme import run_shell
from tests.web.clients import (
    PAGE,
    SERVED_AT,
    read_blocks,
    read_meshes,
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


def test_the_page_builds_a_geometry_of_three_from_json(open_page: OpenPage, server: str) -> None:
    (page,) = (block for block in read_blocks("html") if "BufferGeometry" in block)
    stage = open_page(page)
    (mesh,) = read_meshes(stage)
    assert stage.messages == []
    # The control net and the resolution are those of the request on the page.
    net = [[[0, 0, 0], [0, 1, 0], [0, 0, 2]], [[1, 0, 1], [1, 2, 1], [1, 0, 3]]]
    net.append([[2, 0, 0], [2, 1, 0], [2, 0, 2]])
    body = {"surface": {"control_net": net}, "resolution": 24}
    expected = httpx.post(f"{server}/v1/mesh", json=body).json()
    np.testing.assert_allclose(mesh["positions"], expected["vertices"], atol=1e-6)
    np.testing.assert_allclose(mesh["normals"], expected["normals"], atol=1e-6)
    assert np.reshape(mesh["triangles"], (-1, 3)).tolist() == expected["faces"]


def test_creases_have_the_normals_of_their_corners(open_page: OpenPage, server: str) -> None:
    """The function of the page gives each corner of a face its position and its normal.

    In JSON, `attribute_faces` names the row of the normal of each corner. The rounded box has one
    normal at each position, so its mesh has no `attribute_faces`: `faces` names these rows, too.
    """
    (page,) = (block for block in read_blocks("html") if "BufferGeometry" in block)
    (function,) = re.findall(r"function geometryOf.*?\n  }\n", page, re.DOTALL)
    assert IMPORTS is not None
    script = f"""{EMPTY_PAGE}{IMPORTS[0]}<script type="module">
      import * as THREE from 'three';
      {function}
      window.measureCorners = async (example) => {{
        const response = await fetch(`{server}/v1/surfaces/${{example}}/mesh.json?resolution=3`);
        const mesh = await response.json();
        const {{ attributes, index }} = geometryOf(mesh);
        const compare = (attribute, row, vector) => Math.max(
          ...vector.map((x, k) => Math.abs(attribute.getComponent(row, k) - x)),
        );
        const errors = mesh.faces.flatMap((face, f) => face.map((vertex, c) => {{
          const row = index.getX(3 * f + c);
          const normal = mesh.normals[(mesh.attribute_faces ?? mesh.faces)[f][c]];
          return Math.max(
            compare(attributes.position, row, mesh.vertices[vertex]),
            compare(attributes.normal, row, normal),
          );
        }}));
        return [attributes.position.count, attributes.normal.count, mesh.normals.length, errors];
      }};
    </script>"""
    stage = open_page(script)
    stage.page.wait_for_function("window.measureCorners !== undefined")
    for example in ("utah-teapot", "rounded-box", "cone", "trefoil-tube"):
        position_count, normal_count, expected_count, corner_errors = stage.page.evaluate(
            "window.measureCorners", example
        )
        assert position_count == normal_count == expected_count, example
        assert max(corner_errors) < 1e-5, example
    assert stage.messages == []


def test_the_page_shows_the_error_of_the_service(open_page: OpenPage) -> None:
    (code,) = read_blocks("js")
    assert IMPORTS is not None
    stage = open_page(f'{EMPTY_PAGE}{IMPORTS[0]}<script type="module">{code}</script>')
    stage.page.wait_for_function("document.body.textContent.includes(':')")
    assert stage.page.inner_text("body").startswith("resolution: ")
    # The browser itself writes a message for the status 422; other messages are not allowed.
    assert [re.findall(r"status of (\d+)", text) for text in stage.messages] == [["422"]]


def test_the_client_in_typescript_compiles_and_runs(open_page: OpenPage, tmp_path: Path) -> None:
    """The compiler also checks `uses.ts`: it would report a valid use that the types refuse.

    After `@ts-expect-error` it would report an invalid use that the types accept.
    """
    find_node_package("openapi-fetch")
    (source,) = read_blocks("ts")
    (tmp_path / "client.ts").write_text(source, encoding="utf-8")
    (tmp_path / TYPES.name).write_bytes(TYPES.read_bytes())
    assert (
        compile_project(write_project(tmp_path, tmp_path / "client.ts", FOLDER / "uses.ts")) == ""
    )
    (program,) = (tmp_path / "js").rglob("client.js")
    script = program.read_text(encoding="utf-8")
    stage = open_page(f'{EMPTY_PAGE}<script type="module">{script}</script>')
    stage.page.wait_for_function("document.body.textContent.includes('away')")
    match = re.fullmatch(
        r"(\d+) triangles, at most ([\d.]+) away; (/v1/surfaces/[0-9a-f]{64}/mesh.glb\?engine=\d+)",
        stage.page.inner_text("body"),
    )
    assert match is not None
    assert int(match[1]) > 2
    assert 0 < float(match[2]) <= 0.01
    assert stage.messages == []


def test_the_committed_types_are_those_of_the_committed_document() -> None:
    find_node_package("openapi-typescript")
    command = [find_program("node"), str(FOLDER / "types.js")]
    types = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert TYPES.read_text(encoding="utf-8") == types, "run `make types`"


def test_the_client_in_typescript_compiles_with_types_from_a_service(
    tmp_path: Path, server: str
) -> None:
    (command,) = (block for block in read_blocks("sh") if block.startswith("npx "))
    generator = find_node_package("openapi-typescript") / "bin" / "cli.js"
    command = command.replace("npx openapi-typescript", f"{find_program('node')} {generator}")
    run_shell(command.replace(SERVED_AT, server), tmp_path)
    (source,) = read_blocks("ts")
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
