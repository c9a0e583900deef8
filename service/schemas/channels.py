"""The JSON language of colours, texture coordinates and attributes of a surface."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

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


@dataclass(frozen=True)
class ChannelForm:
    """How channels of some kinds of surface are written: the annotations of their fields.

    Attributes
    ----------
    grid : dict
        The arguments of `NumberGrid` for a net, except those for the innermost lists.
    text : str
        What the descriptions of all fields say about nets.
    color_net, uv_net, heat_net : list
        Examples of nets.
    """

    grid: dict[str, Any]
    text: str
    color_net: list[Any]
    uv_net: list[Any]
    heat_net: list[Any]

    def colors(self) -> tuple[NumberGrid, Any]:
        """The annotations of a field of colours."""
        description = (
            "Colours. sRGB, each number from 0 to 1: [r, g, b], or [r, g, b, a] with the opacity. "
            "Formats without colours omit them. glTF files contain linear RGB, as the "
            "specification of glTF requires." + self.text
        )
        grid = NumberGrid(**self.grid, list_schema={"minItems": 3, "maxItems": 4})
        return grid, Field(description=description, examples=[self.color_net])

    def uvs(self) -> tuple[NumberGrid, Any]:
        """The annotations of a field of texture coordinates."""
        description = (
            "Texture coordinates [u, v], written without change. Vertices of the mesh then have "
            "texture coordinates also without the option `uvs`." + self.text
        )
        grid = NumberGrid(**self.grid, width=2, width_rule="Texture coordinates are two numbers.")
        return grid, Field(description=description, examples=[self.uv_net])

    def values(self) -> NumberGrid:
        """The annotation of the values of one attribute."""
        return NumberGrid(**self.grid, list_schema={"maxItems": MAX_DIMENSION})

    def attributes(self) -> tuple[Any, ...]:
        """The annotations of a field of named attributes."""
        description = (
            "Functions of the parameters, by name: a temperature, a fourth coordinate. Every value "
            f"is a list of 1 to {MAX_DIMENSION} numbers. JSON has attributes by name. glTF has "
            "them as `_NAME`, split into pieces of four if there are more than four numbers. PLY "
            "has them as properties, sorted by name." + self.text
        )
        field = Field(
            description=description,
            examples=[{"temperature": self.heat_net}],
            # Stop at the first invalid net: each net may report many errors.
            fail_fast=True,
            json_schema_extra={
                "propertyNames": {"pattern": f"^{ATTRIBUTE_NAME.pattern}$"},
                "maxProperties": MAX_ATTRIBUTES,
            },
        )
        return field, BeforeValidator(_check_attribute_names)


_LEVELS = ("rows", "values", "numbers")

NET = ChannelForm(
    {"levels": _LEVELS, "point_levels": 2, "degree_levels": (0, 1), "min_degree": 0},
    " Rows follow each other along u, as in the control net. The degree of this net may differ "
    "from that of the control net; degree 0 is one value.",
    color_net=[[[0.8, 0.1, 0.1], [0.9, 0.9, 0.2]], [[0.1, 0.2, 0.8], [0.2, 0.8, 0.3]]],
    uv_net=[[[0, 0], [0, 2]], [[1, 0], [1, 2]]],
    heat_net=[[[20], [20]], [[35], [60]]],
)
SPLINE = replace(
    NET,
    grid={"levels": _LEVELS, "point_levels": 2},
    text=" Rows follow each other along u, as in the control net. A net with as many rows and "
    "columns as the control net is a spline of the same degree and knots. Any other net is one "
    "Bézier net over the whole domain; its degree may differ from that of the surface, and degree "
    "0 is one value.",
)
TRIANGLE = ChannelForm(
    NET.grid | {"degree_levels": (0,), "triangle_level": 1},
    " In rows as in the control net: each row has one value less than the row before. The degree "
    "of this net may differ from that of the control net; degree 0 is one value.",
    color_net=[[[0.8, 0.1, 0.1], [0.9, 0.9, 0.2]], [[0.1, 0.2, 0.8]]],
    uv_net=[[[0, 0], [1, 0]], [[0, 1]]],
    heat_net=[[[20], [20]], [[35]]],
)
VERTEX = ChannelForm(
    {"levels": ("values", "numbers"), "point_levels": 1},
    " One value for every vertex; over a patch, the values are the Bernstein coefficients.",
    color_net=[[1, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 0], [0, 0, 1], [0, 0, 1]],
    uv_net=[[0, 0], [0, 1], [0.5, 0], [0.5, 1], [1, 0], [1, 1]],
    heat_net=[[20], [20], [35], [60], [20], [20]],
)


def build_channels(
    colors: FloatArray | None, uvs: FloatArray | None, attributes: Mapping[str, FloatArray]
) -> Channels:
    """The channels of a surface, from the fields of its document; raises `InvalidRequest`."""
    if colors is None and uvs is None and not attributes:
        return NO_CHANNELS
    return Channels(colors, uvs, tuple(attributes.items()))
