"""Routes for pages: the editor at `/`, a view at `/embed`, the documentation at `/docs`, documents.

Scripts, styles and pictures are served from fixed lists of names: the path of a request never
decides which file is opened.
"""

from collections.abc import Mapping
from string import Template

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse

from service.api.page_files import (
    DOCS,
    DOCS_HEADERS,
    EDITOR_HEADERS,
    FIRST_SURFACE,
    editor_name,
)
from service.api.previews import preview_editor, preview_embedded
from service.api.record import route_path
from service.api.services import ContextDep

pages = APIRouter(include_in_schema=False)


@pages.get("/")
async def editor(request: Request, context: ContextDep) -> Response:
    """The editor, or a page that says how to build it. The editor reads the query."""
    files = context.services.static_files
    if "page" not in files:
        return _build_missing_page(
            "The scripts of the editor are not built.",
            'Everything else works; see <a href="docs">the interface</a>.',
            EDITOR_HEADERS,
        )
    name = editor_name(request.query_params.get("surface", FIRST_SURFACE))
    preview = await preview_editor(request, context)
    tags = "" if preview is None else preview.write_tags()
    return await files.respond(request, name if name in files else "page", tags)


@pages.get("/embed")
async def embedded(request: Request, context: ContextDep) -> Response:
    """A view of the mesh whose path is in the query, for frames. Its script reads the query."""
    files = context.services.static_files
    if "embed" not in files:
        return _build_missing_page(
            "The scripts of this view are not built.",
            'Everything else works; see <a href="docs">the interface</a>.',
            EDITOR_HEADERS,
        )
    preview = await preview_embedded(request, context)
    tags = "" if preview is None else preview.write_tags()
    return await files.respond(request, "embed", tags)


@pages.get("/docs")
async def documentation(request: Request, context: ContextDep) -> Response:
    """Swagger UI for /openapi.json, or a page that says how to install Swagger UI."""
    files = context.services.static_files
    if "docs" not in files:
        return _build_missing_page(
            "The scripts of this page are not installed.",
            "Everything else works; the interface is described in "
            '<a href="openapi.json">openapi.json</a>.',
            DOCS_HEADERS,
        )
    return await files.respond(request, "docs")


@pages.get("/page/{file}")
@pages.get("/docs/{asset}")
async def page_file(request: Request, context: ContextDep) -> Response:
    """A script, a style or a picture of these two pages."""
    return await context.services.static_files.respond(request, route_path(request.scope)[1:])


@pages.get("/openapi.json")
@pages.get("/favicon.ico")
@pages.get("/robots.txt")
async def document(request: Request, context: ContextDep) -> Response:
    """The OpenAPI document; an icon, for what names none; and what robots may read."""
    return await context.services.static_files.respond(request, route_path(request.scope)[1:])


def _build_missing_page(
    what_is_missing: str, what_works: str, headers: Mapping[str, str]
) -> Response:
    """A 503 page with these two sentences, and the command that installs what is missing."""
    text = Template((DOCS / "missing.html").read_text(encoding="utf-8"))
    html = text.substitute(what_is_missing=what_is_missing, what_works=what_works)
    return HTMLResponse(html, 503, headers)
