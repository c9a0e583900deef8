"""Sends the work of a command to a service; work that takes long becomes a job there."""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

import httpx
import orjson

from service.encoders.format import FileFormat, Format
from service.encoders.text import json_text
from service.remote.connection import Connection, connect, find_problem
from service.remote.jobs import PREFER, fetch_result, find_state

PATIENCE = 10.0
"""Seconds to wait for a result; then the work is asked for again as a job, which has no limit of
time, and whose progress is shown."""


def fetch_mesh(url: str, id: str, options: Mapping[str, str], fmt: Format) -> bytes:
    """The mesh file of an example or of a stored surface; raises the errors of `post`.

    `options` are the options by name, as text.
    """
    path = httpx.URL(f"/v1/surfaces/{id}/mesh.{fmt.suffix}", params=dict(options))
    with connect(url) as connection:

        def ask_job() -> httpx.Response:
            job = {"parts": [{"path": str(path)}]}
            response = connection.send("POST", "/v1/jobs", json=job)
            # A service without jobs, or one whose jobs need a key, answers the call itself.
            return response if response.is_success else connection.send("GET", str(path))

        ask = partial(connection.send, "GET", str(path))
        return _compute(connection, ask, ask_job, fmt.media_type)


def post(
    url: str,
    path: str,
    body: dict[str, Any] | bytes,
    fmt: FileFormat | None = None,
    query: Mapping[str, str] = MappingProxyType({}),
    *,
    media_type: str = "application/json",
    on_headers: Callable[[Mapping[str, str]], None] = lambda _: None,
) -> bytes:
    """The response to a document or a file that is posted to a path of the service at `url`.

    Parameters
    ----------
    body : dict or bytes
        The document, or the content of the file, which is sent unchanged.
    fmt : FileFormat, optional
        The format of the response; default: JSON.
    query : Mapping
        Further parameters of the URL.
    media_type : str
        That of the body.
    on_headers : callable
        Called with the headers of the result, whose names may be asked for in any case.

    Raises
    ------
    InvalidRequest
        The service reports an error of the request; the issues are from the response.
    BadAddress, ServiceFailed
    """
    expected_type, params = "application/json", dict(query)
    if fmt is not None:
        expected_type, params["format"] = fmt.media_type, fmt.name
    content = body if isinstance(body, bytes) else json_text(body)
    headers = {"Content-Type": media_type}
    with connect(url) as connection:
        send = partial(connection.send, "POST", path, params=params, content=content)
        ask_job = partial(send, headers=headers | PREFER)
        content = _compute(connection, partial(send, headers=headers), ask_job, expected_type)
        on_headers(connection.headers)
        return content


def store_urls(url: str, content: bytes) -> dict[str, str]:
    """The `id` in the response to `POST /v1/surfaces`, and URLs of the surface and its meshes."""
    response = orjson.loads(content)
    links = {"self": response["links"]["self"], **response["links"]["mesh"]}
    return {"id": response["id"]} | {k: str(httpx.URL(url).join(v)) for k, v in links.items()}


def _compute(
    connection: Connection,
    ask: Callable[..., httpx.Response],
    ask_job: Callable[[], httpx.Response],
    expected_type: str,
) -> bytes:
    """The result of a call: computed at once, or if that takes too long, by a job.

    Parameters
    ----------
    ask : callable
        Sends the call.
    ask_job : callable
        Asks for the job; returns the response, which may also be that of the call.
    """
    try:
        response = ask(timeout=PATIENCE)
    except httpx.ReadTimeout:
        response = ask_job()
    else:
        if _takes_long(response):
            response = ask_job()
    if (state := find_state(response)) is not None:
        return fetch_result(connection, state, expected_type)
    return connection.read(response, expected_type)


def _takes_long(response: httpx.Response) -> bool:
    """Whether the service would need more time for the work than it has for a request."""
    problem = find_problem(response)
    codes = {problem.get("code"), *(error["code"] for error in problem.get("errors", ()))}
    return bool({"out_of_time", "too_costly"} & codes)
