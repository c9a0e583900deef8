"""The type of a body: the decoder that reads it, and the errors of files that none reads."""

import re
from collections.abc import Sequence
from dataclasses import replace

from service.api.errors import UnsupportedMediaType
from service.decoders import refused
from service.decoders.format import Decoder
from service.decoders.registry import find_by_content, unavailable_issue
from service.errors import Issue

_HEADER = "/Content-Type"


def decoder_of_body(content_type: str, decoders: Sequence[Decoder]) -> Decoder | None:
    """The decoder of a body of this Content-Type; None for JSON in UTF-8.

    Raises
    ------
    UnsupportedMediaType
        For any other body.
    """
    if content_type == "application/json":  # most often
        return None
    media_type, charset = parse_content_type(content_type)
    is_utf8 = charset in ("utf-8", "utf8", "us-ascii")
    for decoder in decoders:
        if decoder.media_type == media_type and (is_utf8 or decoder.is_binary):
            if not decoder.is_available():
                raise UnsupportedMediaType(replace(unavailable_issue(decoder), pointer=_HEADER))
            return decoder
    is_json = media_type == "application/json" or (
        media_type.startswith("application/") and media_type.endswith("+json")
    )
    if is_json and is_utf8:
        return None
    known = refused.find_by_media_type(media_type)
    if known is not None and any(decoder.is_cad for decoder in decoders):
        raise UnsupportedMediaType(replace(known.issue(), pointer=_HEADER))
    raise unread_type(content_type, decoders)


def unread_type(
    content_type: str, decoders: Sequence[Decoder], *, reads_json: bool = True
) -> UnsupportedMediaType:
    """The error of a body of a type that a call does not read."""
    names = [decoder.media_type for decoder in decoders]
    return UnsupportedMediaType(
        Issue(
            "unsupported_media_type",
            "This call does not read bodies of this type.",
            _HEADER,
            got="another type" if content_type else "no type",
            needed=f"{', '.join((*('application/json',) * reads_json, *names))}; texts in UTF-8",
        )
    )


_PARAMETER = re.compile(r';\s*([^\s=;"]+)=(?:"((?:[^"\\]|\\.)*)"|([^\s;"]*))')


def parse_content_type(content_type: str) -> tuple[str, str]:
    """Media type and charset of a Content-Type, in lower case (RFC 9110, section 8.3.1)."""
    media_type, semicolon, parameters = content_type.partition(";")
    for name, quoted, plain in _PARAMETER.findall(semicolon + parameters):
        if name.lower() == "charset":
            return media_type.strip().lower(), (quoted or plain).lower()
    return media_type.strip().lower(), "utf-8"


def check_content(content: bytes, decoder: Decoder) -> None:
    """Refuse a CAD file that begins as one of another format, whatever its Content-Type says.

    Raises
    ------
    UnsupportedMediaType
    """
    if not decoder.is_cad:
        return
    if (known := refused.find_by_content(content)) is not None:
        raise UnsupportedMediaType(replace(known.issue(), pointer=_HEADER))
    found = find_by_content(content)
    if found not in (None, decoder):
        raise UnsupportedMediaType(
            Issue(
                "unsupported_media_type",
                "The file begins as one of another format.",
                _HEADER,
                got=f"a file of {found.title}, as {decoder.media_type}",
                needed=found.media_type,
            )
        )
