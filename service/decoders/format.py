"""The type of a decoder, and the errors that decoders share."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from service.errors import InvalidRequest, Issue, MalformedBody, count_nouns

Tree: TypeAlias = dict[str, Any]
"""The document of a surface as in a request, but with arrays in place of lists of numbers."""


@dataclass(frozen=True, slots=True)
class Decoder:
    """A format of files with control nets.

    Attributes
    ----------
    name : str
    title : str
    media_type : str
    suffixes : tuple of str
        Suffixes without a dot; the usual suffix is first.
    is_binary : bool
        Whether the file is binary; if not, it is text.
    kinds : tuple of str
        The kinds of surface that a client may request for a file of this format.
    decode : callable
        Takes the bytes, the requested kind of surface (None if the file decides) and the maximum
        number of control points; returns the document of the surface, with values that are not
        checked yet.
    about : str
        Text for the OpenAPI document: the content of a file, and how the service reads it.
    memory_factor : float
        Bytes of memory for each byte of a file, until the surface is built; the byte itself is
        included.
    example : tuple of str, optional
        For text formats: a title and the text of an example.
    """

    name: str
    title: str
    media_type: str
    suffixes: tuple[str, ...]
    is_binary: bool
    kinds: tuple[str, ...]
    decode: Callable[[bytes, str | None, int], Tree]
    about: str
    memory_factor: float
    example: tuple[str, str] | None = None

    def memory(self, length: int) -> int:
        """The most bytes of memory for a file of this length, until the surface is built."""
        return int(self.memory_factor * length)


def build_malformed_error(message: str, got: str, needed: str) -> MalformedBody:
    """The error for a file that does not have the format of its decoder."""
    return MalformedBody(Issue("malformed_body", message, "", got, needed))


def check_kind(kind: str | None, kinds: tuple[str, ...]) -> None:
    """Refuse a requested kind of surface that is not among `kinds`."""
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


def check_count(points: int, max_points: int, pointer: str = "") -> None:
    """Refuse more than `max_points` control points."""
    if points > max_points:
        raise build_too_many_error(count_nouns(points, "control points"), max_points, pointer)


def build_too_many_error(got: str, max_points: int, pointer: str = "") -> InvalidRequest:
    """The error for too many control points."""
    return InvalidRequest(
        Issue(
            "too_many_control_points",
            "The surface has more control points than this service allows.",
            pointer,
            got,
            f"at most {max_points}",
        )
    )
