"""The JSON language of colours, texture coordinates and attributes of a surface."""

from collections.abc import Mapping
from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Field

from service.bases.arrays import FloatArray
from service.errors import Issue
from service.schemas.arrays import NumberGrid
from service.schemas.validation import to_invalid, to_refusal, wrong_type
from service.surface.channel_values import ATTRIBUTE_NAME, MAX_ATTRIBUTE_NAME, MAX_ATTRIBUTES
from service.surface.channels import MAX_DIMENSION, NO_CHANNELS, Channels


def _check_attribute_names(value: object) -> object:
    """Refuse attributes whose names files cannot contain, and too many attributes.

    This check comes before the values are parsed, which takes longer.
    """
    if not isinstance(value, dict):
        raise to_invalid(wrong_type(value, "an object"))
    needed = f"a letter, then letters, digits and _; at most {MAX_ATTRIBUTE_NAME} in all"
    message = "The name of an attribute becomes a word in files."
    issue = Issue("wrong_value", message, "", "another name", needed)
    wrong_names = [key for key in value if not ATTRIBUTE_NAME.fullmatch(key)]
    if wrong_names:
        raise to_refusal(((key,), issue) for key in wrong_names)
    if len(value) > MAX_ATTRIBUTES:
        raise to_invalid(
            Issue(
                "wrong_length",
                "The surface has more attributes than formats have room for.",
                "",
                f"{len(value)} attributes",
                f"at most {MAX_ATTRIBUTES}",
            )
        )
    return value


_ATTRIBUTES = (
    # Stop at the first invalid net: each net may report many errors.
    Field(
        fail_fast=True,
        json_schema_extra={
            "propertyNames": {"pattern": f"^{ATTRIBUTE_NAME.pattern}$"},
            "maxProperties": MAX_ATTRIBUTES,
        },
    ),
    BeforeValidator(_check_attribute_names),
)

_COLORS_TEXT = (
    "sRGB, each number from 0 to 1: [r, g, b], or [r, g, b, a] with the opacity. Formats without "
    "colours omit them. glTF files contain linear RGB, as the specification of glTF requires."
)
_UVS_TEXT = (
    "Texture coordinates [u, v], written without change. Vertices of the mesh then have texture "
    "coordinates also without the option `uvs`."
)
_ATTRIBUTES_TEXT = (
    "Functions of the parameters, by name: a temperature, a fourth coordinate. Every value is a "
    f"list of 1 to {MAX_DIMENSION} numbers. JSON has attributes by name. glTF has them as `_NAME`, "
    "split into pieces of four if there are more than four numbers. PLY has them as properties, "
    "sorted by name."
)
_NET_TEXT = (
    " Rows follow each other along u, as in the control net. The degree of this net may differ "
    "from that of the control net; degree 0 is one value."
)
_SPLINE_TEXT = (
    " Rows follow each other along u, as in the control net. A net with as many rows and "
    "columns as the control net is a spline of the same degree and knots. Any other net is one "
    "Bézier net over the whole domain; its degree may differ from that of the surface, and degree "
    "0 is one value."
)
_TRIANGLE_TEXT = (
    " In rows as in the control net: each row has one value less than the row before. The degree "
    "of this net may differ from that of the control net; degree 0 is one value."
)
_VERTEX_TEXT = (
    " One value for every vertex; over a patch, the values are the Bernstein coefficients."
)

_NET_LEVELS = ("rows", "values", "numbers")
_SPLINE: dict[str, Any] = {"levels": _NET_LEVELS, "point_levels": 2}
_NET: dict[str, Any] = _SPLINE | {"degree_levels": (0, 1), "min_degree": 0}
_TRIANGLE: dict[str, Any] = _NET | {"degree_levels": (0,), "triangle_level": 1}
_VERTEX: dict[str, Any] = {"levels": ("values", "numbers"), "point_levels": 1}


def _colors(grid: dict[str, Any], text: str, example: list[Any]) -> tuple[NumberGrid, Any]:
    """The annotations of a field of colours."""
    description = Field(description="Colours. " + _COLORS_TEXT + text, examples=[example])
    return NumberGrid(**grid, list_schema={"minItems": 3, "maxItems": 4}), description


def _uvs(grid: dict[str, Any], text: str, example: list[Any]) -> tuple[NumberGrid, Any]:
    """The annotations of a field of texture coordinates."""
    rule = "Texture coordinates are two numbers."
    description = Field(description=_UVS_TEXT + text, examples=[example])
    return NumberGrid(**grid, width=2, width_rule=rule), description


def _values(grid: dict[str, Any]) -> NumberGrid:
    """The annotation of the values of one attribute."""
    return NumberGrid(**grid, list_schema={"maxItems": MAX_DIMENSION})


def _attributes(text: str, example: list[Any]) -> tuple[Any, ...]:
    """The annotations of a field of named attributes."""
    description = Field(description=_ATTRIBUTES_TEXT + text, examples=[{"temperature": example}])
    return *_ATTRIBUTES, description


_COLOR_NET = [[[0.8, 0.1, 0.1], [0.9, 0.9, 0.2]], [[0.1, 0.2, 0.8], [0.2, 0.8, 0.3]]]
_COLOR_ROWS = [[[0.8, 0.1, 0.1], [0.9, 0.9, 0.2]], [[0.1, 0.2, 0.8]]]
_COLOR_LIST = [[1, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 0], [0, 0, 1], [0, 0, 1]]
_UV_NET = [[[0, 0], [0, 2]], [[1, 0], [1, 2]]]
_UV_ROWS = [[[0, 0], [1, 0]], [[0, 1]]]
_UV_LIST = [[0, 0], [0, 1], [0.5, 0], [0.5, 1], [1, 0], [1, 1]]
_HEAT_NET, _HEAT_ROWS = [[[20], [20]], [[35], [60]]], [[[20], [20]], [[35]]]
_HEAT_LIST = [[20], [20], [35], [60], [20], [20]]

_Floats: TypeAlias = FloatArray | None

NetColors: TypeAlias = Annotated[_Floats, *_colors(_NET, _NET_TEXT, _COLOR_NET)]
NetUvs: TypeAlias = Annotated[_Floats, *_uvs(_NET, _NET_TEXT, _UV_NET)]
NetAttributes: TypeAlias = Annotated[
    dict[str, Annotated[FloatArray, _values(_NET)]], *_attributes(_NET_TEXT, _HEAT_NET)
]
SplineColors: TypeAlias = Annotated[_Floats, *_colors(_SPLINE, _SPLINE_TEXT, _COLOR_NET)]
SplineUvs: TypeAlias = Annotated[_Floats, *_uvs(_SPLINE, _SPLINE_TEXT, _UV_NET)]
SplineAttributes: TypeAlias = Annotated[
    dict[str, Annotated[FloatArray, _values(_SPLINE)]], *_attributes(_SPLINE_TEXT, _HEAT_NET)
]
TriangleColors: TypeAlias = Annotated[_Floats, *_colors(_TRIANGLE, _TRIANGLE_TEXT, _COLOR_ROWS)]
TriangleUvs: TypeAlias = Annotated[_Floats, *_uvs(_TRIANGLE, _TRIANGLE_TEXT, _UV_ROWS)]
TriangleAttributes: TypeAlias = Annotated[
    dict[str, Annotated[FloatArray, _values(_TRIANGLE)]], *_attributes(_TRIANGLE_TEXT, _HEAT_ROWS)
]
VertexColors: TypeAlias = Annotated[_Floats, *_colors(_VERTEX, _VERTEX_TEXT, _COLOR_LIST)]
VertexUvs: TypeAlias = Annotated[_Floats, *_uvs(_VERTEX, _VERTEX_TEXT, _UV_LIST)]
VertexAttributes: TypeAlias = Annotated[
    dict[str, Annotated[FloatArray, _values(_VERTEX)]], *_attributes(_VERTEX_TEXT, _HEAT_LIST)
]


def build_channels(
    colors: FloatArray | None, uvs: FloatArray | None, attributes: Mapping[str, FloatArray]
) -> Channels:
    """The channels of a surface, from the fields of its document; raises `InvalidRequest`."""
    if colors is None and uvs is None and not attributes:
        return NO_CHANNELS
    return Channels(colors, uvs, tuple(attributes.items()))
