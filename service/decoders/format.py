"""The type of a decoder: name, media type, suffixes, and a function from bytes to a document."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from service.errors import InvalidRequest, Issue, MalformedBody

Tree: TypeAlias = dict[str, Any]
"""A surface in the language of requests, where arrays may stand for lists of numbers."""


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
        control points; returns a document that is yet to be checked, with the file's values.
    about : str
        Text for the OpenAPI document: the content of such a file, and how the service reads it.
    weight : float
        Memory in bytes for each byte of a file, the file included, until it is a surface.
    example : tuple of str, optional
        For a text: a title, and the text.
        Of a text: what it says, and the text.
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
        """Most memory in bytes of a file of this length, until it is a surface."""
        return int(self.weight * length)


def malformed(message: str, got: str, needed: str) -> MalformedBody:
    """The error of bytes that are not in this format."""
    return MalformedBody(Issue("malformed_body", message, "", got, needed))


def check_kind(kind: str | None, kinds: tuple[str, ...]) -> None:
    """Refuses a kind of surface that the file's net cannot be."""
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
        raise too_many(f"{points} control points", most, where)


def too_many(got: str, most: int, where: str = "") -> InvalidRequest:
    """The error of too many control points."""
    message = "The surface has more control points than this service allows."
    return InvalidRequest(Issue("too_many_control_points", message, where, got, f"at most {most}"))
