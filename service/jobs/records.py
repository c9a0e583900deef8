"""The records of the parts of a batch, and the lines that ask for these parts: lines of JSON."""

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

import orjson

from service.errors import SurfaceError
from service.jobs.batch import SUCCEEDED
from service.jobs.results import Result, read_issues
from service.jobs.state import PartResult

_ERRORS = {kind.__name__: kind for kind in SurfaceError.__subclasses__()}
"""The classes of errors that a part can have, by name."""

_RESULT_FIELDS = [field.name for field in fields(Result)]


def read_lines(content: bytes) -> list[dict[str, Any]]:
    """The documents of lines."""
    return [orjson.loads(line) for line in content.split(b"\n")]


def write_records(records: Iterable[Mapping[str, Any]], names: Mapping[int, str]) -> bytes:
    """The records of a batch as lines, with the names that the client gave to some of the parts."""
    return b"\n".join(
        orjson.dumps({**record, "part_name": names.get(record["part"], "")}) for record in records
    )


def read_record(record: Mapping[str, Any]) -> PartResult:
    """The result of a part, from its record."""
    about = record["part"], record["id"], record["part_name"], record["state"]
    if record["state"] == SUCCEEDED:
        # A record of an earlier version may lack a field, which then has its default.
        result = Result(**{name: record[name] for name in _RESULT_FIELDS if name in record})
        return PartResult(*about, result=result)
    return PartResult(*about, error=_read_error(record["error"]))


def _read_error(error: Mapping[str, Any]) -> SurfaceError:
    """The error of a part, of the class that its record names."""
    return _ERRORS.get(error["class"], SurfaceError)(*read_issues(error))
