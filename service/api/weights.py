"""What a client accepts, and how gladly: lists of items with weights (RFC 9110, section 12.4.2)."""

import re
from collections.abc import Iterator

MAX_ITEMS = 100
"""More than any client sends; the rest is not read."""

_WEIGHT = re.compile(r"(?:0(?:\.\d{0,3})?|1(?:\.0{0,3})?)", re.ASCII)


def weighted(header: str) -> Iterator[tuple[str, float]]:
    """The items in lower case, each with its weight from 0 to 1: 0 where it is malformed."""
    for item in header.lower().split(",")[:MAX_ITEMS]:
        name, *parameters = (part.strip() for part in item.split(";"))
        weight = 1.0
        for parameter in parameters:
            key, _, value = parameter.partition("=")
            if key.strip() == "q":
                text = value.strip()
                weight = float(text) if _WEIGHT.fullmatch(text) else 0.0
        yield name, weight
