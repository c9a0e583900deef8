"""The document as generators of clients read it: unions have names, short lists fixed lengths.

A union that is written out wherever it is used has no name in the types that are made from it; and
`minItems` beside an equal `maxItems` is a list of any length to most of them, while `prefixItems`
is a tuple: a point is three numbers.
"""

from collections.abc import Mapping
from typing import Any

from service.api.openapi.references import Json, ref

_MOST = 4
"""Longest lists that become tuples: points, colours, bounds, rows of a matrix."""

# What stands under these keys are values, not schemas.
_VALUES = frozenset({"default", "enum", "example", "examples"})


def with_named_unions(schemas: Mapping[str, Json]) -> dict[str, Json]:
    """Component schemas in which the four unions of the language are components themselves."""
    found = {
        "SurfaceDefinition": (
            "A surface: its `type` tells the kind, `bezier` if there is none.",
            schemas["MeshRequest"]["properties"]["surface"],
        ),
        "MemberSurfaceDefinition": (
            "A surface in a group: any but a group.",
            schemas["MemberDefinition"]["properties"]["surface"],
        ),
        "CurveDefinition": (
            "A curve: its `type` tells the kind, `bezier` if there is none.",
            schemas["CurveRequest"]["properties"]["curve"],
        ),
        "OperationDefinition": (
            "A step of a conversion: `op` tells the kind.",
            schemas["ConvertRequest"]["properties"]["operations"]["items"],
        ),
    }
    unions = {name: union["oneOf"] for name, (_, union) in found.items()}
    named = {name: _with_references(schema, unions) for name, schema in schemas.items()}
    return named | {
        name: {"description": text, "oneOf": unions[name]} for name, (text, _) in found.items()
    }


def _with_references(node: Any, unions: Mapping[str, list[Json]]) -> Any:
    """A schema that refers to a union where it had it written out."""
    if isinstance(node, list):
        return [_with_references(item, unions) for item in node]
    if not isinstance(node, dict):
        return node
    for name, union in unions.items():
        if node.get("oneOf") == union:
            return ref(name) | {key: value for key, value in node.items() if key != "oneOf"}
    return {key: _with_references(value, unions) for key, value in node.items()}


def with_tuples(node: Any) -> Any:
    """Any part of the document, its short lists of one length with `prefixItems`."""
    if isinstance(node, list):
        return [with_tuples(item) for item in node]
    if not isinstance(node, dict):
        return node
    result = {key: v if key in _VALUES else with_tuples(v) for key, v in node.items()}
    length = result.get("maxItems", 0)
    if "items" in result and result.get("minItems") == length <= _MOST:
        result["prefixItems"] = [result["items"]] * length
    return result
