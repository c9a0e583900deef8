"""Which format to answer in: `?format=`, a suffix, or `Accept` (RFC 9110, section 12.5.1)."""

import re
from dataclasses import dataclass

from service.api.problems import InvalidQuery, NotAcceptable, UnknownSuffix
from service.encoders.format import Format
from service.encoders.registry import BY_NAME, BY_SUFFIX, FORMATS
from service.errors import Issue

DEFAULT = BY_NAME["json"]

_MAX_RANGES = 100
_QUALITY = re.compile(r"(?:0(?:\.\d{0,3})?|1(?:\.0{0,3})?)", re.ASCII)


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


def by_name(name: str) -> Format:
    """The format of this name.

    Raises
    ------
    InvalidQuery
        If there is none.
    """
    found = BY_NAME.get(name)
    if found is None:
        raise InvalidQuery(
            Issue(
                "unknown_format",
                "No format has this name.",
                "/format",
                "an unknown name",
                "one of " + ", ".join(BY_NAME),
            )
        )
    return found


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


def by_accept(header: str | None) -> Format:
    """The best format for an Accept header; JSON where the client has no preference.

    For each format the most precise range counts. Of equal qualities the more precisely named
    wins, then JSON, then the order of the registry.

    Raises
    ------
    NotAcceptable
        If the header excludes every format.
    """
    if header is None or not header.strip():
        return DEFAULT
    ranges = _ranges(header)
    best, best_rank = DEFAULT, (0.0, -1)
    for candidate in (DEFAULT, *FORMATS):
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
                "one of " + ", ".join(f.media_type for f in FORMATS),
            )
        )
    return best


def _ranges(header: str) -> list[_Range]:
    """The media ranges of a header; what is malformed matches nothing."""
    ranges: list[_Range] = []
    for item in header.lower().split(",")[:_MAX_RANGES]:
        media_range, *parameters = (part.strip() for part in item.split(";"))
        main, _, sub = media_range.partition("/")
        quality = 1.0
        for parameter in parameters:
            name, _, value = parameter.partition("=")
            if name.strip() == "q":
                text = value.strip()
                quality = float(text) if _QUALITY.fullmatch(text) else 0.0
        ranges.append(_Range(main, sub, quality))
    return ranges
