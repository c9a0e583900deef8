"""Examples of responses in the OpenAPI document, computed from the examples of requests."""

from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType
from typing import TypeVar

import orjson
from pydantic import BaseModel

from service.api.guard.signatures import MIN_SECRET, Signer, signed_address
from service.api.links import mesh_links, surface_address
from service.api.openapi.parameters import REQUESTS, Json
from service.encoders.curves.registry import CURVES_BY_NAME
from service.encoders.registry import BY_NAME
from service.encoders.text import json_text
from service.pipeline.curve import plan_curve
from service.pipeline.documents import plan_conversion
from service.pipeline.estimate import estimate_object, plan_estimate
from service.pipeline.mesh import encode_options, render
from service.pipeline.points import plan_points
from service.pipeline.project import plan_project
from service.schemas.convert import ConvertRequest
from service.schemas.curves import CurveRequest
from service.schemas.points import PointsRequest
from service.schemas.project import ProjectRequest
from service.schemas.request import MeshRequest, SignRequest, SurfaceRequest
from service.schemas.validation import validate_document
from service.storage.canonical import plan_content
from service.surface.convert.nets import Allowed

Model = TypeVar("Model", bound=BaseModel)

_SQUARE = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
_RAMP: Json = {
    "type": "patches",
    "vertices": [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 1], [2, 1, 1]],
    "patches": [[[0, 1], [2, 3]], [[2, 3], [4, 5]]],
    "name": "ramp",
}
_MESHES: Json = {
    "MeshOfPatch": {
        "summary": "A patch: row k of the normals belongs to row k of the vertices",
        "value": {"surface": _SQUARE, "resolution": 1},
    },
    "MeshWithCrease": {
        "summary": "Two patches that meet at an angle: `attribute_faces` name the normals",
        "value": {"surface": _RAMP, "faces": "quads", "resolution": 1},
    },
}
_NOW = 1_799_996_400
"""An hour before the expiry in the examples of signed URLs."""


def _mesh(wanted: MeshRequest) -> bytes:
    return render(wanted.to_surface(), wanted.mesh_options(), BY_NAME["json"])


def _estimate(wanted: MeshRequest) -> bytes:
    options, encode = wanted.mesh_options(), encode_options(wanted)
    return json_text(estimate_object(plan_estimate(wanted.to_surface(), options, encode).run()))


def _points(wanted: PointsRequest) -> bytes:
    return plan_points(wanted.to_surface(), wanted.to_query()).run()


def _closest(wanted: ProjectRequest) -> bytes:
    return plan_project(wanted.to_shape(), wanted.to_query()).run()


def _conversion(wanted: ConvertRequest) -> bytes:
    return plan_conversion(wanted.to_surface(), wanted.to_operations(), Allowed()).run()


def _curve(wanted: CurveRequest) -> bytes:
    fmt = CURVES_BY_NAME["json"]
    return plan_curve(wanted.to_curve(), wanted.curve_options(), fmt).run()


def _stored(wanted: SurfaceRequest) -> bytes:
    id, _ = plan_content(wanted.to_surface()).run()
    links = {"self": surface_address("", id), "mesh": mesh_links("", id)}
    return orjson.dumps({"id": id, "links": links})


def _signed(wanted: SignRequest) -> bytes:
    """A URL signed with a fixed public secret, so that the example never changes."""
    url, expires = signed_address(Signer(["-" * MIN_SECRET]), wanted, "", _NOW)
    return orjson.dumps({"url": url, "expires": expires})


def _computed(
    examples: Json, model: type[Model], answer: Callable[[Model], bytes]
) -> Callable[[], Json]:
    def compute() -> Json:
        return {
            name: {
                "summary": example["summary"],
                "value": orjson.loads(answer(validate_document(model, example["value"]))),
            }
            for name, example in examples.items()
        }

    return cache(compute)


def _only(operation: str, name: str) -> Json:
    return {name: REQUESTS[operation][name]}


_mesh_examples = _computed(_MESHES, MeshRequest, _mesh)

ANSWERS: Mapping[str, Callable[[], Json]] = MappingProxyType(
    {
        "createMesh": _mesh_examples,
        "getSurfaceMesh": _mesh_examples,
        "estimateMesh": _computed(REQUESTS["estimateMesh"], MeshRequest, _estimate),
        "queryPoints": _computed(_only("queryPoints", "patch"), PointsRequest, _points),
        "projectPoints": _computed(REQUESTS["projectPoints"], ProjectRequest, _closest),
        "convertSurface": _computed(REQUESTS["convertSurface"], ConvertRequest, _conversion),
        "createCurve": _computed(_only("createCurve", "quarter"), CurveRequest, _curve),
        "storeSurface": _computed(REQUESTS["storeSurface"], SurfaceRequest, _stored),
        "signAddress": _computed(REQUESTS["signAddress"], SignRequest, _signed),
    }
)
"""Functions that compute the examples of JSON responses, by the id of the operation."""
