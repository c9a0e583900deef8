"""The JSON parser, orjson, without the texts that it finds no memory for.

A text that has two blanks behind its first bracket it takes for indented to the end: 6 bytes for
each value. Where others follow, without blanks, it runs out of the memory that it has set aside,
and says so (3.13.0). Without the first blanks it counts with 2 bytes, which is the least.
"""

import re
from typing import Any

import orjson

_HEAD = re.compile(rb"[ \t\r\n]*[\[{](?P<blank>[ \t\r\n]+)")


def parse(text: bytes) -> Any:
    """The value of a JSON text, as `orjson.loads` has it.

    Raises
    ------
    orjson.JSONDecodeError
        With the place in this text.
    """
    try:
        return orjson.loads(text)
    except orjson.JSONDecodeError as error:
        head = _HEAD.match(text)
        if head is None or "memory" not in error.msg:
            raise
    start, end = head.span("blank")
    try:
        return orjson.loads(text[:start] + text[end:])
    except orjson.JSONDecodeError as error:
        place = error.pos + (end - start if error.pos >= start else 0)
        raise orjson.JSONDecodeError(error.msg, text.decode(), place) from None
