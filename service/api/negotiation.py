"""Which format to answer in: `?format=`, a suffix, or `Accept` (RFC 9110, section 12.5.1)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

from service.api.problems import InvalidQuery, NotAcceptable, UnknownSuffix
from service.api.quality_values import quality_values
from service.encoders.format import FileFormat, Format
from service.encoders.registry import BY_NAME, BY_SUFFIX
from service.errors import InvalidRequest, Issue, pointer
from service.schemas.query import values_from_text
from service.schemas.scan import shortened

USUAL_HEADER = 200
"""Characters of an Accept header whose choice is remembered."""

AnyFormat = TypeVar("AnyFormat", bound=FileFormat)


@dataclass(frozen=True, slots=True)
class _Range:
    """One media range of an Accept header."""

    type: str
    subtype: str
    quality: float

    def precision(self, media_type: str) -> int:
        """2 for the very type, 1 for `model/*`, 0 for `*/*`, -1 where it does not match."""
        main, _, sub = media_type.partition("/")
        if (self.type, self.subtype) == ("*", "*"):
            return 0
        if self.type != main:
            return -1
        return {sub: 2, "*": 1}.get(self.subtype, -1)


def by_name(name: str, formats: Sequence[AnyFormat]) -> AnyFormat:
    """The format of this name among those that can be written.

    Raises
    ------
    InvalidQuery
        If there is none.
    """
    found = {f.name: f for f in formats}
    if name not in found:
        known = name in BY_NAME
        raise InvalidQuery(
            Issue(
                "unsupported_by_format" if known else "unknown_format",
                f"The format {name} has no place for this."
                if known
                else "No format has this name.",
                "/format",
                "a format of surfaces" if known else "an unknown name",
                "one of " + ", ".join(found),
            )
        )
    return found[name]


def by_suffix(suffix: str) -> Format:
    """The format that is written under this suffix.

    Raises
    ------
    UnknownSuffix
        If there is none.
    """
    found = BY_SUFFIX.get(suffix)
    if found is None:
        raise UnknownSuffix(
            Issue(
                "unknown_suffix",
                "No format is written under this suffix.",
                "/suffix",
                "an unknown suffix",
                "one of " + ", ".join(BY_SUFFIX),
            )
        )
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
    best = _remembered(header, types) if len(header) <= USUAL_HEADER else _choose(header, types)
    if best is None:
        raise NotAcceptable(
            Issue(
                "not_acceptable",
                "No format that you accept is written here.",
                "/Accept",
                "none of the formats written here",
                "one of " + ", ".join(types),
            )
        )
    return next(f for f in formats if f.media_type == best)


def _choose(header: str, types: tuple[str, ...]) -> str | None:
    """The best of these media types for an Accept header; None if it excludes all of them."""
    default = "application/json"
    if not header.strip():
        return default
    # What is malformed matches nothing.
    parts = [(name.partition("/"), quality) for name, quality in quality_values(header)]
    ranges = [_Range(main, sub, quality) for (main, _, sub), quality in parts]
    best, best_rank = default, (0.0, -1)
    for candidate in (default, *types):
        matches = [(r.precision(candidate), r.quality) for r in ranges]
        precision, quality = max(matches, default=(-1, 0.0))
        rank = (quality, precision)
        if precision >= 0 and quality > 0 and rank > best_rank:
            best, best_rank = candidate, rank
    return best if best_rank[0] > 0.0 else None


_remembered = lru_cache(maxsize=256)(_choose)


def only_format(query: Iterable[tuple[str, str]]) -> str | None:
    """The format that the query of a POST names, if it does; it has no other parameter.

    Raises
    ------
    InvalidQuery
        For any other parameter, and a repeated one.
    """
    try:
        values = values_from_text(query)
    except InvalidRequest as error:
        raise InvalidQuery(*error.issues) from None
    _refuse_unknown(values.keys() - {"format"}, "only `format`; options go into the body")
    return str(values["format"]) if values else None


def no_parameters(names: Iterable[str]) -> None:
    """Refuses every query parameter, where there is nothing to choose."""
    _refuse_unknown(names, "no parameters")


def _refuse_unknown(names: Iterable[str], needed: str) -> None:
    issues = [
        Issue(
            "unknown_field",
            "There is no parameter of this name.",
            pointer([shortened(name)]),
            "an unknown parameter",
            needed,
        )
        for name in sorted(names)
    ]
    if issues:
        raise InvalidQuery(*issues)
