"""The route that lists all stored surfaces, for operators."""

from fastapi import APIRouter, Request, Response

from service.api.errors import InvalidQuery
from service.api.models.surfaces import StoredList
from service.api.negotiation import Pairs, read_query, refuse_parameters
from service.api.observing.middleware import timestamp
from service.api.openapi.parameters import DEFAULT_LIMIT, MAX_LIMIT, PAGE
from service.api.openapi.responses import error
from service.api.responses import HEADERS, json_response
from service.api.services import ContextDep
from service.errors import Issue
from service.schemas.query import values_from_text
from service.storage.keys import find_id, is_id

listing = APIRouter()

_PATH = "/v1/stored"


@listing.get(
    _PATH,
    operation_id="listStored",
    tags=["surfaces"],
    summary="All stored surfaces",
    response_model=StoredList,
    response_description="A page of the list.",
    responses={
        422: error("InvalidQuery"),
        500: error("InternalError"),
        503: error("Unavailable"),
    },
    openapi_extra={"parameters": PAGE},
)
async def list_stored(request: Request, context: ContextDep) -> Response:
    """Lists the stored surfaces in the order of their ids, without reading them.

    Who knows an id may read its surface, so this call needs a key with the scope `admin`, and a
    service without keys does not have it. A surface that is stored or deleted meanwhile may be
    missing or listed.
    """
    after, limit = parse_page(request.query_params.multi_items())
    async with context.computation.until_deadline():
        entries = await context.services.store.list(after, limit + 1)
    surfaces = [
        {"id": find_id(entry.key), "bytes": entry.size, "time": timestamp(entry.modified)}
        for entry in entries[:limit]
    ]
    links = {}
    if len(entries) > limit:
        root = request.scope.get("root_path", "")
        links["next"] = f"{root}{_PATH}?after={surfaces[-1]['id']}&limit={limit}"
    headers = HEADERS | {"Cache-Control": "no-store"}
    return json_response({"surfaces": surfaces, "links": links}, headers=headers)


def parse_page(pairs: Pairs) -> tuple[str, int]:
    """The parameters `after`, empty by default, and `limit` of a query.

    Raises
    ------
    InvalidQuery
    """
    values = {name: str(value) for name, value in read_query(values_from_text, pairs).items()}
    refuse_parameters(values.keys() - {"after", "limit"}, "only `after` and `limit`")
    after, limit = values.get("after"), values.get("limit", str(DEFAULT_LIMIT))
    if after is not None and not is_id(after):
        message, needed = "The text is no id of a stored surface.", "64 hexadecimal digits"
        raise InvalidQuery(Issue("wrong_value", message, "/after", "another text", needed))
    if not (
        limit.isascii() and limit.isdigit() and len(limit) <= 4 and 1 <= int(limit) <= MAX_LIMIT
    ):
        message, needed = "This is no size of a page.", f"a whole number from 1 to {MAX_LIMIT}"
        raise InvalidQuery(Issue("out_of_range", message, "/limit", "another text", needed))
    return after or "", int(limit)
