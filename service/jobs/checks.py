"""Checks the parts of a job when it is asked for, as far as their shapes show."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn

import orjson

from service.jobs.file_parts import check_file_part, unknown_file
from service.jobs.parts import FindSurface, read_part
from service.pipeline.calls import CallLimits
from service.schemas.jobs import PartDefinition
from service.schemas.validation import validate_document

MAX_GUESS = 0.5
"""The most seconds that a part counts when batches are formed. The time of a mesh by tolerance is
not known before: its estimate is for the largest mesh that is allowed."""

FindSize = Callable[[str], int]
"""Returns the bytes of the file with an id; raises `InvalidRequest` if no such file is kept."""


@dataclass(frozen=True, slots=True)
class CheckedPart:
    """A part of a job that was accepted.

    Attributes
    ----------
    id : str
    line : bytes
        The part as a line of JSON, with its id, without the line feed.
    seconds : float
        Its time as batches count it.
    memory : int
        The most bytes that its work takes.
    """

    id: str
    line: bytes
    seconds: float
    memory: int


def find_no_file(_: str) -> NoReturn:
    """The `FindSize` of jobs without a place for files."""
    raise unknown_file()


def check_part(
    document: object,
    limits: CallLimits,
    find_surface: FindSurface,
    find_size: FindSize = find_no_file,
) -> CheckedPart:
    """Check a part as far as its shapes show, without computing it; a file is not read.

    Parameters
    ----------
    document : dict
        The part as in the list of a job.

    Raises
    ------
    InvalidRequest, TooLarge, UnsupportedByFormat, UnknownSurface
        Pointers are relative to the part: `/path` for its path and query, `/body/…` for its body,
        `/file` for its file.
    """
    definition = validate_document(PartDefinition, document, limits.document)
    if definition.file is not None:
        id, cost = check_file_part(definition.path, definition.file, limits, find_size)
    else:
        part = read_part(definition.path, definition.body, limits)
        id, cost = part.id, part.plan(find_surface).cost
    line = orjson.dumps({"id": id, **definition.model_dump(exclude_none=True)})
    return CheckedPart(id, line, min(cost.seconds, MAX_GUESS), cost.memory)
