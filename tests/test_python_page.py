"""docs/python.md and its notebook run: against a service with keys, and with a 429 on the way."""

import json
import re
from collections import Counter
from collections.abc import Iterator
from contextlib import redirect_stdout
from io import StringIO
from itertools import pairwise
from pathlib import Path
from shutil import copy
from typing import Any

import httpx
import pytest
from pydantic import SecretStr
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.guard.keys import KEY_BYTES, PREFIX, format_entry
from service.client.call import Call
from service.client.clients import Calls
from service.settings.values import Settings
from tests.cad import FOLDER
from tests.test_readme import PART, SERVED_AT, find_blocks
from tools.live import run_service

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGE = (DOCS / "python.md").read_text(encoding="utf-8")
KEY = PREFIX + "7c" * KEY_BYTES


@pytest.fixture(scope="module")
def statuses() -> Counter[int]:
    """The number of responses of each status of the service with keys."""
    return Counter()


@pytest.fixture(scope="module")
def servers(server: str, statuses: Counter[int]) -> Iterator[tuple[str, str]]:
    """The URLs of a service without keys, and of one with keys, of 60 requests a minute."""

    def wrap(app: Any) -> ASGIApp:
        async def respond(scope: Scope, receive: Receive, send: Send) -> None:
            async def count(message: Message) -> None:
                if message["type"] == "http.response.start":
                    statuses[message["status"]] += 1
                await send(message)

            await app(scope, receive, count)

        return respond

    settings = Settings(
        api_keys=(format_entry("alice", KEY),),
        signing_keys=(SecretStr("0123456789abcdef" * 2),),
        rate_limit=60,
    )
    with run_service(settings, wrap) as url:
        yield server, url


def exhaust(url: str, statuses: Counter[int]) -> None:
    """Sends requests until the service refuses one."""
    with httpx.Client(base_url=url, headers={"Authorization": f"Bearer {KEY}"}) as client:
        while client.get("/v1/surfaces").status_code != 429:
            pass
    statuses.clear()


@pytest.mark.slow
def test_the_examples_print_what_the_page_shows(
    servers: tuple[str, str],
    statuses: Counter[int],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SURFACE_KEY", KEY)
    copy(FOLDER / PART, "part.step")
    blocks = find_blocks(PAGE)
    programs = [pair for pair in pairwise(blocks) if pair[0].language == "python"]
    assert len(programs) == sum(block.language == "python" for block in blocks)
    names: dict[str, Any] = {}
    refused = 0
    for program, shown in programs:
        assert shown.language == "text"
        url = servers["os.environ" in program.text]
        if program.text.startswith("areas = "):
            exhaust(servers[1], statuses)
        with redirect_stdout(StringIO()) as output:
            exec(compile(program.text.replace(SERVED_AT, url), "docs/python.md", "exec"), names)
        assert output.getvalue() == shown.text, program.text
        refused += statuses[429]
        request.addfinalizer(names["client"].close)
    assert refused > 0


def test_every_call_is_on_the_page() -> None:
    calls = {name for name, call in vars(Calls).items() if isinstance(call, Call)}
    table = "".join(re.findall(r"^\| (`.*?) \|", PAGE, re.M))
    assert {f"`{name}`" for name in calls} <= set(re.findall(r"`\w+`", table))


def read_cells(kind: str) -> list[dict[str, Any]]:
    notebook = json.loads((DOCS / "python.ipynb").read_text(encoding="utf-8"))
    assert notebook["nbformat"] == 4
    return [cell for cell in notebook["cells"] if cell["cell_type"] == kind]


def test_the_notebook_runs_and_prints_what_it_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for cell in read_cells("code"):
        with redirect_stdout(StringIO()) as output:
            exec(compile("".join(cell["source"]), "docs/python.ipynb", "exec"), names)
        shown = ["".join(each["text"]) for each in cell["outputs"]]
        assert [output.getvalue()] == (shown or [""])
