"""Lists of what a client accepts, with quality values (RFC 9110, section 12.4.2)."""

import re
from collections.abc import Iterator

MAX_ITEMS = 100
"""Items of a list that are read: more than any client sends."""

_QUALITY = re.compile(r"(?:0(?:\.\d{0,3})?|1(?:\.0{0,3})?)", re.ASCII)


def quality_values(header: str) -> Iterator[tuple[str, float]]:
    """The items of a list in lower case with their quality values (RFC 9110, section 12.4.2).

    A quality value is from 0 to 1, and 0 where it is malformed.
    """
    for item in header.lower().split(",")[:MAX_ITEMS]:
        name, *parameters = (part.strip() for part in item.split(";"))
        quality = 1.0
        for parameter in parameters:
            key, _, value = parameter.partition("=")
            if key.strip() == "q":
                text = value.strip()
                quality = float(text) if _QUALITY.fullmatch(text) else 0.0
        yield name, quality
