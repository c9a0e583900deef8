"""The type of a decoder: name, media type, suffixes, and a function from bytes to a document."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from service.errors import InvalidRequest, Issue, MalformedBody, count_nouns

Tree: TypeAlias = dict[str, Any]
"""The document of a surface, as in a request, with arrays in place of lists of numbers."""


@dataclass(frozen=True, slots=True)
class Decoder:
    """A format of files with control nets.

    Attributes
    ----------
    name : str
    title : str
    media_type : str
    suffixes : tuple of str
        Without a dot, the usual one first.
    binary : bool
        Whether the file is not a text.
    kinds : tuple of str
        Kinds of surface that such a file may become.
    decode : callable
        Takes the bytes, the requested kind of surface (None: the file decides) and the limit of
        control points; returns the document of the surface, unchecked.
    about : str
        Text for the OpenAPI document: the content of such a file, and how the service reads it.
    weight : float
        Bytes of memory for each byte of a file, including that byte, until the surface is built.
    example : tuple of str, optional
        For text formats: a title and the text of an example.
    """

    name: str
    title: str
    media_type: str
    suffixes: tuple[str, ...]
    binary: bool
    kinds: tuple[str, ...]
    decode: Callable[[bytes, str | None, int], Tree]
    about: str
    weight: float
    example: tuple[str, str] | None = None

    def memory(self, length: int) -> int:
        """The most bytes of memory for a file of this length, until the surface is built."""
        return int(self.weight * length)


def build_malformed_error(message: str, got: str, needed: str) -> MalformedBody:
    """The error for bytes that are not in this format."""
    return MalformedBody(Issue("malformed_body", message, "", got, needed))


def check_kind(kind: str | None, kinds: tuple[str, ...]) -> None:
    """Refuses a kind of surface that the format cannot store."""
    if kind is not None and kind not in kinds:
        raise InvalidRequest(
            Issue(
                "wrong_value",
                "The control points of this file cannot be a surface of this kind.",
                "/surface/type",
                "another kind",
                " or ".join(kinds),
            )
        )


def check_count(points: int, most: int, where: str = "") -> None:
    """Refuses more control points than the limit."""
    if points > most:
        raise too_many(count_nouns(points, "control points"), most, where)


def too_many(got: str, most: int, where: str = "") -> InvalidRequest:
    """The error for too many control points."""
    message = "The surface has more control points than this service allows."
    return InvalidRequest(Issue("too_many_control_points", message, where, got, f"at most {most}"))
