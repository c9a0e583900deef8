"""Meshes by URL: what browsers fetch, and everything between them and us may keep."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple
from urllib.parse import parse_qsl

from starlette.requests import Request
from starlette.responses import Response

from service.api.admission.visits import attended, visiting
from service.api.answers import ChunkedResponse, disposition
from service.api.caching.answers import AnswerCache
from service.api.caching.codings import COMPRESS, Accepted, compressed
from service.api.caching.entries import Entry, RawHeaders, Subject, Variant
from service.api.caching.flights import Flights
from service.api.caching.requested import codings_of, condition_of
from service.api.caching.tags import held, is_any
from service.api.links import mesh_address
from service.api.mesh import made, report_headers
from service.api.negotiation import by_suffix
from service.api.observing.record import record_of
from service.api.problems import EngineGone
from service.api.stored import content_id, exists, surface_of
from service.api.timing import Timing
from service.api.work import Pace, Task, done
from service.encoders.format import Format
from service.engine.mesh import ENGINE
from service.errors import Issue
from service.pipeline.cost import Cost, compression_cost
from service.pipeline.encoding import written_by
from service.schemas.query import canonical_query, mesh_query


class Made(NamedTuple):
    """An answer, and how long it took to make."""

    entry: Entry
    timing: Timing


class Compression(NamedTuple):
    """A body that is to be compressed."""

    body: bytes
    compress: Callable[[bytes], bytes | None]

    @property
    def cost(self) -> Cost:
        """What it takes at most."""
        return compression_cost(len(self.body))

    def run(self) -> bytes | None:
        """The body in its coding; None where that does not pay."""
        return self.compress(self.body)


async def get_mesh(request: Request) -> Response:
    """GET /v1/surfaces/{id}/mesh.{suffix}: the options in the query.

    Comes here only if `service.api.caching.front` does not know the answer.
    """
    fmt = by_suffix(request.path_params["suffix"])
    asked = mesh_query(request.query_params.multi_items())
    pinned = asked.engine is not None
    check_engine(asked.engine)
    wanted = codings_of(request)
    condition = condition_of(request)
    query = canonical_query(asked, fmt.ignored)
    subject = _subject(request, fmt, query, written_by(asked))

    answers: AnswerCache = request.app.state.answers
    record = record_of(request.scope)
    entry = answers.get(subject.address)
    known = held(condition, wanted.order, subject.tag)
    async with attended(request):
        if known is not None and (entry is not None or await exists(request, subject.surface)):
            return _unchanged(subject.unchanged(known, pinned=pinned))
        if entry is not None:
            answers.counts.hits += 1
            record.cache = "hit"
            timing = Timing("cache;desc=hit")
            visiting().use(answers.reading(entry))
        else:
            answers.counts.misses += 1
            record.cache = "miss"
            flights: Flights = request.app.state.flights
            work = partial(_make, request, subject, fmt, query)
            made = await flights.join((subject.address, answers.age), work, sent=True)
            entry, timing = made.entry, Timing("cache;desc=miss", made.timing)
        variant = await _coded(request, entry, wanted, timing)
    answers.alias(entry, request.scope["path"], request.scope["query_string"], pinned=pinned)
    if condition is not None and is_any(condition):
        return _unchanged(subject.unchanged(variant.coding, pinned=pinned))
    headers = entry.headers(variant, pinned=pinned, timing=str(timing).encode())
    return _with_headers(ChunkedResponse(variant.body), headers)


def check_engine(engine: int | None) -> None:
    """Refuses another version of the numbers than ours.

    Raises
    ------
    EngineGone
        They cannot be computed here, now or later.
    """
    if engine not in (None, ENGINE):
        raise EngineGone(
            Issue(
                "engine_gone",
                "These numbers are not computed here any more, or not yet.",
                "/engine",
                "another version of the numbers",
                f"engine={ENGINE}, or no engine",
            )
        )


def _subject(request: Request, fmt: Format, query: str, made_by: str) -> Subject:
    """What the request asks for; raises `UnknownSurface` where nothing can have such an id.

    The bytes are named after the content of the surface, what is done with it, and what does it.
    """
    id = request.path_params["id"]
    content = content_id(id)
    root = request.scope.get("root_path", "")
    return Subject(
        address=mesh_address(root, id, fmt.suffix, query),
        surface=id,
        content=f"{content} {fmt.suffix} {query} {made_by}",
        for_ever=id == content,
    )


async def _make(request: Request, subject: Subject, fmt: Format, query: str) -> Made:
    """The answer computed, kept if it is not too large, and how long that took.

    Computed from the canonical query: what has one address is one computation.
    """
    answers: AnswerCache = request.app.state.answers
    timing, age = Timing(), answers.age
    with timing.step("surface"):
        stored = await surface_of(request, subject.surface)
    options = mesh_query(parse_qsl(query))
    is_long = stored.is_long
    _, answer = await made(request, stored.surface, (options, fmt), timing, is_long=is_long)
    name = answer.name if stored.is_hash else stored.id
    described = {
        "Content-Type": fmt.media_type,
        "Content-Disposition": disposition("inline", name, fmt),
        **report_headers(answer.report),
    }
    entry = Entry(subject, answer.content, described, request.app.state.origins.always)
    answers.put(entry, age)
    return Made(entry, timing)


async def _coded(request: Request, entry: Entry, wanted: Accepted, timing: Timing) -> Variant:
    """The answer in the coding that the client likes best; what is not kept goes as it is.

    So does what would have to wait for memory to be compressed: it has some, for which others wait.
    """
    answers: AnswerCache = request.app.state.answers
    coding = wanted.order[0]
    variant = entry.variants.get(coding)
    if variant is not None and (wanted.plain or variant.coding == coding):
        return variant
    admission = visiting().admission
    if wanted.plain and not (
        answers.holds(entry) and admission.has_room(compression_cost(len(entry.plain)).memory)
    ):
        return entry.variants["identity"]
    compress: Callable[[bytes], bytes | None] = COMPRESS[coding]
    if wanted.plain:
        compress = partial(compressed, coding)

    def planned() -> Compression:
        return Compression(entry.plain, compress)

    async def work() -> Variant:
        task = Task("compress", planned, 0, lambda _: Pace.SOON, is_long=False)
        _, body = await done(task, Compression.run, _length, Timing())
        return answers.add(entry, coding, body)

    flights: Flights = request.app.state.flights
    key = (entry.subject.address, answers.age, coding, wanted.plain)
    with timing.step("compress"):
        return await flights.join(key, work, sent=True)


def _length(body: bytes | None) -> int:
    return 0 if body is None else len(body)


def _unchanged(headers: RawHeaders) -> Response:
    return _with_headers(Response(status_code=304), headers)


def _with_headers(response: Response, headers: RawHeaders) -> Response:
    response.raw_headers = list(headers)
    return response
