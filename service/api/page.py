"""The editor at `/`: its page, its modules and three.js, every byte of it served from here.

The modules in `service/api/page/` are served as they are written; three.js comes from the npm
registry when the service is installed. Addresses are relative: the page works behind any prefix.
Into `index.html` the service writes which modules there are and which files can be opened.
"""

from collections.abc import Mapping
from html import escape
from pathlib import Path
from string import Template
from types import MappingProxyType

import orjson
from starlette.requests import Request
from starlette.responses import Response

from service.api.answers import HEADERS, PAGE_HEADERS
from service.api.not_built import not_built
from service.api.static_files import StaticFile, StaticFiles
from service.decoders.registry import BY_NAME, BY_SUFFIX

SOURCES = Path(__file__).parent / "page"
"""Written by us: the page, its style and its modules."""

THUMBNAILS = SOURCES / "examples"
"""A small picture of each example, drawn by `make picture`."""

ASSETS = Path(__file__).parent / "static" / "three"
"""Filled by `make web` and by the image build."""

THREE = "three.js"

_MEDIA_TYPES = MappingProxyType(
    {
        ".css": "text/css",
        ".js": "text/javascript",
        ".svg": "image/svg+xml",
        ".webp": "image/webp",
    }
)

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = PAGE_HEADERS | {"Content-Security-Policy": _POLICY}


async def home(request: Request) -> Response:
    """GET /: the editor, or what to run to have it. Its query is read by the editor."""
    if not (ASSETS / THREE).is_file():
        return not_built(
            "The editor draws with three.js, which is not installed.",
            'Nothing else depends on it; <a href="docs">the interface</a> answers as ever.',
            HEADERS | _HEADERS,
        )
    static_files: StaticFiles = request.app.state.services.static_files
    return await static_files.answer(request, "page")


async def part(request: Request) -> Response:
    """GET /page/{file}: a module, the style, a picture or three.js, by a closed list of names."""
    static_files: StaticFiles = request.app.state.services.static_files
    return await static_files.answer(request, f"page/{request.path_params['file']}")


def _read_three() -> bytes:
    return (ASSETS / THREE).read_bytes()


def _read_page() -> bytes:
    """`index.html` with what the folders and the registry of decoders list."""
    modules = sorted(name for name in FILES if name.endswith(".js") and name != "page/main.js")
    # Teapots are handed on as `.txt` as well.
    media_types = {suffix: decoder.media_type for suffix, decoder in BY_SUFFIX.items()}
    media_types["txt"] = BY_NAME["teapot"].media_type
    suffixes = [".json", *(f".{suffix}" for suffix in media_types)]
    text = Template((SOURCES / "index.html").read_text(encoding="utf-8")).substitute(
        modules="\n".join(f'<link rel="modulepreload" href="{name}">' for name in modules),
        accept=",".join(suffixes),
        suffixes=", ".join(f"<code>{suffix}</code>" for suffix in suffixes),
        media_types=escape(orjson.dumps(media_types).decode()),
    )
    return text.encode()


FILES: Mapping[str, StaticFile] = MappingProxyType(
    {
        "page": StaticFile(_read_page, "text/html", _HEADERS),
        f"page/{THREE}": StaticFile(_read_three, _MEDIA_TYPES[".js"]),
        **{
            f"page/{path.name}": StaticFile(path.read_bytes, _MEDIA_TYPES[path.suffix])
            for path in sorted([*SOURCES.iterdir(), *THUMBNAILS.iterdir()])
            if path.suffix in _MEDIA_TYPES
        },
    }
)
"""The page and what it is made of: nothing else is served from these folders."""
