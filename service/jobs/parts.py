"""The parts of a job: reads them as the requests that they are, and names them by ids.

    id of a part = SHA-256 of the engine's number, the method, the canonical path and the request

Equal requests have equal ids, however they are spelled: a mesh by URL has the id of its canonical
URL, and a body that of its values. So a part that any job has computed is never computed again.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from typing import Any
from urllib.parse import parse_qsl

from service.encoders.format import FileFormat
from service.encoders.png import PNG
from service.encoders.registry import BY_SUFFIX
from service.engine.mesh.mesh import ENGINE
from service.errors import InvalidRequest, Issue, SurfaceError
from service.pipeline.calls import (
    CALLS,
    Call,
    CallLimits,
    File,
    find_format,
    plan_mesh_file,
    plan_picture_file,
)
from service.pipeline.cost import Work
from service.schemas.fields import RequestModel
from service.schemas.query import (
    canonical_query,
    parse_mesh_query,
    parse_picture_query,
    values_from_text,
)
from service.schemas.validation import validate_document
from service.storage.canonical import canonical_request
from service.storage.keys import is_id
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.kinds import Surface

_FILE_PATH = re.compile(r"/v1/surfaces/([^/?]+)/(mesh|image)\.([^/?]+)")

FindSurface = Callable[[str], Surface]
"""Returns the stored surface with an id; raises `UnknownSurface`."""


@dataclass(frozen=True, eq=False, slots=True)
class Part:
    """A part that was read: its id, its format, and its plan.

    Attributes
    ----------
    id : str
    stored : str
        The id of the stored surface that the part reads; empty if it reads none.
    fmt : FileFormat
    plan : callable
        Plans the work; the argument finds the stored surface. Raises the errors of `read_part`.
    """

    id: str
    stored: str
    fmt: FileFormat
    plan: Callable[[FindSurface], Work[File]]


def read_part(path: str, body: dict[str, Any] | None, limits: CallLimits) -> Part:
    """Read the request of a part, and build its surface; does not plan it.

    Raises
    ------
    InvalidRequest, TooLarge
        Pointers are relative to the part: `/path` for its path and query, `/body/…` for its body.
    """
    locate = partial(_locate, prefix="/path" if body is None else "/body")
    try:
        part = _read_get(path, limits) if body is None else _read_post(path, body, limits)
    except SurfaceError as error:
        raise locate(error) from None

    return replace(part, plan=lambda find_surface: plan_located(part, find_surface, locate))


def plan_located(
    part: Part, find_surface: FindSurface, locate: Callable[[SurfaceError], SurfaceError]
) -> Work[File]:
    """The work of a part; `locate` gives errors the pointers of the part, also those of the work.

    Raises
    ------
    SurfaceError
    """
    try:
        work = part.plan(find_surface)
    except SurfaceError as error:
        raise locate(error) from None

    def run() -> File:
        try:
            return work.run()
        except SurfaceError as error:
            raise locate(error) from None

    return Work(work.cost, run)


def stored_surface(path: str) -> str:
    """The id of the stored surface whose mesh or picture has this path; empty for other paths."""
    match = _FILE_PATH.fullmatch(path.partition("?")[0])
    return match[1] if match and is_id(match[1]) else ""


def _read_get(path: str, limits: CallLimits) -> Part:
    """A mesh or a picture by URL."""
    route, _, query = path.partition("?")
    match = _FILE_PATH.fullmatch(route)
    name, product, suffix = match.groups() if match is not None else ("", "", "")
    if suffix not in {"mesh": BY_SUFFIX, "image": {PNG.suffix}}.get(product, ()):
        raise unknown_path(
            "a part without a body is /v1/surfaces/{id}/mesh.{suffix}, or image.png there"
        )
    if not (name in EXAMPLES or is_id(name)):
        raise unknown_path("the name of a built-in surface, or the id of a stored one")
    parameters = parse_qsl(query, keep_blank_values=True)
    fmt: FileFormat = PNG
    if product == "image":
        picture = parse_picture_query(parameters)
        engine, text = picture.engine, canonical_query(picture)
        plan_file = partial(plan_picture_file, options=picture, limits=limits)
    else:
        fmt, mesh = BY_SUFFIX[suffix], parse_mesh_query(parameters)
        engine, text = mesh.engine, canonical_query(mesh, fmt.ignored)
        plan_file = partial(plan_mesh_file, options=mesh, fmt=fmt, limits=limits)
    if engine not in (None, ENGINE):
        message = "This service does not have this version of the engine."
        got, needed = "another version of the engine", f"engine={ENGINE}, or no engine"
        raise InvalidRequest(Issue("engine_gone", message, "/engine", got, needed))
    target = f"GET /v1/surfaces/{name}/{product}.{fmt.suffix}?{text}"

    def plan(find_surface: FindSurface) -> Work[File]:
        return plan_file(find(name).surface() if name in EXAMPLES else find_surface(name))

    stored = "" if name in EXAMPLES else name
    return Part(sha256(target.encode()).hexdigest(), stored, fmt, plan)


def _read_post(path: str, body: dict[str, Any], limits: CallLimits) -> Part:
    """A call with a body."""
    route, _, query = path.partition("?")
    call = CALLS.get(route)
    if call is None:
        raise unknown_path("one of " + ", ".join(CALLS))
    fmt = _choose_format(call, query)
    request = validate_document(call.model, body, limits.document)
    request.build()
    return Part(_post_id(call, fmt, request), "", fmt, lambda _: call.plan(request, fmt, limits))


def _post_id(call: Call, fmt: FileFormat, request: RequestModel) -> str:
    target = f"POST {call.path}?format={fmt.name}&engine={ENGINE}"
    return sha256(target.encode() + b"\n" + canonical_request(request)).hexdigest()


def _choose_format(call: Call, query: str) -> FileFormat:
    """The format that the query names, or the default."""
    values = values_from_text(parse_qsl(query, keep_blank_values=True))
    name = values.pop("format", call.default_format.name)
    if values or (query and len(call.formats) == 1):
        message, got = "This call has no parameter of this name.", "an unknown parameter"
        needed = "no parameters" if len(call.formats) == 1 else "only `format`"
        raise InvalidRequest(Issue("unknown_field", message, "/path", got, needed))
    return find_format(str(name), call.formats)


def unknown_path(needed: str) -> InvalidRequest:
    """The error of a part whose path does not belong to a call that it can make."""
    message = "No call that a job can make has this path."
    return InvalidRequest(Issue("unknown_path", message, "/path", "another path", needed))


def _locate(error: SurfaceError, prefix: str) -> SurfaceError:
    """The error with pointers relative to the part: `prefix` is `/body`, or else `/path`."""

    def place(pointer: str) -> str:
        is_path = prefix == "/path" or pointer in ("/path", "/format")
        return "/path" if is_path else prefix + pointer

    return type(error)(*(replace(issue, pointer=place(issue.pointer)) for issue in error.issues))
