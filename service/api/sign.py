"""POST /v1/sign: an address that may be read by whoever has it, until a moment."""

import time
from functools import partial

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from service.api.admission.visits import attended
from service.api.answers import HEADERS, json_response
from service.api.body import read_body
from service.api.guard.moments import signed_address
from service.api.guard.policy import needs_keys
from service.api.parameters import no_parameters
from service.api.timing import Timing
from service.api.work import long_to_read, parsed
from service.schemas.request import SignRequest
from service.schemas.validation import parse_request
from service.settings.values import Settings, document_limits


async def post_sign(request: Request) -> Response:
    """Signs the address in the body. There only where there are secrets to sign with, and keys."""
    settings: Settings = request.app.state.settings
    if request.app.state.signer is None or not needs_keys(settings):
        raise HTTPException(404)
    no_parameters(request.query_params)
    body = await read_body(request, settings)
    async with attended(request):
        wanted = await parsed(partial(_parse, body, settings), Timing(), is_long=long_to_read(body))
    root = request.scope.get("root_path", "")
    address, expires = signed_address(request.app.state.signer, wanted, root, time.time())
    headers = HEADERS | {"Cache-Control": "no-store"}
    return json_response({"url": address, "expires": expires}, headers=headers)


def _parse(body: bytes, settings: Settings) -> SignRequest:
    return parse_request(SignRequest, body, document_limits(settings))
