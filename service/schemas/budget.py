"""Counts the values in a JSON text while it arrives, and bounds the memory of its objects."""

from dataclasses import dataclass, field

from service.errors import InvalidRequest, Issue
from service.schemas.document import (
    MAX_OBJECTS,
    MAX_STRINGS,
    STRINGS_PER_OBJECT,
    VALUES_PER_OBJECT,
    DocumentLimits,
    too_many_strings,
)

BYTES_PER_VALUE, BYTES_PER_STRING, BYTES_PER_OBJECT = 100, 800, 1500
"""Upper bounds of memory, in bytes: of a number as a Python object, until it is part of an array;
of a string, and of the error if it is an unknown key; of an object, and of the model made from
it."""

BYTES_PER_MORE_STRING, BYTES_PER_MORE_OBJECT = 200, 500
"""Upper bounds for each string and each object after the first `MAX_STRINGS`. Only breps have more,
which are read without models; at most `MAX_STRINGS` keys can become errors."""


@dataclass(slots=True)
class DocumentBudget:
    """Counts the values in a JSON text while it arrives, to refuse too large a text early."""

    limits: DocumentLimits = field(default_factory=DocumentLimits)
    received: int = 0
    values: int = 0
    objects: int = 0
    quotes: int = 0

    def take(self, chunk: bytes) -> None:
        """Count the values in the next chunk of the text.

        Raises
        ------
        InvalidRequest
            `too_many_values` or `too_many_strings`.
        """
        self.received += len(chunk)
        objects = chunk.count(b"{")
        self.objects += objects
        self.values += chunk.count(b",") + chunk.count(b"[") + objects
        self.quotes += chunk.count(b'"')
        max_values = self.limits.max_values + VALUES_PER_OBJECT * self.objects
        if self.values > max_values:
            message = (
                "The document has more values than this service reads as JSON. A larger net can be "
                "sent as a .npy file."
            )
            raise InvalidRequest(
                Issue(
                    "too_many_values",
                    message,
                    "",
                    f"more than {max_values} commas and brackets",
                    f"at most {max_values}, or a .npy file",
                )
            )
        max_strings = MAX_STRINGS + STRINGS_PER_OBJECT * self.objects
        if self.quotes // 2 > max_strings or self.objects > MAX_OBJECTS:
            raise too_many_strings()

    @property
    def memory(self) -> int:
        """Upper bound, in bytes, of the memory that the text so far and its Python objects need."""
        return 3 * self.received + bound_memory(self.values + 1, self.quotes // 2, self.objects)


def bound_memory(values: int, strings: int, objects: int) -> int:
    """Upper bound, in bytes, of the memory of the Python objects of a document."""
    few_strings, few_objects = min(strings, MAX_STRINGS), min(objects, MAX_STRINGS)
    return (
        BYTES_PER_VALUE * values
        + BYTES_PER_STRING * few_strings
        + BYTES_PER_MORE_STRING * (strings - few_strings)
        + BYTES_PER_OBJECT * few_objects
        + BYTES_PER_MORE_OBJECT * (objects - few_objects)
    )
