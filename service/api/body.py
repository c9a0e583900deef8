"""Reading a request body: its declared type and size first, then its bytes under a budget.

FastAPI's `max_body_size` would refuse a long body as well, but in plain text.
"""

from email.message import Message

import anyio
from starlette.requests import Request

from service.api.problems import BodyTooLarge, BodyTooSlow, UnsupportedMediaType
from service.errors import Issue
from service.schemas.document import Budget
from service.settings import Settings, document_limits


async def read_body(request: Request, settings: Settings, queries: int = 0) -> bytes:
    """The whole body of a request that carries JSON: a surface, and so many points to query.

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
    """
    check_media_type(request.headers.get("content-type"))
    _check_encoding(request.headers.get("content-encoding", "identity"))
    _check_length(request.headers.get("content-length", ""), settings)
    budget = Budget(document_limits(settings), queries)
    chunks: list[bytes] = []
    try:
        with anyio.fail_after(settings.body_timeout):
            async for chunk in request.stream():
                if budget.received + len(chunk) > settings.max_body_bytes:
                    raise body_too_large(settings)
                budget.take(chunk)
                chunks.append(chunk)
    except TimeoutError:
        raise body_too_slow(budget.received, settings) from None
    return b"".join(chunks)


def check_media_type(content_type: str | None) -> None:
    """Refuses a Content-Type that is not JSON in UTF-8."""
    header = Message()
    header["Content-Type"] = content_type or ""
    media_type = header.get_content_type()
    charset = str(header.get_param("charset", "utf-8")).lower()
    is_json = media_type == "application/json" or (
        media_type.startswith("application/") and media_type.endswith("+json")
    )
    if not is_json or charset not in ("utf-8", "utf8"):
        raise UnsupportedMediaType(
            Issue(
                "unsupported_media_type",
                "The header does not say that the body is JSON in UTF-8.",
                "/Content-Type",
                "another type" if content_type else "no type",
                "application/json",
            )
        )


def body_too_large(settings: Settings) -> BodyTooLarge:
    """The refusal of a body that is too long."""
    return BodyTooLarge(
        Issue(
            "body_too_large",
            "The body is larger than this service reads.",
            got=f"more than {settings.max_body_bytes} bytes",
            needed=f"at most {settings.max_body_bytes} bytes",
        )
    )


def body_too_slow(received: int, settings: Settings) -> BodyTooSlow:
    """The refusal of a body that does not come to its end."""
    return BodyTooSlow(
        Issue(
            "body_too_slow",
            "The body did not arrive in time.",
            got=f"{received} bytes",
            needed=f"all of it within {settings.body_timeout} s",
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


def _check_length(declared: str, settings: Settings) -> None:
    # The server has checked that it is a number; twenty digits are enough to see that it is large.
    if declared.isdecimal() and int(declared[:20]) > settings.max_body_bytes:
        raise body_too_large(settings)
