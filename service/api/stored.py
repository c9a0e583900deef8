"""Surfaces by their ids: names of examples, hashes of what was stored."""

import logging
from dataclasses import dataclass, replace
from functools import cache, partial

from starlette.requests import Request

from service.api.admission.visits import visiting
from service.api.caching.answers import AnswerCache
from service.api.caching.flights import Flights
from service.api.timing import Timing
from service.api.work import long_to_read, parsed
from service.errors import DamagedObject, InvalidRequest, Issue, UnknownSurface
from service.schemas.canonical import canonical, restored, restored_memory, surface_id
from service.schemas.document import DocumentLimits
from service.settings.values import document_limits
from service.storage.keys import is_id
from service.storage.store import SurfaceStore
from service.surface import Surface
from service.surface.examples import EXAMPLES, find

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Stored:
    """A surface that was asked for by its id.

    Attributes
    ----------
    id : str
        As it stands in the path.
    surface : Surface
    is_hash : bool
        Whether the id is the hash of its content: then it never stands for another surface.
    is_long : bool
        Whether it is so large that the event loop cannot spare the time to write it down.
    """

    id: str
    surface: Surface
    is_hash: bool
    is_long: bool = False


async def surface_of(request: Request, id: str) -> Stored:
    """The surface of this id; those who work on one that is stored share it.

    Raises
    ------
    UnknownSurface, InvalidRequest
        There is none, or it was stored under wider limits than there are now. Both point to `/id`.
    DamagedObject, StoreFailed
    """
    if id in EXAMPLES:
        return Stored(id, find(id).surface(), is_hash=False)
    if not is_id(id):
        raise _unknown()
    answers: AnswerCache = request.app.state.answers
    flights: Flights = request.app.state.flights
    # What was deleted since is not shared.
    return await flights.join(("surface", id, answers.age), partial(_load, request, id))


def forget(request: Request, id: str) -> None:
    """Drops whatever is in memory of a surface that was deleted."""
    request.app.state.answers.forget(id)


async def exists(request: Request, id: str) -> bool:
    """Whether there is a surface of this id; what is stored is not read."""
    store: SurfaceStore = request.app.state.store
    return id in EXAMPLES or await store.has(id)


def content_id(id: str) -> str:
    """The hash of what an id stands for: of the content of an example, or the id itself.

    Raises
    ------
    UnknownSurface
        For what is neither; whether something is stored under a hash is not looked up.
    """
    if id in EXAMPLES:
        return _hash_of_example(id)
    if not is_id(id):
        raise _unknown()
    return id


def _unknown() -> UnknownSurface:
    """The error of a name that is no example's, and no hash."""
    return UnknownSurface(
        Issue(
            "unknown_surface",
            "No surface is known by this id.",
            "/id",
            "an unknown id",
            f"one of {', '.join(EXAMPLES)}; or the id of a stored surface, 64 hexadecimal digits",
        )
    )


@cache
def _hash_of_example(name: str) -> str:
    return surface_id(canonical(find(name).surface()))


async def _load(request: Request, id: str) -> Stored:
    """The surface that is stored under a hash."""
    store: SurfaceStore = request.app.state.store
    arrival = visiting().arrival
    try:
        content = await store.get(id, arrival.claim)
    except UnknownSurface as error:
        raise error.within("/id") from None
    limits = document_limits(request.app.state.settings)
    is_long = long_to_read(content)
    arrival.claim(restored_memory(content))
    work = partial(_restored, id, content, limits)
    surface = await parsed(work, Timing(), is_long=is_long)
    visiting().rest()
    return Stored(id, surface, is_hash=True, is_long=is_long)


def _restored(id: str, content: bytes, limits: DocumentLimits) -> Surface:
    try:
        return restored(content, limits)
    except DamagedObject:
        _log.error("%s has its hash, but is not the content of a surface", id)
        raise
    except InvalidRequest as error:
        # Where in the surface is of no use to somebody who sent only its id.
        raise InvalidRequest(replace(error.issues[0], pointer="/id")) from None
