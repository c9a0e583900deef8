"""Types of settings whose text is more than one word: bytes with a unit, and lists."""

from typing import Annotated, TypeAlias

from pydantic import BeforeValidator, ByteSize, SecretStr, TypeAdapter
from pydantic_settings import NoDecode


def _split_list(value: object) -> object:
    """The items of a comma-separated list; a value that is not a string is returned unchanged."""
    if not isinstance(value, str):
        return value
    return tuple(item.strip() for item in value.split(",") if item.strip())


PARSE_BYTES = BeforeValidator(TypeAdapter(ByteSize).validate_python)
"""Parses a number of bytes with a unit, such as `64MiB`; it marks the settings that are bytes.

With `ByteSize` itself as the type, pydantic would not check the range of the setting."""

Bytes: TypeAlias = Annotated[int, PARSE_BYTES]
Texts: TypeAlias = Annotated[tuple[str, ...], NoDecode, BeforeValidator(_split_list)]
Secrets: TypeAlias = Annotated[tuple[SecretStr, ...], NoDecode, BeforeValidator(_split_list)]
