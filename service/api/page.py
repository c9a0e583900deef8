"""The editor at `/`: its page, its modules and three.js, every byte of it served from here.

The modules in `service/api/page/` are served as they are written; three.js comes from the npm
registry when the service is installed. Addresses are relative: the page works behind any prefix.
"""

import gzip
from collections.abc import Mapping
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from service.api.answers import HEADERS

SOURCES = Path(__file__).parent / "page"
"""Written by us: the page, its style and its modules."""

ASSETS = Path(__file__).parent / "static" / "three"
"""Filled by `make web` and by the image build."""

THREE = "three.js"

_MEDIA_TYPES = MappingProxyType(
    {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
)

FILES: Mapping[str, str] = MappingProxyType(
    {
        path.name: _MEDIA_TYPES[path.suffix]
        for path in sorted(SOURCES.iterdir())
        if path.suffix in _MEDIA_TYPES and path.suffix != ".html"
    }
    | {THREE: _MEDIA_TYPES[".js"]}
)
"""What is served beneath `/page/`, and nothing else, with its media types."""

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_PAGE_HEADERS = HEADERS | {"Content-Security-Policy": _POLICY, "Referrer-Policy": "no-referrer"}

_FRESH = {"Cache-Control": "no-cache", "Vary": "Accept-Encoding"}
"""Kept by the browser, and asked for again before it is used: modules of two versions of the
service must not meet. Where nothing has changed the answer is 304."""

_NOT_BUILT = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<title>Surface Service</title>
<link rel="icon" href="data:,">
<h1>Surface Service</h1>
<p>The editor draws with three.js, which is not installed. In the project's folder, run</p>
<pre>make web</pre>
<p>and load the page again. Nothing else depends on it; <a href="docs">the interface</a> answers as
ever.</p>
</html>
"""


async def home(request: Request) -> Response:
    """GET /: the editor, or what to run to have it."""
    if not (ASSETS / THREE).is_file():
        return HTMLResponse(_NOT_BUILT, status_code=503, headers=_PAGE_HEADERS)
    return _answer(request, SOURCES / "index.html", "text/html", _PAGE_HEADERS)


async def part(request: Request) -> Response:
    """GET /page/{file}: a module, the style or three.js, by a closed list of names."""
    name = request.path_params["file"]
    path = (ASSETS if name == THREE else SOURCES) / name
    if name not in FILES or not path.is_file():
        raise HTTPException(404)
    return _answer(request, path, FILES[name], HEADERS)


def _answer(request: Request, path: Path, media_type: str, headers: dict[str, str]) -> Response:
    """The file, compressed where that is accepted; 304 where the browser has it already."""
    plain, packed, digest = _contents(path, path.stat().st_mtime_ns)
    packs = "gzip" in request.headers.get("accept-encoding", "")
    tag = f'"{digest}-gzip"' if packs else f'"{digest}"'
    told = headers | _FRESH | {"ETag": tag}
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=told)
    if packs:
        told["Content-Encoding"] = "gzip"
    return Response(packed if packs else plain, headers=told, media_type=media_type)


@lru_cache(maxsize=64)
def _contents(path: Path, _changed: int) -> tuple[bytes, bytes, str]:
    """A file, the same compressed, and a name for its content: done once a change of the file."""
    plain = path.read_bytes()
    return plain, gzip.compress(plain, 9, mtime=0), sha256(plain).hexdigest()[:32]
