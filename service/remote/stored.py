"""The stored surfaces of a service, for its operators."""

from collections.abc import Iterator
from typing import Any

import httpx
import orjson

from service.remote.connection import connect


def list_stored(url: str) -> Iterator[dict[str, Any]]:
    """The stored surfaces of a service, in the order of their ids: `id`, `bytes` and `time` each.

    Raises
    ------
    InvalidRequest, BadAddress, ServiceFailed
    """
    query: dict[str, str] = {"limit": "1000"}
    absent = "This service has no list of stored surfaces: it needs API keys (SURFACE_API_KEYS)."
    with connect(url) as connection:
        while query:
            response = connection.send("GET", "/v1/stored", params=query)
            page = orjson.loads(connection.read(response, "application/json", absent))
            yield from page["surfaces"]
            query = dict(httpx.URL(page["links"].get("next", "")).params)


def delete(url: str, id: str) -> None:
    """Removes a stored surface; raises the errors of `list_stored`."""
    absent = "This service deletes no surfaces (SURFACE_ALLOW_DELETE), or this is an example."
    with connect(url) as connection:
        connection.read(connection.send("DELETE", f"/v1/surfaces/{id}"), "", absent)
