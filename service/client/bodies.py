"""Requests as values: a call with its arguments becomes a URL, a body and its media type."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any
from urllib.parse import quote, urlencode

import numpy as np

from service.client.answers import Converted, Stored
from service.client.call import Part
from service.client.given_mesh import MEDIA_TYPES as MESH_TYPES
from service.client.given_mesh import MeshFile, is_large, read_mesh, write_file
from service.client.surfaces import FILE_FIELDS, find_media_type, read_json

JSON, NPY = "application/json", "application/x-npy"

_MEDIA_TYPES = MappingProxyType({"json": JSON, "npz": "application/x-npz", "png": "image/png"})
"""The media types of answers, by the names of their formats."""

ANY = "*/*"
"""The media type of a response that may have any."""

MAX_JSON_NET = 1 << 20
"""Bytes of a control net from which on it is sent as an array, not as JSON."""

_NET_FIELDS = FILE_FIELDS - {"invalid_faces"} | {"control_net", "weights"}
"""Fields of a surface that can be sent as an array, with the others in the query."""

_ONLY_IN_BODIES = frozenset({"camera", "pixel_tolerance"})
"""Options of a mesh that a query cannot have."""

_ARRAYS = MappingProxyType({"/v1/project": "points", "/v1/intersect": "rays"})
"""The field that may be an array beside the id of a surface, by the path of the call."""


@dataclass(frozen=True, slots=True)
class Request:
    """A request.

    Attributes
    ----------
    method, path : str
    query : Mapping
        The parameters of the URL, as text.
    content : bytes
        The body; empty for a GET.
    media_type : str
        That of the body.
    accept : str
        The media type of the response, or `ANY`.
    """

    method: str
    path: str
    query: Mapping[str, str] = field(default_factory=dict)
    content: bytes = b""
    media_type: str = JSON
    accept: str = JSON

    @property
    def url(self) -> str:
        """The path with its query."""
        return self.path + ("?" + urlencode(self.query) if self.query else "")


def build_request(part: Part[Any], format: str | None = None) -> Request | None:
    """The request of a call; None if its body must have the surface, and that is not known yet.

    This is so for the id of a surface, and for a file, if the call takes only dictionaries.

    `format` is the name of the format of the answer; by default that of the call.
    """
    call, subject = part.call, unwrap(part.subject)
    accept = _MEDIA_TYPES[call.format] if format is None else ANY
    format = format or call.format
    # What a call answers if no format is named.
    unasked = "png" if call.format == "png" else "json"
    query = {} if format == unasked else {"format": format}
    fields = {name: value for name, value in part.fields.items() if value is not None}
    if "mesh" in call.names:
        return _build_check(call.path, subject, fields, accept)
    if call.subject == "surface" and isinstance(subject, str):
        if call.format != "json" and not fields.keys() & _ONLY_IN_BODIES:
            path = f"/v1/surfaces/{quote(subject, safe='')}/{call.__name__}.{format}"
            return Request("GET", path, write_query(fields), accept=accept)
        return _build_array_request(call.path, subject, fields, query, accept)
    if isinstance(subject, Path):
        return _build_file_request(part, subject, fields, query, accept)
    if call.reads_files and _is_large_net(subject) and not fields.keys() & _ONLY_IN_BODIES:
        beside = {k: v for k, v in subject.items() if k not in ("control_net", "weights")}
        query = write_query(beside | fields) | query
        return Request("POST", call.path, query, _write_net(subject), NPY, accept)
    document = fields if subject is None else {call.subject: subject} | fields
    return _post(call.path, document, query, accept)


def _build_file_request(
    part: Part[Any],
    path: Path,
    fields: Mapping[str, Any],
    query: Mapping[str, str],
    accept: str,
) -> Request | None:
    """The request with a file as its body; None if the call takes no files of this kind."""
    call = part.call
    document = read_json(path) if path.suffix.lower() == ".json" else None
    if document is not None:
        return _post(call.path, {**document, **fields}, query, accept)
    if not call.reads_files:
        return None
    media_type, query = find_media_type(path), {**write_query(fields), **query}
    return Request("POST", call.path, query, path.read_bytes(), media_type, accept)


def _build_check(path: str, subject: Any, fields: Mapping[str, Any], accept: str) -> Request | None:
    """The request with a mesh: beside an id as a file, otherwise in a document with the surface.

    None if its body must have the surface, and that is not known yet.
    """
    others = {name: value for name, value in fields.items() if name != "mesh"}
    mesh = read_mesh(fields["mesh"])
    if isinstance(mesh, dict) and (isinstance(subject, str) or is_large(mesh)):
        mesh = write_file(mesh) or mesh
    if isinstance(subject, str) and isinstance(mesh, MeshFile):
        query = {**write_query(others), "surface": subject}
        return Request("POST", path, query, mesh.content, MESH_TYPES[mesh.format], accept)
    document = {"surface": subject}
    if isinstance(subject, Path) and subject.suffix.lower() == ".json":
        document = read_json(subject) or document
    if isinstance(document.get("surface"), str | Path):
        return None
    others["mesh"] = mesh.to_document() if isinstance(mesh, MeshFile) else mesh
    return _post(path, document | others, {}, accept)


def unwrap(subject: Any) -> Any:
    """The surface of an answer to `convert`, and the id of one to `store`; others unchanged."""
    if isinstance(subject, Converted):
        return subject.surface
    return subject.id if isinstance(subject, Stored) else subject


def write_json(document: object) -> bytes:
    """A document as JSON, in which arrays are lists."""
    return json.dumps(document, default=_to_list, separators=(",", ":")).encode()


def write_query(fields: Mapping[str, Any]) -> dict[str, str]:
    """Fields as parameters of a URL."""
    return {name: _write_text(value) for name, value in fields.items()}


def _post(path: str, document: object, query: Mapping[str, str], accept: str) -> Request:
    return Request("POST", path, query, write_json(document), accept=accept)


def _to_list(value: object) -> object:
    """An array, a number of NumPy or a mapping as a value that `json` knows."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"a {type(value).__name__} is not a value of JSON")


def _write_text(value: Any) -> str:
    """A value as text: names and numbers of a list are separated by commas."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple) and not any(isinstance(v, Mapping) for v in value):
        return ",".join(map(_write_text, value))
    return value if isinstance(value, str) else write_json(value).decode()


def _is_large_net(surface: Any) -> bool:
    """Whether a surface is one large control net whose other fields can be in a query."""
    net, weights = surface.get("control_net"), surface.get("weights")
    return (
        isinstance(net, np.ndarray)
        and net.nbytes > MAX_JSON_NET
        and net.ndim == 3
        and net.shape[2] == 3
        and (weights is None or np.shape(weights) == net.shape[:2])
        and surface.keys() <= _NET_FIELDS
        and _are_names(surface.get("knots", "clamped"))
        and not surface.get("homogeneous", False)
    )


def _are_names(knots: Any) -> bool:
    names = [knots] if isinstance(knots, str) else knots
    return all(isinstance(name, str) for name in names)


def _write_net(surface: Mapping[str, Any]) -> bytes:
    """A control net, with its weights as fourth numbers, as a file of NumPy."""
    net, weights = surface["control_net"], surface.get("weights")
    if weights is not None:
        net = np.concatenate([net, np.asarray(weights)[..., np.newaxis]], axis=-1)
    return _write_array(net)


def _write_array(array: Any) -> bytes:
    file = BytesIO()
    np.save(file, np.asarray(array, np.float64), allow_pickle=False)
    return file.getvalue()


def _build_array_request(
    path: str, id: str, fields: Mapping[str, Any], query: Mapping[str, str], accept: str
) -> Request | None:
    """The request with the points or rays as an array, and the id in the query; None if it cannot.

    The other fields must be single values.
    """
    name = _ARRAYS.get(path, "")
    others = {key: value for key, value in fields.items() if key != name}
    if name not in fields or any(np.ndim(v) or isinstance(v, Mapping) for v in others.values()):
        return None
    try:
        array = (
            _join_rays(**fields[name]) if name == "rays" else np.asarray(fields[name], np.float64)
        )
    except (TypeError, ValueError):
        return None  # the service says what is wrong
    if array.ndim != 2 or array.shape[1] != (6 if name == "rays" else 3):
        return None
    query = {**query, **write_query(others), "surface": id}
    return Request("POST", path, query, _write_array(array), NPY, accept)


def _join_rays(origins: Any, directions: Any) -> Any:
    """Rays as rows of six numbers; one origin, or one direction, serves all."""
    pair = [np.asarray(rows, np.float64) for rows in (origins, directions)]
    count = max(map(len, pair))
    return np.concatenate([np.broadcast_to(rows, (count, 3)) for rows in pair], axis=1)
