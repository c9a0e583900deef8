"""The documentation page: Swagger UI over /openapi.json, every byte of it served from here."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType

from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from service.api.answers import HEADERS, PAGE_HEADERS
from service.api.not_built import not_built
from service.api.static_files import StaticFile, StaticFiles

ASSETS = Path(__file__).parent / "static" / "swagger-ui"
"""Filled by `make web` and by the image build."""

_MEDIA_TYPES = {
    "swagger-ui-bundle.js": "text/javascript",
    "swagger-ui.css": "text/css",
}

_POLICY = (
    "default-src 'none'; script-src 'self'; connect-src 'self'; img-src 'self' data:; "
    # Swagger UI sets styles on its elements.
    "style-src 'self' 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = HEADERS | PAGE_HEADERS | {"Content-Security-Policy": _POLICY}

_PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Surface Service</title>
<link rel="icon" href="data:,">
<link rel="stylesheet" href="docs/swagger-ui.css">
<main id="docs"></main>
<script src="docs/swagger-ui-bundle.js"></script>
<script src="docs/start.js"></script>
</html>
"""

_START = """// The operations first, and of the prose about them only its first paragraph.
const operationsFirst = ({ React, getComponent, specSelectors }) => {
  const { createElement: h, Fragment } = React;
  const paragraphs = () => specSelectors.info().get("description", "").split("\\n\\n");
  const withProse = (Operations) => (props) => h(Fragment, null,
    h(Operations, props),
    h("section", { className: "info" },
      h("h2", { className: "title" }, "About all operations"),
      h(getComponent("Markdown", true), { source: paragraphs().slice(1).join("\\n\\n") })));
  return {
    wrapComponents: { operations: withProse },
    statePlugins: {
      spec: { wrapSelectors: { selectInfoDescriptionField: () => () => paragraphs()[0] } },
    },
  };
};
SwaggerUIBundle({
  url: "openapi.json",
  dom_id: "#docs",
  deepLinking: true,
  validatorUrl: null,
  plugins: [operationsFirst],
});
"""


async def page(_: Request) -> Response:
    """GET /docs: Swagger UI, or what to run to have it."""
    built = all((ASSETS / name).is_file() for name in _MEDIA_TYPES)
    if built:
        return HTMLResponse(_PAGE, headers=_HEADERS)
    return not_built(
        "The scripts of this page are not installed.",
        "Nothing else depends on them; the interface is described in "
        '<a href="openapi.json">openapi.json</a>.',
        _HEADERS,
    )


async def asset(request: Request) -> Response:
    """GET /docs/{asset}: the scripts and the style of the page, by a closed list of names."""
    static_files: StaticFiles = request.app.state.services.static_files
    return await static_files.answer(request, f"docs/{request.path_params['asset']}")


async def openapi(request: Request) -> Response:
    """GET /openapi.json: the interface as a document."""
    static_files: StaticFiles = request.app.state.services.static_files
    return await static_files.answer(request, "openapi.json")


def _read(name: str) -> bytes:
    return (ASSETS / name).read_bytes()


FILES: Mapping[str, StaticFile] = MappingProxyType(
    {
        "docs/start.js": StaticFile(_START.encode, "text/javascript"),
        **{
            f"docs/{name}": StaticFile(partial(_read, name), media_type)
            for name, media_type in _MEDIA_TYPES.items()
        },
    }
)
"""What the page is made of, and what it shows."""
