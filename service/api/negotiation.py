"""Chooses a response's format and coding: `?format=`, a suffix, `Accept`, and `Accept-Encoding`.

Source: RFC 9110, section 12.5.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import TypeAlias, TypeVar
from urllib.parse import parse_qsl

from starlette.requests import Request

from service.api.caching.codings import (
    CODINGS,
    MAX_CACHED,
    Codings,
    parse_accepted_codings,
    parse_quality_values,
)
from service.api.errors import EngineGone, InvalidQuery, NotAcceptable, UnknownSuffix
from service.encoders.format import FileFormat, Format
from service.encoders.registry import BY_SUFFIX
from service.engine.mesh.mesh import ENGINE
from service.errors import InvalidRequest, Issue, pointer
from service.pipeline.calls import find_format
from service.schemas.query import values_from_text
from service.schemas.scan import shorten

AnyFormat = TypeVar("AnyFormat", bound=FileFormat)
Values = TypeVar("Values")
Pairs: TypeAlias = list[tuple[str, str]]


def format_by_name(name: str, formats: Sequence[AnyFormat]) -> AnyFormat:
    """The format of `formats` with this name.

    Raises
    ------
    InvalidQuery
        If no format has this name.
    """
    try:
        return find_format(name, formats)
    except InvalidRequest as error:
        raise InvalidQuery(*error.issues) from None


def format_by_suffix(suffix: str) -> Format:
    """The format with this file suffix.

    Raises
    ------
    UnknownSuffix
        If no format has this suffix.
    """
    fmt = BY_SUFFIX.get(suffix)
    if fmt is None:
        raise UnknownSuffix(
            Issue(
                "unknown_suffix",
                "No format has this suffix.",
                "/suffix",
                got="an unknown suffix",
                needed="one of " + ", ".join(BY_SUFFIX),
            )
        )
    return fmt


def format_by_accept(header: str | None, formats: Sequence[AnyFormat]) -> AnyFormat:
    """The format that an Accept header prefers; JSON if it has no preference.

    A format has the quality value of the most specific media range that includes the format. Among
    equal quality values, the more specific range wins, then JSON, which must be in `formats`, then
    the first in `formats`.

    Raises
    ------
    NotAcceptable
        If the header excludes every format.
    """
    types = tuple(f.media_type for f in formats)
    header = header or ""
    best = _choose_cached(header, types) if len(header) <= MAX_CACHED else _choose(header, types)
    if best is None:
        raise NotAcceptable(
            Issue(
                "not_acceptable",
                "The service writes no format that you accept.",
                "/Accept",
                got="no media type of this service",
                needed="one of " + ", ".join(types),
            )
        )
    return next(f for f in formats if f.media_type == best)


def _choose(header: str, types: tuple[str, ...]) -> str | None:
    """The media type that an Accept header prefers; None if it excludes all."""
    default = "application/json"
    if not header.strip():
        return default
    ranges = list(parse_quality_values(header))
    best, best_rank = None, (0.0, -1)
    for candidate in (default, *types):
        # From the least specific range that matches to the most specific one.
        names = ("*/*", f"{candidate.partition('/')[0]}/*", candidate)
        matches = [(names.index(name), quality) for name, quality in ranges if name in names]
        specificity, quality = max(matches, default=(-1, 0.0))
        if quality > 0 and (quality, specificity) > best_rank:
            best, best_rank = candidate, (quality, specificity)
    return best


_choose_cached = lru_cache(maxsize=256)(_choose)


def read_query(read: Callable[[Pairs], Values], pairs: Pairs) -> Values:
    """The values that `read` finds in a query; raises `InvalidQuery` where it refuses them."""
    try:
        return read(pairs)
    except InvalidRequest as error:
        raise InvalidQuery(*error.issues) from None


def parse_format_query(query: bytes) -> str | None:
    """The name of the format in a POST's query, or None; other parameters are refused.

    Raises
    ------
    InvalidQuery
        For any other parameter, or if `format` is repeated.
    """
    return _parse_cached(query) if len(query) <= MAX_CACHED else _parse_format(query)


def _parse_format(query: bytes) -> str | None:
    pairs = parse_qsl(query.decode("latin-1"), keep_blank_values=True)
    values = read_query(values_from_text, pairs)
    refuse_parameters(values.keys() - {"format"}, "only `format`; options go into the body")
    return str(values["format"]) if values else None


_parse_cached = lru_cache(maxsize=256)(_parse_format)


def refuse_parameters(names: Iterable[str], needed: str = "no parameters") -> None:
    """Raises `InvalidQuery` if the query has parameters of these names, which the call lacks."""
    message, got = "This call has no parameter of this name.", "an unknown parameter"
    paths = [pointer([shorten(name)]) for name in sorted(names)]
    if paths:
        raise InvalidQuery(*(Issue("unknown_field", message, path, got, needed) for path in paths))


def check_engine(engine: int | None) -> None:
    """Refuses every version of the engine (`engine=…`) except the version of this service.

    Raises
    ------
    EngineGone
        The query names another version.
    """
    if engine not in (None, ENGINE):
        raise EngineGone(
            Issue(
                "engine_gone",
                "This service does not have this version of the engine.",
                "/engine",
                got="another version of the engine",
                needed=f"engine={ENGINE}, or no engine",
            )
        )


def codings_of(request: Request) -> Codings:
    """The codings that the client accepts.

    Raises
    ------
    NotAcceptable
        If the client accepts no coding of this service.
    """
    return codings_by_header(_header(request, "accept-encoding"))


def accepts_brotli(request: Request) -> bool:
    """Whether the client accepts `br`, in which only files come that were built so."""
    header = _header(request, "accept-encoding") or b""
    qualities = dict(parse_quality_values(header.decode("latin-1")))
    return qualities.get("br", qualities.get("*", 0.0)) > 0


def condition_of(request: Request) -> bytes | None:
    """The If-None-Match header, its lines joined; None if the client did not send it."""
    return _header(request, "if-none-match")


def codings_by_header(header: bytes | None) -> Codings:
    """The codings that an Accept-Encoding header allows.

    Raises
    ------
    NotAcceptable
        If the header allows no coding of this service.
    """
    accepted = parse_accepted_codings(header)
    if not accepted:
        raise NotAcceptable(
            Issue(
                "not_acceptable",
                "The Accept-Encoding header excludes every coding of this service.",
                "/Accept-Encoding",
                got="no coding of this service",
                needed="one of " + ", ".join(CODINGS),
            )
        )
    return accepted


def _header(request: Request, name: str) -> bytes | None:
    lines = request.headers.getlist(name)
    return ", ".join(lines).encode("latin-1") if lines else None
