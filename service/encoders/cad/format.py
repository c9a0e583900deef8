"""The type of formats of definitions, and the report on a file that was written."""

from collections.abc import Callable
from dataclasses import dataclass

from service.encoders.format import Content, FileFormat
from service.surface.lowered import Model
from service.surface.sizes import SurfaceSize

Allow = Callable[[int], None]
"""Refuses a file that may have more than a number of bytes; called before it is written."""


@dataclass(frozen=True, slots=True)
class WritingReport:
    """The counts and the unit of a file.

    Attributes
    ----------
    faces : int
        Faces of all definitions, each once; for cells, their number.
    definitions, instances : int
    metres_per_unit : float or None
        The unit of the file; None if the format has none.
    is_unit_assumed : bool
        Whether the model has no unit, so that one unit is written as 1 mm.
    """

    faces: int
    definitions: int = 1
    instances: int = 1
    metres_per_unit: float | None = None
    is_unit_assumed: bool = False


@dataclass(frozen=True, eq=False, slots=True)
class WrittenFile:
    """The bytes of a file, and the report on it."""

    content: Content
    report: WritingReport


@dataclass(frozen=True, slots=True)
class DefinitionFormat(FileFormat):
    """A format of surfaces as they are defined.

    Attributes
    ----------
    encode : callable
        Writes a model as a file; its unit is given in metres, or None if it is not known. Calls
        `Allow` with an upper bound of the bytes before.
    estimate : callable
        About the most bytes of a file, from the size of the surface.
    has_trims : bool
        Whether the format can store breps.
    """

    encode: Callable[[Model, float | None, Allow], WrittenFile]
    estimate: Callable[[SurfaceSize], int]
    has_trims: bool = True
