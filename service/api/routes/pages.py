"""The editor at `/`, the documentation at `/docs`, and /openapi.json: all from this server.

Modules, styles and pictures are served under closed lists of names, so that no path of a request
decides which files can be opened.
"""

from collections.abc import Callable, Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template
from types import MappingProxyType
from typing import Any

import orjson
from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse

from service.api.answers import HEADERS, PAGE_HEADERS
from service.api.services import ContextDep
from service.api.static_files import StaticFile
from service.decoders.registry import BY_NAME, BY_SUFFIX

API = Path(__file__).parents[1]
PAGE, DOCS = API / "page", API / "docs"
"""Written by us: the editor with its style and its modules, and the page of Swagger UI."""

THUMBNAILS = PAGE / "examples"
"""A small picture of each example, drawn by `make picture`."""

STATIC = API / "static"
"""Filled by `make web` and by the image build."""

THREE = "three/three.js"
SWAGGER = ("swagger-ui/swagger-ui-bundle.js", "swagger-ui/swagger-ui.css")

_MEDIA_TYPES = MappingProxyType(
    {".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml", ".webp": "image/webp"}
)


def _headers(own: str) -> dict[str, str]:
    """The headers of a page whose policy has these directives beside those of all pages."""
    always = "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    policy = f"default-src 'none'; script-src 'self'; connect-src 'self'; {own}; {always}"
    return HEADERS | PAGE_HEADERS | {"Content-Security-Policy": policy}


_EDITOR_HEADERS = _headers("style-src 'self'; img-src 'self' data: blob:")
# Swagger UI sets styles on its elements.
_DOCS_HEADERS = _headers("style-src 'self' 'unsafe-inline'; img-src 'self' data:")

pages = APIRouter(include_in_schema=False)


@pages.get("/")
async def editor(request: Request, context: ContextDep) -> Response:
    """The editor, or what to run to have it. Its query is read by the editor."""
    if not (STATIC / THREE).is_file():
        return _missing(
            "The editor draws with three.js, which is not installed.",
            'Nothing else depends on it; <a href="docs">the interface</a> answers as ever.',
            _EDITOR_HEADERS,
        )
    return await context.services.static_files.answer(request, "page")


@pages.get("/page/{file}")
async def editor_file(file: str, request: Request, context: ContextDep) -> Response:
    """A module of the editor, its style, a picture or three.js."""
    return await context.services.static_files.answer(request, f"page/{file}")


@pages.get("/docs")
async def documentation(request: Request, context: ContextDep) -> Response:
    """Swagger UI over /openapi.json, or what to run to have it."""
    if not all((STATIC / name).is_file() for name in SWAGGER):
        return _missing(
            "The scripts of this page are not installed.",
            "Nothing else depends on them; the interface is described in "
            '<a href="openapi.json">openapi.json</a>.',
            _DOCS_HEADERS,
        )
    return await context.services.static_files.answer(request, "docs")


@pages.get("/docs/{asset}")
async def documentation_file(asset: str, request: Request, context: ContextDep) -> Response:
    """A script or the style of the documentation."""
    return await context.services.static_files.answer(request, f"docs/{asset}")


@pages.get("/openapi.json")
async def openapi(request: Request, context: ContextDep) -> Response:
    """The interface as a document."""
    return await context.services.static_files.answer(request, "openapi.json")


def _missing(what: str, rest: str, headers: Mapping[str, str]) -> Response:
    """A page that says what is not installed, what to run, and what works without it: 503."""
    text = Template((DOCS / "missing.html").read_text(encoding="utf-8"))
    return HTMLResponse(text.substitute(what=what, rest=rest), 503, headers)


def files(document: Callable[[], dict[str, Any]]) -> dict[str, StaticFile]:
    """The pages and what they are made of, and the OpenAPI document; nothing else is served."""
    modules = [STATIC / THREE, *sorted([*PAGE.iterdir(), *THUMBNAILS.iterdir()])]
    scripts = [DOCS / "start.js", *(STATIC / name for name in SWAGGER)]
    return {
        "page": StaticFile(_editor_page, "text/html", _EDITOR_HEADERS),
        "docs": StaticFile((DOCS / "index.html").read_bytes, "text/html", _DOCS_HEADERS),
        "openapi.json": StaticFile(lambda: orjson.dumps(document()), "application/json"),
        **_by_name("page", modules),
        **_by_name("docs", scripts),
    }


def _by_name(folder: str, paths: Sequence[Path]) -> dict[str, StaticFile]:
    return {
        f"{folder}/{path.name}": StaticFile(path.read_bytes, _MEDIA_TYPES[path.suffix])
        for path in paths
        if path.suffix in _MEDIA_TYPES
    }


def _editor_page() -> bytes:
    """`index.html` with what the folders and the registry of decoders list."""
    names = {path.name for path in PAGE.glob("*.js")} - {"main.js"} | {Path(THREE).name}
    # Teapots are handed on as `.txt` as well.
    media_types = {suffix: decoder.media_type for suffix, decoder in BY_SUFFIX.items()}
    media_types["txt"] = BY_NAME["teapot"].media_type
    suffixes = [".json", *(f".{suffix}" for suffix in media_types)]
    text = Template((PAGE / "index.html").read_text(encoding="utf-8")).substitute(
        modules="\n".join(f'<link rel="modulepreload" href="page/{n}">' for n in sorted(names)),
        accept=",".join(suffixes),
        suffixes=", ".join(f"<code>{suffix}</code>" for suffix in suffixes),
        media_types=escape(orjson.dumps(media_types).decode()),
    )
    return text.encode()
