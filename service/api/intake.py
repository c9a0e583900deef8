"""Accepts jobs: checks their parts, batch by batch in threads, and hands them to `Jobs`.

If a part is refused, or the client disconnects, nothing of the job stays.
"""

import re
from asyncio import timeout
from collections.abc import AsyncIterable, AsyncIterator, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple
from urllib.parse import urlencode

from fastapi import Response

from service.api.computation import Computation
from service.api.job_documents import state_response
from service.api.services import Context, Services
from service.api.stored import surface_of
from service.cancellation import OutOfTime, checkpoint
from service.decoders.format import Decoder
from service.encoders.format import FileFormat
from service.errors import InvalidRequest, Issue, StoreFailed, SurfaceError, UnknownSurface
from service.jobs.checks import CheckedPart, check_part
from service.jobs.parts import stored_surface
from service.pipeline.calls import CallLimits
from service.pipeline.cost import Cost, Work
from service.schemas.jobs import FILE_ID
from service.surface.kinds import Surface

PREFERENCE = "respond-async"

GROUP_PARTS = 64
"""The most parts that are checked in one turn: some 50 ms."""

PART_SECONDS, BYTE_SECONDS = 5e-4, 1e-8
"""Estimated time to check a part, and in addition for each byte of memory that its JSON takes."""

MAX_STORED = 4
"""The most stored surfaces that one batch of parts may name: all are in memory at the same time."""


def prefers_async(headers: Mapping[bytes, bytes]) -> bool:
    """Whether `Prefer` names `respond-async` (RFC 7240); other preferences are ignored."""
    names = headers.get(b"prefer", b"").decode("latin-1").split(",")
    return any(re.split("[;=]", name)[0].strip().lower() == PREFERENCE for name in names)


async def accept_job(context: Context, batches: AsyncIterable[Sequence[object]]) -> Response:
    """Checks the parts of a job, and accepts it; the response has its state.

    Parameters
    ----------
    batches : async iterable
        The parts, parsed but not checked: a JSON value or a `PartDefinition` each.

    Raises
    ------
    InvalidRequest, TooLarge, UnsupportedByFormat, UnknownSurface
        A part is refused; its pointer begins with `/parts/3`, for example.
    TooManyJobs, JobQuotaFull, Busy, OutOfTime, StoreFailed, StoreFull
    """
    services, computation, request, _ = context
    if services.jobs is None:  # there is no place to keep them
        raise StoreFailed
    count = 0
    async with services.jobs.start_intake(computation.caller) as intake:
        async for parts in batches:
            for group in _split(parts):
                with computation.timing.step("check"):
                    checked = await _check_in_turn(context, services.part_limits, group, count)
                with computation.timing.step("store"):
                    await intake.add(checked)
                count += len(group)
        if not count:
            raise no_parts()
        with computation.timing.step("store"):
            state, _ = await intake.finish()
    return state_response(state, request, {"Server-Timing": str(computation.timing)})


def no_parts() -> InvalidRequest:
    """The error of a job without parts."""
    message, needed = "A job has at least one part.", "one part or more"
    return InvalidRequest(Issue("empty_list", message, "/parts", "no part", needed))


async def accept_call(context: Context, path: str, body: object) -> Response:
    """Makes a job of one part: the call that computes at this path, with this JSON body.

    Raises
    ------
    The errors of `accept_job`; their pointers are those of the call.
    """
    fmt: FileFormat | None = context.format
    query = f"?format={fmt.name}" if fmt else ""
    return await _accept_part(context, {"path": path + query, "body": body})


async def accept_file(context: Context, path: str, content: bytes, decoder: Decoder) -> Response:
    """Makes a job of one part: the call at this path, with this file as its body.

    The fields beside the file are in the query of the request.

    Raises
    ------
    The errors of `accept_job`; their pointers are those of the call.
    """
    services, _, request, fmt = context
    assert services.jobs is not None  # the route has asked
    id, _ = await services.jobs.sources.store(content, decoder)
    pairs = [(k, v) for k, v in request.query_params.multi_items() if k != "format"]
    if fmt is not None:
        pairs.append(("format", fmt.name))
    query = f"?{urlencode(pairs)}" if pairs else ""
    return await _accept_part(context, {"path": path + query, "file": id})


async def _accept_part(context: Context, part: Mapping[str, object]) -> Response:
    async def batches() -> AsyncIterator[list[object]]:
        yield [part]

    try:
        response = await accept_job(context, batches())
    except SurfaceError as error:
        raise _remove_prefix(error) from None
    response.headers["Preference-Applied"] = PREFERENCE
    return response


_PREFIXES = ("/parts/0/body", "/parts/0/file")


def _remove_prefix(error: SurfaceError) -> SurfaceError:
    """The error with pointers into the body of the only part."""

    def shorten(pointer: str) -> str:
        prefix = next((each for each in _PREFIXES if pointer.startswith(each)), "")
        return pointer.removeprefix(prefix)

    return type(error)(*(replace(each, pointer=shorten(each.pointer)) for each in error.issues))


def _split(parts: Sequence[object]) -> Iterator[Sequence[object]]:
    """Groups of at most `GROUP_PARTS` parts, which name at most `MAX_STORED` stored surfaces."""
    start, ids = 0, set[str]()
    for index, part in enumerate(parts):
        if index - start == GROUP_PARTS or len(ids | _stored_ids(part)) > MAX_STORED:
            yield parts[start:index]
            start, ids = index, set()
        ids |= _stored_ids(part)
    if parts:
        yield parts[start:]


def _stored_ids(part: object) -> set[str]:
    """The id of the stored surface that a part names, if it names one."""
    path = part.get("path") if isinstance(part, dict) else getattr(part, "path", None)
    id = stored_surface(path) if isinstance(path, str) else ""
    return {id} if id else set()


def _file_id(part: object) -> str:
    """The id of the file that a part names, if it names one in the form of an id."""
    id = part.get("file") if isinstance(part, dict) else getattr(part, "file", None)
    return id if isinstance(id, str) and FILE_ID.fullmatch(id) else ""


async def _check_in_turn(
    context: Context, limits: CallLimits, parts: Sequence[object], first: int
) -> list[CheckedPart]:
    """Checks parts in turn with the work of other callers; `first` is the index of the first.

    It is a computation of its own, which does not watch the connection: it would read, and lose,
    the rest of the body. If the client has disconnected, the next reading notices it.
    """
    services, asking, *_ = context
    computation = Computation(services.threads, find_caller=lambda: asking.caller)
    try:
        async with timeout(services.settings.request_timeout):
            ids = set[str]().union(*map(_stored_ids, parts))
            named = _Named(
                {id: await _find_stored(services, computation, id) for id in ids},
                {id: await _find_size(services, id) for id in set(map(_file_id, parts)) - {""}},
            )
            check = partial(_check_parts, parts, limits, named, first)
            memory = asking.body_memory
            cost = Cost(memory, PART_SECONDS * len(parts) + BYTE_SECONDS * memory)
            return await computation.run(Work(cost, check), "check")
    except TimeoutError:
        raise OutOfTime from None
    finally:
        computation.close()


async def _find_stored(
    services: Services, computation: Computation, id: str
) -> Surface | SurfaceError:
    """A stored surface, or the error of the parts that name it."""
    try:
        return await surface_of(services, computation, id)
    except (UnknownSurface, InvalidRequest) as error:
        # The job exists: it is invalid because of what it names.
        return InvalidRequest(*error.issues)


async def _find_size(services: Services, id: str) -> int | SurfaceError:
    """The bytes of a file that parts name, or the error of these parts."""
    assert services.jobs is not None  # there is an intake
    try:
        return await services.jobs.sources.find_size(id)
    except InvalidRequest as error:
        return error


class _Named(NamedTuple):
    """The surfaces and files that parts name, or the errors of these parts."""

    surfaces: Mapping[str, Surface | SurfaceError]
    sizes: Mapping[str, int | SurfaceError]

    def find_surface(self, id: str) -> Surface:
        """The stored surface with this id."""
        surface = self.surfaces[id]
        if isinstance(surface, SurfaceError):
            raise surface
        return surface

    def find_size(self, id: str) -> int:
        """The bytes of the file with this id."""
        size = self.sizes[id]
        if isinstance(size, SurfaceError):
            raise size
        return size


def _check_parts(
    parts: Sequence[object], limits: CallLimits, named: _Named, first: int
) -> list[CheckedPart]:
    """Checks parts; `first` is the index of the first."""
    checked = []
    for index, part in enumerate(parts, first):
        checkpoint()
        try:
            checked.append(check_part(part, limits, named.find_surface, named.find_size))
        except SurfaceError as error:
            raise error.within(f"/parts/{index}") from None
    return checked
