"""Which format and coding to answer in: `?format=`, a suffix, `Accept`, and `Accept-Encoding`.

RFC 9110, section 12.5; and the answers that a client has already.
"""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import TypeVar
from urllib.parse import parse_qsl

from starlette.requests import Request

from service.api.caching.codings import CODINGS, Accepted, accepted, quality_values
from service.api.problems import InvalidQuery, NotAcceptable, UnknownSuffix
from service.encoders.format import FileFormat, Format
from service.encoders.registry import BY_NAME, BY_SUFFIX
from service.errors import InvalidRequest, Issue, pointer
from service.schemas.query import values_from_text
from service.schemas.scan import shortened

USUAL = 200
"""Characters of an Accept header, or of a query, whose meaning is remembered."""

AnyFormat = TypeVar("AnyFormat", bound=FileFormat)


def by_name(name: str, formats: Sequence[AnyFormat]) -> AnyFormat:
    """The format of this name among those that can be written.

    Raises
    ------
    InvalidQuery
        If there is none.
    """
    for fmt in formats:
        if fmt.name == name:
            return fmt
    code = "unsupported_by_format" if name in BY_NAME else "unknown_format"
    message, got = "No format has this name.", "an unknown name"
    if name in BY_NAME:
        message, got = f"The format {name} has no place for this.", "a format of surfaces"
    needed = "one of " + ", ".join(fmt.name for fmt in formats)
    raise InvalidQuery(Issue(code, message, "/format", got, needed))


def by_suffix(suffix: str) -> Format:
    """The format that is written under this suffix.

    Raises
    ------
    UnknownSuffix
        If there is none.
    """
    found = BY_SUFFIX.get(suffix)
    if found is None:
        message, got = "No format is written under this suffix.", "an unknown suffix"
        needed = "one of " + ", ".join(BY_SUFFIX)
        raise UnknownSuffix(Issue("unknown_suffix", message, "/suffix", got, needed))
    return found


def by_accept(header: str | None, formats: Sequence[AnyFormat]) -> AnyFormat:
    """The best of some formats for an Accept header; JSON where the client has no preference.

    For each format the most precise range counts. Of equal qualities the more precisely named
    wins, then JSON, then the order of the formats.

    Raises
    ------
    NotAcceptable
        If the header excludes every format.
    """
    types = tuple(f.media_type for f in formats)
    header = header or ""
    best = _remembered(header, types) if len(header) <= USUAL else _choose(header, types)
    if best is None:
        message, needed = "No format that you accept is written here.", "one of " + ", ".join(types)
        got = "none of the formats written here"
        raise NotAcceptable(Issue("not_acceptable", message, "/Accept", got, needed))
    return next(f for f in formats if f.media_type == best)


def _choose(header: str, types: tuple[str, ...]) -> str | None:
    """The best of these media types for an Accept header; None if it excludes all of them."""
    default = "application/json"
    if not header.strip():
        return default
    ranges = list(quality_values(header))
    best, best_rank = None, (0.0, -1)
    for candidate in (default, *types):
        # From the least precise range that matches to the most precise one.
        names = ("*/*", f"{candidate.partition('/')[0]}/*", candidate)
        matches = [(names.index(name), quality) for name, quality in ranges if name in names]
        precision, quality = max(matches, default=(-1, 0.0))
        if quality > 0 and (quality, precision) > best_rank:
            best, best_rank = candidate, (quality, precision)
    return best


_remembered = lru_cache(maxsize=256)(_choose)


def only_format(query: bytes) -> str | None:
    """The format that the query of a POST names, if it does; it has no other parameter.

    Raises
    ------
    InvalidQuery
        For any other parameter, and a repeated one.
    """
    return _remembered_format(query) if len(query) <= USUAL else _named_format(query)


def _named_format(query: bytes) -> str | None:
    try:
        values = values_from_text(parse_qsl(query.decode("latin-1"), keep_blank_values=True))
    except InvalidRequest as error:
        raise InvalidQuery(*error.issues) from None
    _refuse_unknown(values.keys() - {"format"}, "only `format`; options go into the body")
    return str(values["format"]) if values else None


_remembered_format = lru_cache(maxsize=256)(_named_format)


def no_parameters(names: Iterable[str]) -> None:
    """Refuses every query parameter, where there is nothing to choose."""
    _refuse_unknown(names, "no parameters")


def _refuse_unknown(names: Iterable[str], needed: str) -> None:
    message, got = "There is no parameter of this name.", "an unknown parameter"
    places = [pointer([shortened(name)]) for name in sorted(names)]
    if places:
        raise InvalidQuery(*(Issue("unknown_field", message, at, got, needed) for at in places))


def codings_of(request: Request) -> Accepted:
    """The codings that the client takes; raises what `check_codings` raises."""
    return check_codings(_header(request, "accept-encoding"))


def condition_of(request: Request) -> bytes | None:
    """If-None-Match, its lines joined; None where the answer is wanted in any case."""
    return _header(request, "if-none-match")


def check_codings(header: bytes | None) -> Accepted:
    """What an Accept-Encoding header allows.

    Raises
    ------
    NotAcceptable
        If that is nothing.
    """
    wanted = accepted(header)
    if not wanted.order:
        message = "Every coding that is made here is excluded."
        got, needed = "none of the codings made here", "one of " + ", ".join(CODINGS)
        raise NotAcceptable(Issue("not_acceptable", message, "/Accept-Encoding", got, needed))
    return wanted


def _header(request: Request, name: str) -> bytes | None:
    lines = request.headers.getlist(name)
    return ", ".join(lines).encode("latin-1") if lines else None
