"""The query of a mesh's URL: the options and the engine, and the one spelling of what it says.

Caches compare addresses letter by letter, so every query that means the same is also written as
one text: the options in the order of their model, defaults left out, each number in its fewest
digits, `engine` at the end. Reading that text gives the options back.
"""

from collections.abc import Iterable, Set
from typing import Annotated

from pydantic import Field

from service.engine.mesh import ENGINE
from service.schemas.accuracy import MAX_COUNT
from service.schemas.fields import Omittable
from service.schemas.options import MeshOptionFields
from service.schemas.query import option_values
from service.schemas.validation import validate_document


class MeshQuery(MeshOptionFields):
    """The options of a mesh, and which version of the numbers is meant."""

    engine: Annotated[int | None, Omittable(), Field(ge=1, le=MAX_COUNT)] = Field(
        default=None,
        description="Version of the numbers. With it the address of a surface whose id is a hash "
        "stands for the same mesh for ever. A service with another version answers 410.",
        examples=[ENGINE],
        json_schema_extra={"enum": [ENGINE]},
    )


def mesh_query(pairs: Iterable[tuple[str, str]]) -> MeshQuery:
    """What a query says.

    Raises
    ------
    InvalidRequest
        With pointers `/name of the parameter`.
    """
    return validate_document(MeshQuery, option_values(pairs))


def canonical_query(options: MeshOptionFields, ignored: Set[str] = frozenset()) -> str:
    """The one spelling of these options, those of `ignored` names left out.

    What stands in it needs no escape in a URL. A default may be left out because it is part of the
    numbers: changing one raises `ENGINE`, as it changes what the address stands for.
    """
    parts = []
    for name, field in MeshOptionFields.model_fields.items():
        value = getattr(options, name)
        if name not in ignored and value != field.get_default(call_default_factory=True):
            parts.append(f"{name}={_text(value)}")
    parts.append(f"engine={ENGINE}")
    return "&".join(parts)


def _text(value: object) -> str:
    """A value in its fewest letters."""
    match value:
        case bool():
            return "true" if value else "false"
        case float():
            return _digits(value)
        case tuple():
            # One number stands for both directions.
            return ",".join(map(_text, value[:1] if len(set(value)) == 1 else value))
        case _:
            return str(value)


def _digits(number: float) -> str:
    """The fewest digits that read back the same: 0.5, 2, 1e-5, 1e20; no sign before a zero."""
    mantissa, _, exponent = repr(number + 0.0).partition("e")
    mantissa = mantissa.removesuffix(".0")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa
