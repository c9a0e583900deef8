"""The schemas of requests in the OpenAPI document, from the models that check them."""

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue, models_json_schema
from pydantic_core import core_schema

from service.api.openapi.references import Json, ref
from service.schemas.convert import ConvertRequest
from service.schemas.curves import CurveRequest
from service.schemas.points import PointsRequest
from service.schemas.query import LIST_NAMES, MeshQuery
from service.schemas.request import MeshRequest, SignRequest, SurfaceRequest


class _WithoutNull(GenerateJsonSchema):
    """A field that may be left out but not be null has no default to show."""

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        """The inner schema alone where the default is only a mark for "left out"."""
        if schema.get("default", ...) is None or "default_factory" in schema:
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)


_REQUESTS = (MeshRequest, SurfaceRequest, PointsRequest, ConvertRequest, CurveRequest, SignRequest)


def request_schemas() -> dict[str, Json]:
    """The component schemas of requests by name."""
    _, generated = models_json_schema(
        [(model, "validation") for model in _REQUESTS],
        ref_template=ref("{model}")["$ref"],
        schema_generator=_WithoutNull,
    )
    models: dict[str, Json] = generated["$defs"]
    return models


def option_parameters() -> list[Json]:
    """The options of a mesh and the engine as query parameters, lists comma-separated."""
    properties = MeshQuery.model_json_schema(schema_generator=_WithoutNull)["properties"]
    parameters = []
    for name, schema in properties.items():
        content = {key: value for key, value in schema.items() if key not in _PARAMETER_KEYS}
        parameter: Json = {
            "name": name,
            "in": "query",
            "required": False,
            "description": schema["description"],
            "schema": content,
        }
        if name in LIST_NAMES:
            parameter |= {"style": "form", "explode": False}
        if "examples" in schema:
            parameter["example"] = schema["examples"][0]
        parameters.append(parameter)
    return parameters


_PARAMETER_KEYS = frozenset({"title", "description", "examples"})
