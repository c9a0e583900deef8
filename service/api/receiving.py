"""Receives the body of a request: its bytes, within limits of size, memory and time."""

from asyncio import timeout
from collections.abc import Mapping

from fastapi import Request
from starlette.requests import ClientDisconnect

from service.api.computation import Computation
from service.api.errors import BodyTooLarge, BodyTooSlow, UnsupportedMediaType
from service.api.services import Services
from service.decoders.format import Decoder
from service.errors import Issue
from service.schemas.budget import DocumentBudget
from service.settings.values import Settings


async def read_body(
    request: Request,
    headers: Mapping[bytes, bytes],
    services: Services,
    computation: Computation,
    decoder: Decoder | None,
    *,
    is_kept: bool = False,
) -> bytes:
    """Reads the whole body; reserves memory for the bytes that have arrived.

    A file that `is_kept` as it is takes no memory for its content.

    Raises
    ------
    UnsupportedMediaType, BodyTooLarge, BodyTooSlow, InvalidRequest, TooLarge, Busy,
    ClientDisconnect
    """
    settings = services.settings
    if b"content-encoding" in headers:
        refuse_coding(headers)
    max_bytes = settings.max_body_bytes
    if decoder is None:
        max_bytes = min(max_bytes, settings.max_json_bytes)
    declared_length = headers.get(b"content-length", b"")
    # The server has checked that this is a number. Its first 20 digits show whether it is too
    # large: Python refuses to convert thousands of digits.
    if declared_length.isdigit() and int(declared_length[:20]) > max_bytes:
        raise body_too_large(max_bytes, settings)
    budget = DocumentBudget(services.document_limits)
    chunks: list[bytes] = []
    received_bytes, is_complete = 0, False
    try:
        with computation.timing.step("read"):
            async with timeout(settings.body_timeout):
                while not is_complete:
                    event = await request.receive()
                    if event["type"] == "http.disconnect":
                        raise ClientDisconnect
                    chunk = event.get("body", b"")
                    is_complete = not event.get("more_body", False)
                    received_bytes += len(chunk)
                    if received_bytes > max_bytes:
                        raise body_too_large(max_bytes, settings)
                    if decoder is None:
                        budget.take(chunk)
                    memory = decoder.body_memory(received_bytes) if decoder else budget.memory
                    # The chunks and the whole body are in memory at the same time.
                    computation.hold_body(2 * received_bytes if is_kept else memory)
                    chunks.append(chunk)
    except TimeoutError:
        raise body_too_slow(received_bytes, settings) from None
    return b"".join(chunks)


def refuse_coding(headers: Mapping[bytes, bytes]) -> None:
    """Raises `UnsupportedMediaType` if the body is compressed."""
    if headers.get(b"content-encoding", b"identity").lower() != b"identity":
        raise UnsupportedMediaType(
            Issue(
                "unsupported_encoding",
                "The body must not be compressed.",
                "/Content-Encoding",
                got="an encoding",
                needed="no encoding, or identity",
            )
        )


def body_too_large(max_bytes: int, settings: Settings) -> BodyTooLarge:
    """The error of a body with more than `max_bytes` bytes."""
    needed = f"at most {max_bytes} bytes"
    if max_bytes < settings.max_body_bytes:
        needed += "; a larger net can be sent as a .npy file"
    else:
        needed += " (SURFACE_MAX_BODY_BYTES)"
    return BodyTooLarge(
        Issue(
            "body_too_large",
            "The body is longer than this service reads.",
            got=f"more than {max_bytes} bytes",
            needed=needed,
        )
    )


def body_too_slow(received_bytes: int, settings: Settings) -> BodyTooSlow:
    """The error of a body that did not arrive completely in time."""
    return BodyTooSlow(
        Issue(
            "body_too_slow",
            "The body did not arrive in time.",
            got=f"{received_bytes} bytes",
            needed=f"all of it within {settings.body_timeout:g} s",
        )
    )
