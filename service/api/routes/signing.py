"""Addresses that may be read without a key until a moment."""

import time

from fastapi import APIRouter, Response

from service.api.answers import HEADERS, json_response
from service.api.body import BodyRoute
from service.api.guard.signatures import signed_address
from service.api.models.surfaces import SignedAddress
from service.api.openapi.parameters import json_body
from service.api.openapi.responses import POST_ERRORS, answer
from service.api.services import ContextDep
from service.schemas.request import SignRequest

signing = APIRouter(route_class=BodyRoute)


@signing.post(
    "/v1/sign",
    operation_id="signAddress",
    tags=["surfaces"],
    summary="Signs an address of a private surface",
    response_model=SignedAddress,
    response_description="The address.",
    responses={200: answer({}), **POST_ERRORS},
    openapi_extra=json_body("signAddress"),
)
async def sign_address(wanted: SignRequest, context: ContextDep) -> Response:
    """Makes an address that any client may read without a key until it expires.

    That is for services where surfaces and meshes are not public (`SURFACE_PUBLIC_READS=false`):
    for a viewer on a page, say. The signature holds for that path and those parameters, in any
    order, for `GET` and `HEAD`. Nothing is looked up or computed. Only addresses of this service
    can be signed, for seven days at most; and only where it is set up for that
    (`SURFACE_SIGNING_KEYS`), else there is no such call.
    """
    assert context.services.signer is not None
    root = context.request.scope.get("root_path", "")
    address, expires = signed_address(context.services.signer, wanted, root, time.time())
    headers = HEADERS | {"Cache-Control": "no-store"}
    return json_response({"url": address, "expires": expires}, headers=headers)
