"""What a decoder is: a name, a media type, suffixes, and a function from bytes to a document."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from service.errors import InvalidRequest, Issue, MalformedBody

Tree: TypeAlias = dict[str, Any]
"""A surface in the language of requests, where arrays may stand for lists of numbers."""


@dataclass(frozen=True, slots=True)
class Decoder:
    """One kind of file that holds control nets.

    Attributes
    ----------
    name : str
    title : str
    media_type : str
    suffixes : tuple of str
        Without a dot; the first is the usual one.
    binary : bool
        Whether it is no text.
    kinds : tuple of str
        The kinds of surface that such a file can be read as.
    decode : callable
        Of the bytes, the kind of surface that is asked for (None leaves the choice to the file) and
        the most control points. Its answer is to be checked like any document: it has the values of
        the file, whatever they are.
    about : str
        What it holds and how it is read, as the OpenAPI document tells it.
    weight : float
        Bytes for each byte of a file, its own included, until it has become a surface.
    example : tuple of str, optional
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
        """Bytes that a file of this length takes at most until it has become a surface."""
        return int(self.weight * length)


def malformed(message: str, got: str, needed: str) -> MalformedBody:
    """The refusal of bytes that are no such file."""
    return MalformedBody(Issue("malformed_body", message, "", got, needed))


def check_kind(kind: str | None, kinds: tuple[str, ...]) -> None:
    """Refuses a kind of surface that the net in the file cannot be."""
    if kind is not None and kind not in kinds:
        raise InvalidRequest(
            Issue(
                "wrong_value",
                "The control points of this file are no surface of this kind.",
                "/surface/type",
                "another kind",
                " or ".join(kinds),
            )
        )


def check_count(points: int, most: int, where: str = "") -> None:
    """Refuses more control points than are taken."""
    if points > most:
        raise too_many(f"{points} control points", most, where)


def too_many(got: str, most: int, where: str = "") -> InvalidRequest:
    """The refusal of more control points than are taken."""
    message = "The surface has more control points than this service takes."
    return InvalidRequest(Issue("too_many_control_points", message, where, got, f"at most {most}"))
