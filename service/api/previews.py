"""Previews of shared pages: tags in a page, from which other sites draw a card (Open Graph).

A site that shows a link fetches its page without a key, and runs no scripts. So the card of a
surface says what the page itself would show to a stranger: where reading needs a key, pages have no
such tags. Addresses in tags are absolute, so a page depends on the address that the client used.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape

from fastapi import Request

from service.api.page_files import FIRST_SURFACE
from service.api.services import Context
from service.api.stored import picture_url
from service.errors import SurfaceError
from service.schemas.pictures import PictureFields
from service.schemas.query import canonical_query
from service.storage.canonical import read_name
from service.storage.keys import is_id
from service.storage.store import SurfaceStore
from service.surface.examples.catalogue import EXAMPLES

# Cards are 1.91 times as wide as high. Some sites show transparent pixels as black.
_PICTURE = PictureFields(width=1200, height=630, background="f4f1ec")

MAX_BYTES = 1 << 20
"""The largest content of which the name is read: a page is not worth more work."""

_HOST = re.compile(r"(?:[A-Za-z0-9._-]{1,255}|\[[0-9A-Fa-f:.]{2,45}\])(?::[0-9]{1,5})?")
_MESH = re.compile(r"/v1/surfaces/([A-Za-z0-9-]{1,64})/mesh\.glb(?:\?.*)?", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Preview:
    """The content of a card: title, description, and the address of a picture."""

    title: str
    description: str
    picture: str

    def write_tags(self) -> str:
        """The tags, one a line. All texts are escaped."""
        named = {
            "og:type": "website",
            "og:site_name": "Surface Service",
            "og:title": self.title,
            "og:description": self.description,
            "og:image": self.picture,
            "og:image:type": "image/png",
            "og:image:width": str(_PICTURE.width),
            "og:image:height": str(_PICTURE.height),
            "og:image:alt": self.title,
        }
        # Sites that read this tag take the rest from those of Open Graph.
        return _write_metas("property", named) + _write_metas(
            "name", {"twitter:card": "summary_large_image"}
        )


def _write_metas(attribute: str, values: Mapping[str, str]) -> str:
    return "".join(
        f'<meta {attribute}="{name}" content="{escape(value)}">\n' for name, value in values.items()
    )


def find_base(request: Request) -> str | None:
    """The address of the service, as the client wrote it; None if that is not known.

    The scheme is that of the connection, or the one that a trusted proxy names.
    """
    host = request.headers.get("host", "")
    if not _HOST.fullmatch(host):
        return None
    return f"{request.scope['scheme']}://{host}{request.scope.get('root_path', '')}"


async def preview_editor(request: Request, context: Context) -> Preview | None:
    """The preview of the surface that the editor opens first; None if the service has none."""
    return await _preview(request, context, request.query_params.get("surface", FIRST_SURFACE))


async def preview_embedded(request: Request, context: Context) -> Preview | None:
    """The preview of the surface whose mesh is in a frame; None if the service has none."""
    path = request.query_params.get("src", "").removeprefix(request.scope.get("root_path", ""))
    mesh = _MESH.fullmatch(path)
    return None if mesh is None else await _preview(request, context, mesh[1])


async def _preview(request: Request, context: Context, surface: str) -> Preview | None:
    services, computation, *_ = context
    base = find_base(request)
    if base is None or not services.settings.public_reads:
        return None
    picture = picture_url(base, surface, canonical_query(_PICTURE))
    if (example := EXAMPLES.get(surface)) is not None:
        return Preview(example.title, example.description.replace("`", ""), picture)
    if not is_id(surface):
        return None
    try:
        async with computation.until_deadline():
            name = await _read_name(services.store, surface)
    except SurfaceError:
        return None  # the page itself says why there is no surface
    return Preview(name, "A parametric surface, to be turned, edited and downloaded.", picture)


async def _read_name(store: SurfaceStore, id: str) -> str:
    """The name of a stored surface; of a large one, a general name.

    Raises
    ------
    SurfaceError
        The store has no such surface, or cannot be read.
    """

    def refuse_large(size: int) -> None:
        if size > MAX_BYTES:
            raise _TooLargeError

    try:
        return read_name(await store.get(id, refuse_large))
    except _TooLargeError:
        return "A surface"


class _TooLargeError(Exception):
    """A content is not read for its name."""
