"""The calls of a client without a server: computed in this process, with the same answers."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from threadpoolctl import ThreadpoolController

from service.api.problems import NOT_FOUND, problem_document, problem_of
from service.client.bodies import unwrap, write_json, write_query
from service.client.call import Direct, Part
from service.client.clients import Calls
from service.client.errors import ServiceError, read_problem
from service.client.given_mesh import MeshFile, read_mesh
from service.client.jobs import Progress, show_nothing
from service.client.surfaces import FILE_FIELDS, find_media_type, read_json
from service.decoders.child import read_file
from service.decoders.format import DEFAULT_FILE_LIMITS
from service.decoders.registry import DECODERS
from service.errors import Issue, SurfaceError, UnknownSurface
from service.pipeline.calls import CALLS, CallLimits, find_format
from service.pipeline.estimate import plan_estimate
from service.pipeline.limits import DEFAULT_LIMITS
from service.pipeline.mesh import select_encode_options
from service.schemas.document import DEFAULT_LIMITS as DOCUMENT_LIMITS
from service.schemas.file_fields import add_fields, check_fields, surface_fields
from service.schemas.request import MeshRequest, SurfaceRequest
from service.schemas.surfaces import definition
from service.schemas.validation import validate_document
from service.storage.canonical import plan_content
from service.surface.examples.catalogue import EXAMPLES
from service.surface.kinds import Surface

A = TypeVar("A")

LIMITS = CallLimits(
    DOCUMENT_LIMITS, replace(DEFAULT_LIMITS, max_mesh_faces=sys.maxsize), DEFAULT_FILE_LIMITS
)
"""The limits of a service with default settings, but no limit of time: no request waits."""


class Local(Calls, Direct):
    """The calls of `Client`, computed in this process, without a server.

    Errors are those of a service. `store` keeps a surface as long as this object lives; `sign` is
    refused, as there are no URLs.
    """

    def __init__(self) -> None:
        self._stored: dict[str, Surface] = {}

    def perform(self, part: Part[A]) -> A:
        """The answer of a call."""
        return part.call.read(self._run(part, part.call.format))

    def file(self, part: Part[Any], format: str) -> bytes:
        """The answer of a call as a file, in the format of this name."""
        return self._run(part, format)

    def job(
        self,
        parts: Sequence[Part[A]],
        *,
        timeout: float | None = None,
        progress: Progress = show_nothing,
    ) -> list[A | ServiceError]:
        """The answers of several calls, computed one after the other, or their errors.

        There is nothing to wait for, so `timeout` and `progress` have no effect.
        """
        del timeout, progress
        results: list[A | ServiceError] = []
        for part in parts:
            try:
                results.append(self.perform(part))
            except ServiceError as error:
                results.append(error)
        return results

    def _run(self, part: Part[Any], format: str) -> bytes:
        """The bytes that a service would answer; errors are those of its problem documents."""
        if part.call.subject == "url":
            raise read_problem(problem_document(NOT_FOUND))
        try:
            # BLAS on one thread, as in a service: sums of several threads have other last bits.
            with _find_pools().limit(limits=1, user_api="blas"):
                return self._compute(part, format)
        except SurfaceError as error:
            raise read_problem(problem_document(problem_of(error), error.issues)) from None

    def _compute(self, part: Part[Any], format: str) -> bytes:
        """The bytes of the answer."""
        path = part.call.path
        if path == "/v1/surfaces":
            request = self._parse(SurfaceRequest, part)
            surface = request.to_surface()
            id, _ = plan_content(surface).run()
            self._stored[id] = surface
            return write_json({"id": id})
        if path == "/v1/estimate":
            request = self._parse(MeshRequest, part)
            options, encode = request.mesh_options(), select_encode_options(request)
            return plan_estimate(request.to_surface(), options, encode, LIMITS.result).run()
        call = CALLS[path]
        fmt = find_format(format, call.formats)
        work = call.plan(self._parse(call.model, part), fmt, LIMITS)
        return bytes(work.run().content)

    def _parse(self, model: type[Any], part: Part[Any]) -> Any:
        """The request of a call as its model."""
        subject = unwrap(part.subject)
        fields = {name: value for name, value in part.fields.items() if value is not None}
        mesh = {}
        if "mesh" in fields:
            mesh["mesh"] = _prepare_mesh(read_mesh(fields.pop("mesh")))
        reading = None
        if part.call.subject == "surface" and isinstance(subject, str):
            document = {"surface": definition(self._find(subject), flat=True)}
        elif isinstance(subject, Path):
            document, reading = _read(subject, fields)
            fields = {name: value for name, value in fields.items() if name not in FILE_FIELDS}
        else:
            document = {} if subject is None else {part.call.subject: _to_plain(subject)}
        request = validate_document(model, document | _to_plain(fields) | mesh, LIMITS.document)
        if isinstance(request, SurfaceRequest):
            request.keep_reading(reading)
        return request

    def _find(self, id: str) -> Surface:
        """The surface with an id: built in, or stored by this object."""
        if id in self._stored:
            return self._stored[id]
        if id in EXAMPLES:
            return EXAMPLES[id].surface()
        raise UnknownSurface(Issue("unknown_surface", "No surface has this id.", "/id"))


@cache
def _find_pools() -> ThreadpoolController:
    """The threads of BLAS, which are searched for once."""
    return ThreadpoolController()


def _read(path: Path, fields: Mapping[str, Any]) -> tuple[dict[str, Any], Mapping[str, Any] | None]:
    """The request in a file, and the report of reading it; `fields` may have those of a surface."""
    if path.suffix.lower() == ".json" and (document := read_json(path)) is not None:
        return document, None
    media_type = find_media_type(path)
    decoder = next(each for each in DECODERS if each.media_type == media_type)
    texts = write_query({name: fields[name] for name in fields.keys() & FILE_FIELDS})
    check_fields(texts, decoder.fields)
    decoded = read_file(decoder, path.read_bytes(), texts.get("type"), LIMITS.file)
    surface = add_fields(decoded.tree, surface_fields(texts), is_cad=decoder.is_cad)
    return {"surface": surface}, decoded.reading


def _prepare_mesh(mesh: MeshFile | dict[str, Any]) -> dict[str, Any]:
    """A mesh as the model of requests takes it: the bytes of a file, or copies of arrays."""
    if isinstance(mesh, MeshFile):
        return {"file": mesh.content, "format": mesh.format}
    return {
        key: value.copy() if isinstance(value, np.ndarray) else _to_plain(value)
        for key, value in mesh.items()
    }


def _to_plain(value: Any) -> Any:
    """A value as the models of requests take it; arrays of points stay arrays, but are copied."""
    if isinstance(value, np.ndarray):
        is_grid = value.ndim > 1 and value.dtype.kind == "f"
        return np.array(value, np.float64) if is_grid else value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return {key: _to_plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_to_plain(item) for item in value]
    return value
