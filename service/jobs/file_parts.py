"""Parts of jobs whose surface is a file: a file of the store, or of a bake's own machine.

    id of a part = SHA-256 of the engine's number, the path, the format of the file, the SHA-256 of
                   its bytes, and the values beside it

So a part has an id before its file is read, and a file that is sent twice is computed once.
"""

from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import parse_qsl

import orjson

from service.decoders.child import read_file
from service.decoders.format import Decoder
from service.decoders.refused import find_by_suffix
from service.decoders.registry import BY_NAME, BY_SUFFIX, unavailable_issue
from service.encoders.format import FileFormat
from service.engine.mesh.mesh import ENGINE
from service.errors import InvalidRequest, Issue, SurfaceError, first_part
from service.jobs.parts import FindSurface, Part, plan_located, unknown_path
from service.pipeline.calls import CALLS, Call, CallLimits, File, find_format
from service.pipeline.cost import MEMORY_SHARE, Cost, Work
from service.pipeline.files import build_file_request, check_beside
from service.schemas.fields import IGNORED, RequestModel
from service.schemas.file_fields import FIELDS, document_from_query
from service.storage.canonical import tree_of

READING_SECONDS = 4e-7
"""Estimated time to read a byte of a file."""

_UNKNOWN_SUFFIX = Issue(
    "unknown_suffix",
    "No file with this suffix is read.",
    "/file",
    "another suffix",
    "one of " + ", ".join(f".{suffix}" for suffix in BY_SUFFIX),
)


class _FileCall(NamedTuple):
    """The call of a part with a file, the format of its result, and the fields beside the file.

    `request` has a small surface in place of that of the file.
    """

    call: Call
    fmt: FileFormat
    beside: dict[str, Any]
    request: RequestModel


def decoder_of(id: str) -> Decoder:
    """The decoder of a file in the store, by its id.

    Raises
    ------
    InvalidRequest
        The service reads no files of this format; the pointer is `/file`.
    """
    decoder = BY_NAME.get(id.partition(".")[2])
    if decoder is None or not decoder.is_available():
        raise unknown_file()
    return decoder


def unknown_file() -> InvalidRequest:
    """The error of a part whose file is not in the store."""
    message = "No file is kept under this id; it may have expired."
    needed = "an id from the response of POST /v1/files"
    return InvalidRequest(Issue("unknown_file", message, "/file", "another id", needed))


def read_local_file(name: str) -> tuple[Decoder, bytes]:
    """A file on this machine, with the decoder of its suffix.

    Raises
    ------
    InvalidRequest
        The file cannot be read, or has a suffix of no file that is read; the pointer is `/file`.
    """
    suffix = Path(name).suffix.removeprefix(".").lower()
    decoder = BY_SUFFIX.get(suffix)
    if decoder is None:
        refused = find_by_suffix(suffix)
        issue = _UNKNOWN_SUFFIX if refused is None else refused.issue()
        raise InvalidRequest(replace(issue, pointer="/file"))
    if not decoder.is_available():
        raise InvalidRequest(replace(unavailable_issue(decoder), pointer="/file"))
    try:
        return decoder, Path(name).read_bytes()
    except OSError as error:
        message = "The file cannot be read."
        raise InvalidRequest(
            Issue("unknown_file", message, "/file", error.strerror or "")
        ) from None


def check_file_part(
    path: str, id: str, limits: CallLimits, find_size: Callable[[str], int]
) -> tuple[str, Cost]:
    """The id of a part with a file of the store, and its cost; the file is not read.

    The memory is that of the largest mesh by tolerance that is allowed, and what the reading of the
    file takes: as for every mesh by tolerance, no more is known before.

    Raises
    ------
    InvalidRequest
        The pointer is `/path` or `/file`.
    """
    decoder = decoder_of(id)
    size = find_size(id)
    part_id = _find_id(_read_path(path, decoder, limits), decoder, id.partition(".")[0])
    most = limits.result.max_memory
    memory = min(most, decoder.memory(size) + most // MEMORY_SHARE)
    return part_id, Cost(memory, READING_SECONDS * size)


def file_part_id(path: str, decoder: Decoder, content: bytes, limits: CallLimits) -> str:
    """The id of a part with a file; raises the errors of `check_file_part`."""
    return _find_id(_read_path(path, decoder, limits), decoder, sha256(content).hexdigest())


def read_file_part(path: str, decoder: Decoder, content: bytes, limits: CallLimits) -> Part:
    """Read the file of a part, and build its surface; does not plan it.

    Raises
    ------
    InvalidRequest, TooLarge, MalformedBody
        Pointers are relative to the part: `/path` for its path and query, and `/file/…` for the
        document that the file stands for.
    """
    file_call = _read_path(path, decoder, limits)
    call, fmt, beside, _ = file_call
    try:
        decoded = read_file(decoder, content, beside["surface"].get("type"), limits.file)
        request = build_file_request(call.model, decoder, decoded, beside, limits.document)
        request.build()
    except SurfaceError as error:
        raise _locate(error) from None

    def plan(_: FindSurface) -> Work[File]:
        work = call.plan(request, fmt, limits)
        return Work(work.cost, lambda: replace(work.run(), reading=decoded.reading))

    id = _find_id(file_call, decoder, sha256(content).hexdigest())
    part = Part(id, "", fmt, plan)
    return replace(part, plan=lambda find: plan_located(part, find, _locate))


def _read_path(path: str, decoder: Decoder, limits: CallLimits) -> _FileCall:
    """The call in the path of a part, and the fields in its query; errors point to `/path`."""
    route, _, query = path.partition("?")
    call = CALLS.get(route)
    if call is None or not call.reads_files:
        raise unknown_path("one of " + ", ".join(c.path for c in CALLS.values() if c.reads_files))
    try:
        pairs = parse_qsl(query, keep_blank_values=True)
        beside = document_from_query(pairs, decoder.fields)
        fmt = call.default_format
        if len(call.formats) > 1:
            fmt = find_format(str(beside.pop("format", fmt.name)), call.formats)
        request = check_beside(call.model, decoder, beside, limits.document)
    except SurfaceError as error:
        raise type(error)(*(replace(issue, pointer="/path") for issue in error.issues)) from None
    return _FileCall(call, fmt, beside, request)


def _find_id(file_call: _FileCall, decoder: Decoder, digest: str) -> str:
    call, fmt, beside, request = file_call
    names = type(request).model_fields.keys() - {"surface", *IGNORED}
    others = {name: tree_of(getattr(request, name)) for name in names}
    target = f"POST {call.path}?format={fmt.name}&engine={ENGINE}\n{decoder.name} {digest}\n"
    values = orjson.dumps([beside["surface"], others], option=orjson.OPT_SORT_KEYS)
    return sha256(target.encode() + values).hexdigest()


def _locate(error: SurfaceError) -> SurfaceError:
    """The error with pointers relative to the part: a field is in its query or in its file."""

    def place(pointer: str) -> str:
        inner = pointer.removeprefix("/surface")
        is_beside = inner == pointer != "" or first_part(inner) in FIELDS
        return "/path" if is_beside else f"/file{pointer}"

    return type(error)(*(replace(issue, pointer=place(issue.pointer)) for issue in error.issues))
