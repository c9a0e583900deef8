"""Colours, texture coordinates and attributes of a surface as a document says them."""

from collections.abc import Mapping
from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Field

from service.bases.arrays import FloatArray
from service.errors import Issue
from service.schemas.arrays import NumberGrid
from service.schemas.validation import refusal, wrong_type
from service.surface.channels import (
    ATTRIBUTE_NAME,
    MAX_ATTRIBUTE_NAME,
    MAX_ATTRIBUTES,
    MAX_DIMENSION,
    NO_CHANNELS,
    Channels,
)

_COLOR = {"minItems": 3, "maxItems": 4}
_VALUE = {"maxItems": MAX_DIMENSION}
_TWO = "Texture coordinates are two numbers."


def _net(numbers: str, **more: Any) -> NumberGrid:
    """Rows of values: a net of any degree, from 0 on."""
    return NumberGrid(
        ("rows", "values", numbers), point_levels=2, degree_levels=(0, 1), least_degree=0, **more
    )


def _spline_net(numbers: str, **more: Any) -> NumberGrid:
    """The same, or a net as large as that of a spline."""
    return NumberGrid(("rows", "values", numbers), point_levels=2, **more)


def _rows(numbers: str, **more: Any) -> NumberGrid:
    """The same over a triangle."""
    return NumberGrid(
        ("rows", "values", numbers),
        point_levels=2,
        degree_levels=(0,),
        least_degree=0,
        ragged=1,
        **more,
    )


def _per_vertex(numbers: str, **more: Any) -> NumberGrid:
    """One value a vertex."""
    return NumberGrid(("values", numbers), point_levels=1, **more)


def _named(value: object) -> object:
    """Refuses names that cannot stand in files, before anything else is looked at."""
    if not isinstance(value, dict):
        raise refusal([((), wrong_type(value, "an object"))])
    needed = f"a letter, then letters, digits and _; at most {MAX_ATTRIBUTE_NAME} in all"
    message = "The name of an attribute becomes a word in files."
    issue = Issue("wrong_value", message, "", "another name", needed)
    wrong = [key for key in value if not ATTRIBUTE_NAME.fullmatch(key)]
    if wrong:
        raise refusal(((key,), issue) for key in wrong)
    if len(value) > MAX_ATTRIBUTES:
        message = "The surface has more attributes than formats have room for."
        got, needed = f"{len(value)} attributes", f"at most {MAX_ATTRIBUTES}"
        raise refusal([((), Issue("wrong_length", message, "", got, needed))])
    return value


_ATTRIBUTES = (
    # Each net may report faults of its own; the first bad one is enough.
    Field(
        fail_fast=True,
        json_schema_extra={
            "propertyNames": {"pattern": f"^{ATTRIBUTE_NAME.pattern}$"},
            "maxProperties": MAX_ATTRIBUTES,
        },
    ),
    BeforeValidator(_named),
)

_COLORS_TEXT = (
    "sRGB, each number from 0 to 1: [r, g, b], or [r, g, b, a] with the opacity. Formats without "
    "colours leave them out; glTF has them linear, as it must."
)
_UVS_TEXT = (
    "Texture coordinates [u, v], written as they are. A surface that has them comes out with them, "
    "whatever the option `uvs` says."
)
_ATTRIBUTES_TEXT = (
    "Functions of the parameters, by name: a temperature, a fourth coordinate. Every value is a "
    f"list of 1 to {MAX_DIMENSION} numbers. They come back by name in JSON, as `_NAME` in glTF (in "
    "pieces of four where there are more numbers) and as properties in PLY, in the order of their "
    "names."
)
_NET_TEXT = (
    " Rows along u as in the control net; the net has a degree of its own, from 0 (one value)."
)
_SPLINE_TEXT = (
    " Rows along u as in the control net. A net of as many rows and columns as the control net is "
    "a spline of the same degree and knots; any other is one Bézier net over the whole domain, of "
    "a degree of its own, from 0 (one value)."
)
_TRIANGLE_TEXT = (
    " In rows each one shorter than the one before, as in the control net; the net has a degree of "
    "its own, from 0 (one value)."
)
_VERTEX_TEXT = " One value for every vertex, blended over the patches as the vertices are."

NetColors: TypeAlias = Annotated[
    FloatArray | None,
    _net("numbers", documented=_COLOR),
    Field(
        description="Colours. " + _COLORS_TEXT + _NET_TEXT,
        examples=[[[[0.8, 0.1, 0.1], [0.9, 0.9, 0.2]], [[0.1, 0.2, 0.8], [0.2, 0.8, 0.3]]]],
    ),
]
NetUvs: TypeAlias = Annotated[
    FloatArray | None,
    _net("numbers", width=2, width_rule=_TWO),
    Field(description=_UVS_TEXT + _NET_TEXT, examples=[[[[0, 0], [0, 2]], [[1, 0], [1, 2]]]]),
]
NetAttributes: TypeAlias = Annotated[
    dict[str, Annotated[FloatArray, _net("numbers", documented=_VALUE)]],
    *_ATTRIBUTES,
    Field(
        description=_ATTRIBUTES_TEXT + _NET_TEXT,
        examples=[{"temperature": [[[20], [20]], [[35], [60]]]}],
    ),
]
SplineColors: TypeAlias = Annotated[
    FloatArray | None,
    _spline_net("numbers", documented=_COLOR),
    Field(
        description="Colours. " + _COLORS_TEXT + _SPLINE_TEXT,
        examples=[[[[0.8, 0.1, 0.1], [0.9, 0.9, 0.2]], [[0.1, 0.2, 0.8], [0.2, 0.8, 0.3]]]],
    ),
]
SplineUvs: TypeAlias = Annotated[
    FloatArray | None,
    _spline_net("numbers", width=2, width_rule=_TWO),
    Field(description=_UVS_TEXT + _SPLINE_TEXT, examples=[[[[0, 0], [0, 2]], [[1, 0], [1, 2]]]]),
]
SplineAttributes: TypeAlias = Annotated[
    dict[str, Annotated[FloatArray, _spline_net("numbers", documented=_VALUE)]],
    *_ATTRIBUTES,
    Field(
        description=_ATTRIBUTES_TEXT + _SPLINE_TEXT,
        examples=[{"temperature": [[[20], [20]], [[35], [60]]]}],
    ),
]
TriangleColors: TypeAlias = Annotated[
    FloatArray | None,
    _rows("numbers", documented=_COLOR),
    Field(
        description="Colours. " + _COLORS_TEXT + _TRIANGLE_TEXT,
        examples=[[[[0.8, 0.1, 0.1], [0.9, 0.9, 0.2]], [[0.1, 0.2, 0.8]]]],
    ),
]
TriangleUvs: TypeAlias = Annotated[
    FloatArray | None,
    _rows("numbers", width=2, width_rule=_TWO),
    Field(description=_UVS_TEXT + _TRIANGLE_TEXT, examples=[[[[0, 0], [1, 0]], [[0, 1]]]]),
]
TriangleAttributes: TypeAlias = Annotated[
    dict[str, Annotated[FloatArray, _rows("numbers", documented=_VALUE)]],
    *_ATTRIBUTES,
    Field(
        description=_ATTRIBUTES_TEXT + _TRIANGLE_TEXT,
        examples=[{"temperature": [[[20], [20]], [[35]]]}],
    ),
]
VertexColors: TypeAlias = Annotated[
    FloatArray | None,
    _per_vertex("numbers", documented=_COLOR),
    Field(
        description="Colours. " + _COLORS_TEXT + _VERTEX_TEXT,
        examples=[[[1, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 0], [0, 0, 1], [0, 0, 1]]],
    ),
]
VertexUvs: TypeAlias = Annotated[
    FloatArray | None,
    _per_vertex("numbers", width=2, width_rule=_TWO),
    Field(
        description=_UVS_TEXT + _VERTEX_TEXT,
        examples=[[[0, 0], [0, 1], [0.5, 0], [0.5, 1], [1, 0], [1, 1]]],
    ),
]
VertexAttributes: TypeAlias = Annotated[
    dict[str, Annotated[FloatArray, _per_vertex("numbers", documented=_VALUE)]],
    *_ATTRIBUTES,
    Field(
        description=_ATTRIBUTES_TEXT + _VERTEX_TEXT,
        examples=[{"temperature": [[20], [20], [35], [60], [20], [20]]}],
    ),
]


def channels(
    colors: FloatArray | None, uvs: FloatArray | None, attributes: Mapping[str, FloatArray]
) -> Channels:
    """What a document says, as a value; raises `InvalidRequest`."""
    if colors is None and uvs is None and not attributes:
        return NO_CHANNELS
    return Channels(colors, uvs, tuple(attributes.items()))


def define_channels(channels: Channels) -> dict[str, Any]:
    """The channels in the language of requests, their arrays as they are; none left out."""
    content: dict[str, Any] = {}
    if channels.colors is not None:
        content["colors"] = channels.colors
    if channels.uvs is not None:
        content["uvs"] = channels.uvs
    if channels.attributes:
        content["attributes"] = dict(channels.attributes)
    return content
