"""Surfaces by id: built-in examples by name, stored surfaces by hash; and their URLs.

In URLs, `root` is the path that the service is mounted at, often empty, and `surface` is an id.
"""

import logging
from dataclasses import replace
from difflib import get_close_matches
from functools import cache, partial
from typing import Any

from service.api.computation import Computation
from service.api.services import Services
from service.encoders.png import PNG
from service.encoders.registry import FORMATS
from service.engine.mesh.mesh import ENGINE
from service.errors import DamagedObject, InvalidRequest, Issue, UnknownSurface
from service.schemas.document import DocumentLimits
from service.storage.canonical import (
    canonical_content,
    estimate_restore_memory,
    restore_surface,
    surface_id,
)
from service.storage.keys import is_id
from service.storage.store import SurfaceStore
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.kinds import Surface

_log = logging.getLogger(__name__)

INLINE_BYTES = 1 << 16
"""Most bytes of a content that is parsed on the event loop; a thread parses larger contents."""


async def surface_of(services: Services, computation: Computation, id: str) -> Surface:
    """The surface with this id; requests for the same stored surface share one load.

    Raises
    ------
    UnknownSurface, InvalidRequest
        No surface has this id; or the surface exceeds limits that were larger when it was stored.
        Both errors point to `/id`.
    DamagedObject, StoreFailed
    """
    if id in EXAMPLES:
        return find(id).surface()
    # Each deletion raises the generation: later requests do not share a load from before it.
    key = ("surface", content_id(id), services.cache.generation)
    return await services.flights.join(
        key, partial(_load, services, id), computation, computation.on_ready
    )


async def exists(store: SurfaceStore, id: str) -> bool:
    """Whether a surface has this id; does not read the surface."""
    return id in EXAMPLES or await store.has(id)


def content_id(id: str) -> str:
    """The SHA-256 of a surface's content: for an example, computed; a hash itself, unchanged.

    Does not check whether a surface is stored under the hash.

    Raises
    ------
    UnknownSurface
        The id is neither the name of an example nor a hash. The error names the most similar
        example.
    """
    if id in EXAMPLES:
        return _hash_of_example(id)
    if not is_id(id):
        similar = "".join(f"`{name}`, or " for name in get_close_matches(id[:64], EXAMPLES, 1))
        names = f"{similar}one of {', '.join(EXAMPLES)}"
        raise UnknownSurface(
            Issue(
                "unknown_surface",
                "No surface has this id.",
                "/id",
                got="an unknown id",
                needed=f"{names}; or the id of a stored surface, 64 hexadecimal digits",
            )
        )
    return id


@cache
def _hash_of_example(name: str) -> str:
    return surface_id(canonical_content(find(name).surface()))


async def _load(services: Services, id: str, computation: Computation) -> Surface:
    """Loads a stored surface, in a computation of its own."""
    try:
        content = await services.store.get(
            id, computation.hold_body
        )  # reserves memory before it reads
    except UnknownSurface as error:
        raise error.within("/id") from None
    computation.hold_body(estimate_restore_memory(content))
    work = partial(_restore, id, content, services.document_limits)
    surface = await computation.parse(work, is_long=len(content) > INLINE_BYTES)
    computation.hold_body(len(content))  # the surface has the same numbers as its content
    return surface


def _restore(id: str, content: bytes, limits: DocumentLimits) -> Surface:
    try:
        return restore_surface(content, limits)
    except DamagedObject:
        _log.error("the object %s has the right hash, but is not the content of a surface", id)
        raise
    except InvalidRequest as error:
        # The client sent only the id, so a pointer into the surface would not help it.
        raise InvalidRequest(replace(error.issues[0], pointer="/id")) from None


def surface_url(root: str, surface: str) -> str:
    """The URL of a surface."""
    return f"{root}/v1/surfaces/{surface}"


def mesh_url_path(root: str, surface: str, suffix: str) -> str:
    """The URL of a surface's meshes in one format, without a query."""
    return f"{surface_url(root, surface)}/mesh.{suffix}"


def mesh_url(root: str, surface: str, suffix: str, query: str = f"engine={ENGINE}") -> str:
    """The URL of a mesh.

    If `query` is not given, it is `engine=…` alone: the default options, and the present version
    (`ENGINE`) of the numbers that the service computes.
    """
    return f"{mesh_url_path(root, surface, suffix)}?{query}"


def picture_url_path(root: str, surface: str) -> str:
    """The URL of a surface's picture, without a query."""
    return f"{surface_url(root, surface)}/image.{PNG.suffix}"


def picture_url(root: str, surface: str, query: str = f"engine={ENGINE}") -> str:
    """The URL of a picture, as `mesh_url`."""
    return f"{picture_url_path(root, surface)}?{query}"


def stored_links(root: str, surface: str) -> dict[str, Any]:
    """The URLs of a surface, of its meshes by suffix, and of its picture, with default options."""
    return {
        "self": surface_url(root, surface),
        "mesh": {fmt.suffix: mesh_url(root, surface, fmt.suffix) for fmt in FORMATS},
        "image": picture_url(root, surface),
    }
