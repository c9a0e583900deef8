"""Reading a request body: its declared type and size first, then its bytes under a budget.

FastAPI's `max_body_size` would refuse a long body as well, but in plain text.
"""

import re
from collections.abc import Callable, Sequence

from starlette.requests import Request

from service.api.admission.visits import visiting
from service.api.problems import BodyTooLarge, BodyTooSlow, UnsupportedMediaType
from service.decoders.format import Decoder
from service.errors import Issue
from service.schemas.document import Budget
from service.settings.values import Settings, document_limits


async def read_body(request: Request, settings: Settings) -> bytes:
    """The whole body of a request that carries JSON.

    Raises
    ------
    UnsupportedMediaType
        From the headers alone.
    BodyTooLarge
        From Content-Length before anything is read, or as soon as too much has arrived.
    BodyTooSlow
        When the last byte has not arrived in time.
    InvalidRequest
        When the bytes would become more values than a request can hold.
    TooLarge
        When what they would become takes more memory than there is.
    Busy
        When there is not so much memory right now.
    """
    body_type(request.headers.get("content-type"))
    budget = Budget(document_limits(settings))

    def take(chunk: bytes) -> int:
        budget.take(chunk)
        return budget.memory

    too_large = body_too_large(settings, is_json=True)
    most = min(settings.max_json_bytes, settings.max_body_bytes)
    return await _read(request, settings, take, most, too_large)


async def read_file(request: Request, settings: Settings, decoder: Decoder) -> bytes:
    """The whole body of a request that carries a file; raises as `read_body` does."""
    received = 0

    def take(chunk: bytes) -> int:
        nonlocal received
        received += len(chunk)
        return decoder.memory(received)

    most = settings.max_body_bytes
    return await _read(request, settings, take, most, body_too_large(settings))


async def _read(
    request: Request,
    settings: Settings,
    take: Callable[[bytes], int],
    most: int,
    too_large: BodyTooLarge,
) -> bytes:
    """The whole body. Shown each piece as it arrives, `take` says how much memory all need."""
    arrival = visiting().arrival
    _check_encoding(request.headers.get("content-encoding", "identity"))
    declared = request.headers.get("content-length", "")
    # The server has checked that it is a number; twenty digits are enough to see that it is large.
    if declared.isdecimal() and int(declared[:20]) > most:
        raise too_large
    chunks: list[bytes] = []
    received = 0
    try:
        with arrival.within(settings.body_timeout):
            async for chunk in request.stream():
                received += len(chunk)
                if received > most:
                    raise too_large
                arrival.claim(take(chunk))
                chunks.append(chunk)
    except TimeoutError:
        raise body_too_slow(received, settings) from None
    return b"".join(chunks)


def body_type(content_type: str | None, decoders: Sequence[Decoder] = ()) -> Decoder | None:
    """What reads a body of this Content-Type, if one of these does; None for JSON in UTF-8.

    Raises
    ------
    UnsupportedMediaType
        For any other body.
    """
    media_type, charset = _media_type(content_type)
    is_utf8 = charset in ("utf-8", "utf8", "us-ascii")
    for decoder in decoders:
        if decoder.media_type == media_type and (is_utf8 or decoder.binary):
            return decoder
    if is_utf8 and (
        media_type == "application/json"
        or (media_type.startswith("application/") and media_type.endswith("+json"))
    ):
        return None
    names = ", ".join(("application/json", *(decoder.media_type for decoder in decoders)))
    raise UnsupportedMediaType(
        Issue(
            "unsupported_media_type",
            "The header does not say that the body is of a type that is taken here.",
            "/Content-Type",
            "another type" if content_type else "no type",
            f"{names}; texts in UTF-8",
        )
    )


def _media_type(content_type: str | None) -> tuple[str, str]:
    """Media type and charset of a header, in lower case (RFC 9110, section 8.3.1)."""
    media_type, semicolon, rest = (content_type or "").partition(";")
    for name, quoted, plain in _PARAMETER.findall(semicolon + rest):
        if name.lower() == "charset":
            return media_type.strip().lower(), (quoted or plain).lower()
    return media_type.strip().lower(), "utf-8"


_PARAMETER = re.compile(r';\s*([^\s=;"]+)=(?:"((?:[^"\\]|\\.)*)"|([^\s;"]*))')


def body_too_large(settings: Settings, *, is_json: bool = False) -> BodyTooLarge:
    """The refusal of a body that is too long; JSON has a limit of its own."""
    most, larger = settings.max_body_bytes, ""
    if is_json and settings.max_json_bytes < most:
        most, larger = settings.max_json_bytes, ", a larger net as .npy"
    return BodyTooLarge(
        Issue(
            "body_too_large",
            "The body is larger than this service reads.",
            got=f"more than {most} bytes",
            needed=f"at most {most} bytes{larger}",
        )
    )


def body_too_slow(received: int, settings: Settings) -> BodyTooSlow:
    """The refusal of a body that does not come to its end."""
    return BodyTooSlow(
        Issue(
            "body_too_slow",
            "The body did not arrive in time.",
            got=f"{received} bytes",
            needed=f"all of it within {settings.body_timeout:g} s",
        )
    )


def _check_encoding(encoding: str) -> None:
    if encoding.lower() != "identity":
        raise UnsupportedMediaType(
            Issue(
                "unsupported_encoding",
                "Bodies are taken uncompressed.",
                "/Content-Encoding",
                "an encoding",
                "no encoding, or identity",
            )
        )
