"""The editor at `/`, the documentation at `/docs`, and /openapi.json: all from this server."""

from collections.abc import Callable, Mapping
from typing import Any

import orjson
from fastapi import APIRouter, Request, Response

from service.api import docs, page
from service.api.services import ServicesDep
from service.api.static_files import StaticFile

pages = APIRouter(include_in_schema=False)

pages.get("/")(page.home)
pages.get("/page/{file}")(page.part)
pages.get("/docs")(docs.page)
pages.get("/docs/{asset}")(docs.asset)


@pages.get("/openapi.json")
async def openapi(request: Request, services: ServicesDep) -> Response:
    """The interface as a document."""
    return await services.static_files.answer(request, "openapi.json")


def files(document: Callable[[], dict[str, Any]]) -> Mapping[str, StaticFile]:
    """The files of the pages, and the OpenAPI document."""
    openapi = StaticFile(lambda: orjson.dumps(document()), "application/json")
    return {**docs.FILES, **page.FILES, "openapi.json": openapi}
