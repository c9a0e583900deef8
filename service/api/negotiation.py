"""Which format to answer in: `?format=`, a suffix, or `Accept` (RFC 9110, section 12.5.1)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from service.api.problems import InvalidQuery, NotAcceptable, UnknownSuffix
from service.api.weights import weighted
from service.encoders.format import FileFormat, Format
from service.encoders.registry import BY_NAME, BY_SUFFIX
from service.errors import Issue

DEFAULT = "json"
"""Name of the format that is written where the client has no preference."""

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
    default = by_name(DEFAULT, formats)
    if header is None or not header.strip():
        return default
    ranges = _ranges(header)
    best, best_rank = default, (0.0, -1)
    for candidate in (default, *formats):
        matches = [(r.precision(candidate.media_type), r.quality) for r in ranges]
        precision, quality = max(matches, default=(-1, 0.0))
        rank = (quality, precision)
        if precision >= 0 and quality > 0 and rank > best_rank:
            best, best_rank = candidate, rank
    if best_rank[0] == 0.0:
        raise NotAcceptable(
            Issue(
                "not_acceptable",
                "No format that you accept is written here.",
                "/Accept",
                "none of the formats written here",
                "one of " + ", ".join(f.media_type for f in formats),
            )
        )
    return best


def _ranges(header: str) -> list[_Range]:
    """The media ranges of a header; what is malformed matches nothing."""
    ranges: list[_Range] = []
    for media_range, quality in weighted(header):
        main, _, sub = media_range.partition("/")
        ranges.append(_Range(main, sub, quality))
    return ranges
