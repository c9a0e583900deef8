"""docs/access.md agrees with the service: its commands, its program that signs, its tables."""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from pydantic import SecretStr

from service.api.guard.keys import KEY_BYTES, PREFIX, SCOPES, format_entry
from service.api.guard.policy import Policy, scope_of
from service.api.guard.signatures import Signer
from service.api.problems import PROBLEMS
from service.settings.values import Settings
from tests.test_readme import SERVED_AT
from tools.live import run_service
from tools.programs import find_program

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "access.md").read_text(encoding="utf-8")
KEY, SECRET = PREFIX + "5f" * KEY_BYTES, "0123456789abcdef" * 2
SETTINGS = Settings(
    api_keys=(format_entry("alice", KEY),),
    public_reads=False,
    signing_keys=(SecretStr(SECRET),),
    rate_limit=600,
    compute_limit=120,
)


def read_blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.M | re.S)


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    with run_service(SETTINGS) as url:
        yield url


@pytest.mark.slow
def test_the_commands_work_as_documented(server: str, tmp_path: Path) -> None:
    find_program("curl")
    environment = os.environ | {
        "PYTHONPATH": str(ROOT),
        "SURFACE_KEY": KEY,
        "SURFACE_SIGNING_KEYS": SECRET,
    }
    script = f'surface() {{ {sys.executable} -m service "$@"; }}\n' + "\n".join(read_blocks("sh"))
    process = subprocess.run(
        [find_program("bash"), "-euc", script.replace(SERVED_AT, server)],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    key, entry, *other_lines = process.stdout.splitlines()
    # The page shows the first digits of a random key and of its hash; only the text before these
    # digits must be equal.
    lines_on_page = read_blocks("text")[0].splitlines()
    beginnings = [line.rstrip("…")[:-4] for line in lines_on_page]  # without the 4 digits
    for printed, beginning in zip((key, entry), beginnings, strict=True):
        assert printed.startswith(beginning)
    assert {file.name for file in tmp_path.iterdir()} == {"patch.glb", "saddle.glb"}
    for file in tmp_path.iterdir():
        assert file.read_bytes().startswith(b"glTF")
    # The service returns a signed URL as JSON; then the command line prints one.
    response, _, printed_url = "".join(other_lines).partition("}")
    for url in (json.loads(response + "}")["url"], printed_url):
        assert url.startswith("/v1/surfaces/utah-teapot/mesh.glb?resolution=16&expires=")
        assert httpx.get(server + url).status_code == 200
    assert httpx.get(server + printed_url.partition("&expires")[0]).status_code == 401


def test_the_program_signs_as_the_service_does() -> None:
    (source,) = read_blocks("python")
    names: dict[str, object] = {}
    exec(compile(source, "docs/access.md", "exec"), names)
    sign_url = names["signed"]
    assert callable(sign_url)
    path, expires = "/v1/surfaces/saddle/mesh.glb", int(time.time()) + 60
    for query in ("", "resolution=8,16&uvs=true", "overlays=boundary%2Ccontrol_net&faces=none"):
        url = sign_url(SECRET, path, query, expires)
        assert url == f"{path}?{Signer([SECRET]).sign(path, query, expires)}"


def test_the_service_has_the_codes_and_statuses_of_the_page() -> None:
    rows = re.findall(r"^\| `(\w+)` \| (\d+) \|", PAGE, re.M)
    codes = {(problem.code, str(problem.status)) for problem in PROBLEMS.values()}
    assert len(rows) == 7
    assert set(rows) <= codes


def test_the_table_of_calls_agrees_with_the_policy() -> None:
    policy_with_keys, private_policy = Policy(Settings(api_keys=("a",))), Policy(SETTINGS)
    words = {"nothing": "open", "key": "a key", "key or signature": "a key, or a signed URL"}
    rows = re.findall(r"^\| (.*`(?:POST|GET /|/).*) \| (.*?) \| (.*?) \|$", PAGE, re.M)
    # The row of /metrics is left out: its need depends on the setting SURFACE_METRICS.
    rows = [row for row in rows if "as `SURFACE_METRICS` says" not in row[1]]
    for calls, need_with_keys, need_if_private in rows:
        paths = re.findall(r"`(?:GET )?(/[^`]*)`", calls)
        # A row without paths is about all calls by POST and DELETE.
        requests = [("GET", path) for path in paths] or [("POST", "/v1/x"), ("DELETE", "/v1/x")]
        for method, path in requests:
            assert words[policy_with_keys.need(method, path)] == need_with_keys, path
            assert words[private_policy.need(method, path)] == need_if_private, path
    assert len(rows) == 7


def test_the_table_of_scopes_agrees_with_the_policy() -> None:
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|\d].*?) \|$", PAGE, re.M))
    assert tuple(rows) == SCOPES
    for scope, calls in rows.items():
        for method, path in re.findall(r"`(?:([A-Z]+) )?(/[^`]+)`", calls):
            assert scope_of(method or "GET", path) == scope, path
    assert scope_of("POST", "/v1/mesh") == scope_of("PATCH", "/v1/x") == "compute"


def test_the_rate_limit_headers_have_the_form_that_the_page_shows(server: str) -> None:
    headers_on_page = dict(re.findall(r"^\| `(RateLimit[\w-]*): (.*?)`", PAGE, re.M))
    headers = httpx.get(f"{server}/v1/formats").headers
    assert headers["ratelimit-policy"] == headers_on_page["RateLimit-Policy"]
    digits = re.compile(r"\d+")
    assert digits.sub("0", headers["ratelimit"]) == digits.sub("0", headers_on_page["RateLimit"])
