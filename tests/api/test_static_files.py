"""Static files are read once and compressed once; an unchanged file is not sent again."""

from collections.abc import Iterator

import pytest
from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import Response

from service.api.app import create_app
from service.api.static_files import StaticFile, StaticFiles
from service.settings.values import Settings
from tests.decompression import decompress_gzip, decompress_zstd
from tools.client import Client, start_client

SCRIPT = b"export const answer = 42;\n" * 1000


class Folder:
    """Two static files: a script, whose reads are counted, and a style, which may be missing."""

    def __init__(self) -> None:
        self.reads = 0
        self.has_style = False

    def read_script(self) -> bytes:
        self.reads += 1
        return SCRIPT

    def read_style(self) -> bytes:
        if not self.has_style:
            raise FileNotFoundError
        return b"body {}"

    def build_app(self) -> FastAPI:
        """An application that serves the files below /files/."""
        app = create_app(Settings())
        static_files = StaticFiles(
            {
                "app.js": StaticFile(self.read_script, "text/javascript", {"X-Own": "yes"}),
                "style.css": StaticFile(self.read_style, "text/css"),
            }
        )

        async def respond(request: Request) -> Response:
            return await static_files.respond(request, request.path_params["name"])

        app.add_route("/files/{name}", respond)
        return app


@pytest.fixture
def folder() -> Folder:
    return Folder()


@pytest.fixture
def client(folder: Folder) -> Iterator[Client]:
    with start_client(folder.build_app()) as client:
        yield client


def test_a_file_is_read_once_and_sent_in_every_coding(client: Client, folder: Folder) -> None:
    tags = set()
    for _ in range(2):
        plain = client.get_raw("/files/app.js")
        gzipped = client.get_raw("/files/app.js", {"Accept-Encoding": "gzip"})
        best = client.get_raw("/files/app.js", {"Accept-Encoding": "gzip, deflate, br, zstd"})
        assert plain.content == SCRIPT
        assert decompress_gzip(gzipped.content) == SCRIPT
        assert decompress_zstd(best.content) == SCRIPT
        codings = [each.headers.get("content-encoding") for each in (plain, gzipped, best)]
        assert codings == [None, "gzip", "zstd"]
        for response in (plain, gzipped, best):
            assert response.headers["content-length"] == str(len(response.content))
            assert response.headers["content-type"].startswith("text/javascript")
            assert response.headers["cache-control"] == "no-cache"
            assert "Accept-Encoding" in response.headers["vary"]
            assert response.headers["x-content-type-options"] == "nosniff"
            assert response.headers["x-own"] == "yes"
            tags.add(response.headers["etag"])
    assert len(tags) == 3
    assert folder.reads == 1


def test_an_unchanged_file_is_not_sent_again(client: Client) -> None:
    headers = {"Accept-Encoding": "zstd"}
    tag = client.get_raw("/files/app.js", headers).headers["etag"]
    for condition in (tag, f'"x", W/{tag}', "*"):
        response = client.get_raw("/files/app.js", {**headers, "If-None-Match": condition})
        assert (response.status_code, response.content) == (304, b"")
        assert response.headers["etag"] == tag
    other = client.get_raw("/files/app.js", {"Accept-Encoding": "gzip", "If-None-Match": tag})
    assert other.status_code == 200


def test_head_gives_the_headers_without_a_body(client: Client) -> None:
    head = client.request("HEAD", "/files/app.js")
    assert head.content == b""
    assert head.headers == client.get("/files/app.js").headers


def test_small_files_are_not_compressed_and_a_file_may_appear_later(
    client: Client, folder: Folder
) -> None:
    assert client.get("/files/style.css").status_code == 404
    folder.has_style = True
    response = client.get_raw("/files/style.css", {"Accept-Encoding": "zstd"})
    assert (response.status_code, response.content) == (200, b"body {}")
    assert "content-encoding" not in response.headers


def test_unknown_files_are_not_found(client: Client) -> None:
    response = client.get("/files/other.js")
    assert response.status_code == 404
    assert response.headers["cache-control"] == "no-store"


def test_the_openapi_document_is_compressed(client: Client) -> None:
    response = client.get_raw("/openapi.json", {"Accept-Encoding": "zstd"})
    assert response.headers["content-encoding"] == "zstd"
    whole = client.get("/openapi.json", {"Accept-Encoding": "identity"})
    assert decompress_zstd(response.content) == whole.content
    assert len(response.content) < len(whole.content) / 5


def test_a_file_that_was_built_as_brotli_is_sent_so_to_clients_that_accept_it() -> None:
    """Other clients get the other codings; each has its own entity tag."""
    brotli = StaticFile(lambda: b"brotli", "text/javascript", is_immutable=True)
    files = StaticFiles(
        {"a.js": StaticFile(lambda: SCRIPT, "text/javascript", is_immutable=True, brotli=brotli)}
    )
    app = create_app(Settings())

    async def respond(request: Request) -> Response:
        return await files.respond(request, "a.js")

    app.add_route("/a.js", respond)
    tags = set()
    with start_client(app) as client:
        for accepted, coding in (
            ("gzip, deflate, br, zstd", "br"),
            ("br;q=0, zstd", "zstd"),
            ("gzip", "gzip"),
            ("*", "br"),
            ("", None),
        ):
            headers = {"Accept-Encoding": accepted}
            response = client.get_raw("/a.js", headers)
            assert response.headers.get("content-encoding") == coding, accepted
            assert (response.content == b"brotli") == (coding == "br")
            tag = response.headers["etag"]
            tags.add(tag)
            unchanged = client.get_raw("/a.js", headers | {"If-None-Match": tag})
            assert unchanged.status_code == 304
            assert unchanged.headers["etag"] == tag
            assert "content-encoding" not in unchanged.headers
    assert len(tags) == 4
