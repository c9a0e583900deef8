"""Routes for pages: the editor at `/`, the documentation at `/docs`, and /openapi.json.

Modules, styles and pictures are served from fixed lists of names: the path of a request never
decides which file is opened.
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

from service.api.record import route_path
from service.api.responses import HEADERS, PAGE_HEADERS
from service.api.services import ContextDep
from service.api.static_files import StaticFile
from service.decoders.refused import REFUSED
from service.decoders.registry import BY_NAME, BY_SUFFIX, CAD_DECODERS

API = Path(__file__).parents[1]
PAGE, DOCS = API / "page", API / "docs"
"""Folders of the pages in this repository: the editor, and the page that shows Swagger UI."""

THUMBNAILS = PAGE / "examples"
"""A small picture of each example, drawn by `make picture`."""

STATIC = API / "static"
"""Folder of scripts of other projects, which `make web` and the build of the image install."""

THREE = "three/three.js"
SWAGGER = ("swagger-ui/swagger-ui-bundle.js", "swagger-ui/swagger-ui.css")

_MEDIA_TYPES = MappingProxyType(
    {".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml", ".webp": "image/webp"}
)


def _headers(directives: str) -> dict[str, str]:
    """Headers of a page; `directives`: its content security policy for styles and images."""
    origins = "default-src 'none'; script-src 'self'; connect-src 'self'"
    limits = "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    policy = f"{origins}; {directives}; {limits}"
    return HEADERS | PAGE_HEADERS | {"Content-Security-Policy": policy}


_EDITOR_HEADERS = _headers("style-src 'self'; img-src 'self' data: blob:")
# Swagger UI sets styles on its elements, which needs `unsafe-inline`.
_DOCS_HEADERS = _headers("style-src 'self' 'unsafe-inline'; img-src 'self' data:")

pages = APIRouter(include_in_schema=False)


@pages.get("/")
async def editor(request: Request, context: ContextDep) -> Response:
    """The editor, or a page that says how to install three.js. The editor reads the query."""
    if not (STATIC / THREE).is_file():
        return _build_missing_page(
            "The editor draws with three.js, which is not installed.",
            'Everything else works; see <a href="docs">the interface</a>.',
            _EDITOR_HEADERS,
        )
    return await context.services.static_files.respond(request, "page")


@pages.get("/docs")
async def documentation(request: Request, context: ContextDep) -> Response:
    """Swagger UI for /openapi.json, or a page that says how to install Swagger UI."""
    if not all((STATIC / name).is_file() for name in SWAGGER):
        return _build_missing_page(
            "The scripts of this page are not installed.",
            "Everything else works; the interface is described in "
            '<a href="openapi.json">openapi.json</a>.',
            _DOCS_HEADERS,
        )
    return await context.services.static_files.respond(request, "docs")


@pages.get("/page/{file}")
@pages.get("/docs/{asset}")
async def page_file(request: Request, context: ContextDep) -> Response:
    """A script, a style or a picture of these two pages."""
    return await context.services.static_files.respond(request, route_path(request.scope)[1:])


@pages.get("/openapi.json")
async def openapi(request: Request, context: ContextDep) -> Response:
    """The OpenAPI document."""
    return await context.services.static_files.respond(request, "openapi.json")


def _build_missing_page(
    what_is_missing: str, what_works: str, headers: Mapping[str, str]
) -> Response:
    """A 503 page with these two sentences, and the command that installs what is missing."""
    text = Template((DOCS / "missing.html").read_text(encoding="utf-8"))
    html = text.substitute(what_is_missing=what_is_missing, what_works=what_works)
    return HTMLResponse(html, 503, headers)


def files(document: Callable[[], dict[str, Any]]) -> dict[str, StaticFile]:
    """All files that pages need, and the OpenAPI document; no other file is served."""
    editor_files = [STATIC / THREE, *sorted([*PAGE.iterdir(), *THUMBNAILS.iterdir()])]
    docs_files = [DOCS / "start.js", *(STATIC / name for name in SWAGGER)]
    return {
        "page": StaticFile(_editor_page, "text/html", _EDITOR_HEADERS),
        "docs": StaticFile((DOCS / "index.html").read_bytes, "text/html", _DOCS_HEADERS),
        "openapi.json": StaticFile(lambda: orjson.dumps(document()), "application/json"),
        **_by_name("page", editor_files),
        **_by_name("docs", docs_files),
    }


def _by_name(folder: str, paths: Sequence[Path]) -> dict[str, StaticFile]:
    return {
        f"{folder}/{path.name}": StaticFile(path.read_bytes, _MEDIA_TYPES[path.suffix])
        for path in paths
        if path.suffix in _MEDIA_TYPES
    }


def _editor_page() -> bytes:
    """`index.html`, with the lists of modules and of file suffixes filled in."""
    # The modules that `main.js` imports; `index.html` itself loads `main.js`.
    names = {path.name for path in PAGE.glob("*.js")} - {"main.js"} | {Path(THREE).name}
    # Files of the teapot often have the suffix `.txt`.
    media_types = {suffix: decoder.media_type for suffix, decoder in BY_SUFFIX.items()}
    media_types["txt"] = BY_NAME["teapot"].media_type
    refused_files = {
        suffix: {"code": issue.code, "detail": issue.message, "needed": issue.needed}
        for each in REFUSED
        for issue in (each.issue(),)
        for suffix in each.suffixes
    }
    suffixes = [".json", *(f".{suffix}" for suffix in media_types)]
    text = Template((PAGE / "index.html").read_text(encoding="utf-8")).substitute(
        modulepreload_links="\n".join(
            f'<link rel="modulepreload" href="page/{n}">' for n in sorted(names)
        ),
        accept=",".join(suffixes),
        suffixes=", ".join(f"<code>{suffix}</code>" for suffix in suffixes),
        media_types=escape(orjson.dumps(media_types).decode()),
        cad_types=escape(orjson.dumps([each.media_type for each in CAD_DECODERS]).decode()),
        refused_files=escape(orjson.dumps(refused_files).decode()),
    )
    return text.encode()
