"""The type of a decoder, the limits of files, and the errors that decoders share."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, TypeAlias

from service.errors import InvalidRequest, Issue, MalformedBody, TooLarge, count_nouns

Tree: TypeAlias = dict[str, Any]
"""The document of a surface as in a request, but with arrays in place of lists of numbers."""


@dataclass(frozen=True, slots=True)
class FileLimits:
    """The most that a file may have; a file with more is refused before anything is allocated."""

    max_control_points: int = 1_000_000
    max_entities: int = 2_000_000
    max_faces: int = 20_000
    max_placed_faces: int = 1_000_000
    max_definitions: int = 4_096
    max_members: int = 65_536


DEFAULT_FILE_LIMITS = FileLimits()


@dataclass(frozen=True, eq=False, slots=True)
class Decoded:
    """The content of a file.

    Attributes
    ----------
    tree : dict
        The document of the surface, with values that are not checked yet.
    reading : Mapping or None
        The report of reading a CAD file: texts, numbers, lists and dicts. None for other files.
    """

    tree: Tree
    reading: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Decoder:
    """A format of files with surfaces: control nets, or the parts of a CAD system.

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
        The kinds of surface that a client may request for a file of this format; empty if the file
        always decides.
    decode : callable
        Takes the bytes, the requested kind of surface (None if the file decides) and the limits;
        returns the content of the file. The values are not checked yet.
    about : str
        Text for the OpenAPI document: the content of a file, and how the service reads it.
    memory_factor : float
        Bytes of memory for each byte of a file, until the surface is built; the byte itself is
        included.
    base_memory : int
        Bytes of memory for any file that a child process reads, in addition.
    fields : tuple of str
        The fields of the surface that a client may set beside a file, in a query or by flags.
    example : tuple of str, optional
        For text formats: a title and the text of an example.
    is_cad : bool
        Whether a file has the parts of a CAD system, and a report of reading. If not, it has one
        surface, or patches, by their control points.
    is_mesh : bool
        Whether a file has a mesh to be compared with a surface, and not a surface.
    byte_seconds, base_seconds : float
        The most processor time of a child process for each byte of a file, and for any file in
        addition: several times what files of this format take.
    child_bytes : int, optional
        The most bytes of a file that this process reads itself; a longer file is read in a child
        process. None: this process reads every file.
    library, extra : str
        The module that must be installed to read the format, and the extra of this service that
        installs it. Empty if the service itself reads it.
    """

    name: str
    title: str
    media_type: str
    suffixes: tuple[str, ...]
    is_binary: bool
    kinds: tuple[str, ...]
    decode: Callable[[bytes, str | None, FileLimits], Decoded]
    about: str
    memory_factor: float
    base_memory: int = 0
    byte_seconds: float = 1e-5
    base_seconds: float = 5.0
    fields: tuple[str, ...] = ("type", "degree", "knots", "up", "name")
    example: tuple[str, str] | None = None
    is_cad: bool = False
    is_mesh: bool = False
    child_bytes: int | None = None
    library: str = ""
    extra: str = ""

    def memory(self, length: int) -> int:
        """The most bytes of memory for a file of this length, until the surface is built."""
        base_memory = self.base_memory if self.is_read_in_child(length) else 0
        return int(self.memory_factor * length) + base_memory

    def seconds(self, length: int) -> float:
        """The most processor time of a child process for a file of this length."""
        return self.byte_seconds * length + self.base_seconds

    def body_memory(self, length: int) -> int:
        """The most bytes of memory for a body of this length, until work on it begins.

        What a child process takes counts as work.
        """
        return length if self.is_read_in_child(length) else self.memory(length)

    def is_read_in_child(self, length: int) -> bool:
        """Whether a child process reads a file of this length."""
        return self.child_bytes is not None and length > self.child_bytes

    def is_available(self) -> bool:
        """Whether the library that reads the format is installed; does not import it."""
        return not self.library or find_spec(self.library) is not None


def build_malformed_error(message: str, got: str, needed: str) -> MalformedBody:
    """The error for a file that does not have the format of its decoder."""
    return MalformedBody(Issue("malformed_body", message, "", got, needed))


def build_file_error(message: str, got: str = "", needed: str = "") -> InvalidRequest:
    """The error of a file that has the right format, but is damaged so that nothing can be read."""
    return InvalidRequest(Issue("malformed_file", message, "", got, needed))


def check_entities(count: int, limits: FileLimits) -> None:
    """Refuse a file with too many entities (records, objects)."""
    code, limit = "too_many_entities", limits.max_entities
    _check(code, count, limit, "entities", "SURFACE_MAX_FILE_ENTITIES")


def check_faces(count: int, limits: FileLimits) -> None:
    """Refuse a file that defines too many faces; a definition counts once."""
    code, limit = "too_many_faces", limits.max_faces
    _check(code, count, limit, "faces", "SURFACE_MAX_FACES")


def check_placed_faces(count: int, limits: FileLimits) -> None:
    """Refuse a file with too many faces in all placements together; count before placing."""
    code, limit = "too_many_placed_faces", limits.max_placed_faces
    _check(code, count, limit, "placed faces", "SURFACE_MAX_PLACED_FACES")


def check_parts(count: int, nouns: str, limit: int) -> None:
    """Refuse a file with too many surfaces (`max_definitions`) or curves (`max_members`)."""
    _check("too_many_parts", count, limit, nouns, "SURFACE_MAX_MEMBERS")


def _check(code: str, count: int, limit: int, nouns: str, setting: str) -> None:
    """Refuse a count above its limit, with the name of the setting that may be raised."""
    if count > limit:
        message = f"The file has more {nouns} than this service takes."
        got, needed = count_nouns(count, nouns), f"at most {limit} ({setting})"
        raise TooLarge(Issue(code, message, "", got, needed))


def check_kind(kind: str | None, kinds: tuple[str, ...]) -> None:
    """Refuse a requested kind of surface that is not among `kinds`."""
    if kind is not None and kind not in kinds:
        raise InvalidRequest(
            Issue(
                "wrong_value",
                "The control points of this file cannot be a surface of this kind.",
                "/surface/type",
                "another kind",
                " or ".join(kinds) or "no kind: the file decides",
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
