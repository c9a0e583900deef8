"""Kinds of values that a setting may have, beside those of pydantic."""

from typing import Annotated, TypeAlias

from pydantic import BeforeValidator, ByteSize, SecretStr, TypeAdapter
from pydantic_settings import NoDecode

_BYTE_SIZE = TypeAdapter(ByteSize)


def _bytes(value: object) -> object:
    """A number of bytes, which may be written with a unit: `64MiB`, `10 GB`."""
    return int(_BYTE_SIZE.validate_python(value)) if isinstance(value, str) else value


def _parts(value: object) -> object:
    """The parts of a comma-separated list."""
    if not isinstance(value, str):
        return value
    return tuple(part.strip() for part in value.split(",") if part.strip())


Bytes: TypeAlias = Annotated[int, BeforeValidator(_bytes)]
Texts: TypeAlias = Annotated[tuple[str, ...], NoDecode, BeforeValidator(_parts)]
Secrets: TypeAlias = Annotated[tuple[SecretStr, ...], NoDecode, BeforeValidator(_parts)]
Seconds: TypeAlias = float
