"""The header of a file: its schema, and the system that wrote it.

References
----------
ISO 10303-21, clause 8.2: FILE_DESCRIPTION, FILE_NAME, FILE_SCHEMA.
"""

import re
from typing import NamedTuple

from service.decoders.step.entities import Entities
from service.decoders.step.faults import Fault
from service.decoders.step.records import Parameter, as_text, parse_record

_STATEMENT = re.compile(r"'[^']*+'|\b(FILE_NAME|FILE_SCHEMA)\s*+\(", re.IGNORECASE)
_IDENTIFIER = re.compile(r"[A-Za-z0-9_]+")
_PREPROCESSOR, _SYSTEM = 4, 5  # attributes of FILE_NAME


class Header(NamedTuple):
    """Names of the schemas, and of the system that wrote the file; empty if they are missing."""

    schema: str
    system: str


def read_header(entities: Entities) -> Header:
    """Read the header: what is before the first entity."""
    text = entities.instances.header
    statements: dict[str, list[Parameter]] = {}
    for match in _STATEMENT.finditer(text):
        if match[1] and match[1].upper() not in statements:
            statements[match[1].upper()] = []
            try:
                statements |= parse_record(text[match.start() :])
            except Fault:
                continue
    return Header(_read_schemas(statements), _read_system(statements))


def _read_schemas(statements: dict[str, list[Parameter]]) -> str:
    schemas = statements.get("FILE_SCHEMA", [])
    names = map(as_text, schemas[0] if schemas and isinstance(schemas[0], list) else schemas)
    # The name may be followed by its number: AUTOMOTIVE_DESIGN { 1 0 10303 214 3 1 1 }.
    found = [match[0].upper() for match in map(_IDENTIFIER.search, names) if match]
    return ", ".join(found[:4])


def _read_system(statements: dict[str, list[Parameter]]) -> str:
    parameters = statements.get("FILE_NAME", [])
    for index in (_SYSTEM, _PREPROCESSOR):
        text = as_text(parameters[index]).strip() if index < len(parameters) else ""
        if text:
            return text
    return ""
