"""The documentation page, its scripts, and the service without them."""

import re
from pathlib import Path

import pytest

from service.api.app import create_app
from service.api.routes import pages
from service.settings.values import Settings
from tests.api.client import Client, client_of


def test_everything_on_the_page_comes_from_here(client: Client) -> None:
    page = client.get("/docs")
    assert page.status_code == 200
    sources = re.findall(r'(?:src|href)="([^"]+)"', page.text)
    assert sources == ["data:,", *(f"docs/{name}" for name in _names(sources))]
    for source in sources[1:]:
        assert client.get(f"/{source}").status_code == 200
    assert "<script>" not in page.text
    assert "script-src 'self';" in page.headers["content-security-policy"]


def _names(sources: list[str]) -> list[str]:
    return [source.removeprefix("docs/") for source in sources[1:]]


def test_page_without_scripts_says_what_to_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pages, "STATIC", tmp_path)
    with client_of(create_app(Settings())) as client:
        page = client.get("/docs")
        assert page.status_code == 503
        assert "make web" in page.text
        assert client.get("/docs/swagger-ui.css").status_code == 404
        assert client.get("/openapi.json").status_code == 200


@pytest.mark.parametrize("name", ["..%2f..%2fapp.py", "LICENSE", "swagger-ui.css.map"])
def test_nothing_else_is_served(client: Client, name: str) -> None:
    assert client.get(f"/docs/{name}").status_code == 404
