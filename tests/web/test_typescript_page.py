"""docs/typescript.md: its programs run in Node and in Chromium, and print what the page shows."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from starlette.types import ASGIApp, Receive, Scope, Send

from service.api.guard.keys import format_entry, make_key
from service.api.guard.policy import build_refusal, rate_limited
from service.api.problems import problem_of, problem_response
from service.cancellation import OutOfTime
from service.settings.values import Settings
from tests.test_readme import find_blocks
from tests.web.clients import SERVED_AT, read_meshes, visit
from tests.web.typescript import PAGE, SOURCES, compile_program, install_package, run_program
from tools.browser import Stage, serve_folder
from tools.live import run_service

KEY = make_key()
KEY_ON_PAGE = "sfk_5f0c…"
BLOCKS = find_blocks(PAGE.read_text(encoding="utf-8"))
PROGRAM = "\n".join(block.text for block in BLOCKS if block.language == "ts")
OUTPUT = "".join(block.text for block in BLOCKS if block.language == "text")
FINE_TEAPOT = ("GET", "/v1/surfaces/utah-teapot/mesh.json")
IMPORTS = '{"imports": {"surface-service": "/node_modules/surface-service/index.js"}}'


@dataclass
class BusyService:
    """A service whose first estimate is refused by a rate, and whose fine teapot is a job."""

    is_busy: bool = True

    def wrap(self, app: ASGIApp) -> ASGIApp:
        async def respond(scope: Scope, receive: Receive, send: Send) -> None:
            call = scope.get("method"), scope.get("path")
            response: ASGIApp = app
            if call == ("POST", "/v1/estimate") and self.is_busy:
                self.is_busy = False
                response = build_refusal(rate_limited(60, 1), 1)
            elif call == FINE_TEAPOT and b"relative_tolerance" in scope["query_string"]:
                response = problem_response(problem_of(OutOfTime()))
            if response is not app and any(name == b"origin" for name, _ in scope["headers"]):
                response = _allow_origin(response)
            await response(scope, receive, send)

        return respond


def _allow_origin(app: ASGIApp) -> ASGIApp:
    """Lets pages of other origins read a response that has not passed the service."""

    async def respond(scope: Scope, receive: Receive, send: Send) -> None:
        async def send_allowed(message: Any) -> None:
            if message["type"] == "http.response.start":
                allowed = [(b"access-control-allow-origin", b"*")]
                exposed = [(b"access-control-expose-headers", b"Retry-After")]
                message["headers"] = [*message["headers"], *allowed, *exposed]
            await send(message)

        await app(scope, receive, send_allowed)

    return respond


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("typescript")
    install_package(folder)
    return folder


@pytest.fixture(scope="module")
def busy_service() -> BusyService:
    return BusyService()


@pytest.fixture(scope="module")
def guarded_server(busy_service: BusyService) -> Iterator[str]:
    settings = Settings(api_keys=(format_entry("alice", KEY),))
    with run_service(settings, busy_service.wrap) as url:
        yield url


@pytest.fixture(scope="module")
def program(folder: Path) -> str:
    """The program of the page in JavaScript; the strict compiler accepts it."""
    errors, program = compile_program(folder, PROGRAM)
    assert errors == ""
    return program


def address(text: str, server: str) -> str:
    """A program of the page, with the address and the key of this service."""
    return text.replace(SERVED_AT, server).replace(KEY_ON_PAGE, KEY)


@pytest.mark.slow
def test_the_programs_print_in_node_what_the_page_shows(
    folder: Path, program: str, guarded_server: str, busy_service: BusyService
) -> None:
    busy_service.is_busy = True
    assert run_program(folder, address(program, guarded_server)) == OUTPUT


def test_the_programs_print_in_chromium_what_the_page_shows(
    folder: Path,
    program: str,
    guarded_server: str,
    busy_service: BusyService,
    visitor: Stage,
) -> None:
    busy_service.is_busy = True
    (folder / "page.js").write_text(address(program, guarded_server), encoding="utf-8")
    (folder / "page.html").write_text(
        "<!doctype html><html lang=en><title>A program</title><link rel=icon href='data:,'>"
        f'<script type="importmap">{IMPORTS}</script>'
        '<script type="module">import("./page.js")'
        ".catch((error) => console.log(`${error}`)).finally(() => console.log('the end'))</script>",
        encoding="utf-8",
    )
    lines: list[str] = []

    def record(message: Any) -> None:
        if message.type == "log":
            lines.append(message.text)

    visitor.page.on("console", record)
    with serve_folder(folder) as pages:
        with visitor.page.expect_console_message(lambda message: message.text == "the end"):
            visit(visitor, f"{pages}/page.html")
        visitor.page.goto("about:blank")
    visitor.page.remove_listener("console", record)
    assert [*lines] == [*OUTPUT.splitlines(), "the end"]


def test_the_page_of_three_draws_both_meshes(folder: Path, server: str, visitor: Stage) -> None:
    (page,) = (block.text for block in BLOCKS if block.language == "html")
    (folder / "three.html").write_text(address(page, server), encoding="utf-8")
    with serve_folder(folder) as pages:
        visit(visitor, f"{pages}/three.html")
        # Before the first mesh is there, the geometry of the patch is empty.
        visitor.page.wait_for_function(
            "(() => { try { return window.readMeshes().length == 2; } catch { return false; } })()"
        )
        visitor.page.evaluate(
            """() => {
                const slider = document.querySelector('#height');
                for (const height of [1, 3, 4]) {
                    slider.value = height;
                    slider.dispatchEvent(new Event('input'));
                }
            }"""
        )
        net = [[[0, 0, 0], [0, 1, 0], [0, 0, 2]], [[1, 0, 1], [1, 4, 1], [1, 0, 3]]]
        net.append([[2, 0, 0], [2, 1, 0], [2, 0, 2]])
        body = {"surface": {"control_net": net}, "resolution": 24}
        expected = httpx.post(f"{server}/v1/mesh", json=body).json()
        highest = max(y for _, y, _ in expected["vertices"])
        visitor.page.wait_for_function(
            """(highest) => window.readMeshes().some(({ positions }) => (
                Math.abs(Math.max(...positions.map(([, y]) => y)) - highest) < 1e-6))""",
            arg=highest,
        )
        (mesh,) = (m for m in read_meshes(visitor) if len(m["positions"]) == 25 * 25)
    assert visitor.messages == []
    np.testing.assert_allclose(mesh["positions"], expected["vertices"], atol=1e-6)
    np.testing.assert_allclose(mesh["normals"], expected["normals"], atol=1e-6)
    assert np.reshape(mesh["triangles"], (-1, 3)).tolist() == expected["faces"]


def test_the_readme_of_the_package_prints_what_it_shows(folder: Path, server: str) -> None:
    blocks = find_blocks((SOURCES / "README.md").read_text(encoding="utf-8"))
    ((source, output),) = pairwise(blocks)
    errors, program = compile_program(folder, source.text)
    assert errors == ""
    assert run_program(folder, address(program, server)) == output.text


def test_the_page_lists_every_call_and_every_option_of_a_call(folder: Path) -> None:
    text = PAGE.read_text(encoding="utf-8")
    types = folder / "node_modules" / "surface-service"
    calls = re.findall(r"^    (\w+)\(.*$", (types / "client.d.ts").read_text(), re.MULTILINE)
    for name in {*calls} - {"constructor"}:
        assert f"`{name}(" in text or f"client.{name}(" in text, name
    options = (types / "connection.d.ts").read_text().split("interface CallOptions")[1]
    for name in re.findall(r"^    (\w+)\?:", options.split("\n}")[0], re.MULTILINE):
        assert f"| `{name}` |" in text, name
