"""The calls of the service, as a table: one row makes a method of every client.

A row is a function without a body: its signature and its docstring are those of the method, which
returns the answer at once in `Client` and `Local`, and has to be awaited in `AsyncClient`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar, Unpack

from service.client import answers
from service.client.call import A, Call, Format, P, Subject
from service.client.fields import (
    CheckFields,
    ConvertFields,
    CurveFields,
    FileFields,
    ImageFields,
    IntersectFields,
    MeasureFields,
    MeshFields,
    PointsFields,
    ProjectFields,
    SignFields,
)
from service.client.given_mesh import GivenMesh
from service.client.mesh import Mesh
from service.client.picture import Picture
from service.client.records import Answer

if TYPE_CHECKING:
    from service.client.surfaces import Surface

SomeAnswer = TypeVar("SomeAnswer", bound=Answer)


def _answers(
    kind: type[SomeAnswer], *, subject: Subject = "surface", reads_files: bool = False
) -> Callable[[Callable[P, SomeAnswer]], Call[P, SomeAnswer]]:
    """Makes a row of a function whose answer is JSON."""

    def make(function: Callable[P, SomeAnswer]) -> Call[P, SomeAnswer]:
        return Call(function, kind.read, subject=subject, format="json", reads_files=reads_files)

    return make


def _makes(read: Callable[[bytes], A], format: Format) -> Callable[[Callable[P, A]], Call[P, A]]:
    """Makes a row of a function whose answer is a file that is made of a surface."""

    def make(function: Callable[P, A]) -> Call[P, A]:
        return Call(function, read, subject="surface", format=format, reads_files=True)

    return make


@_makes(Mesh.read, "npz")
def mesh(surface: Surface, **options: Unpack[MeshFields]) -> Mesh:
    """The mesh of a surface, by `resolution` or by `tolerance`."""
    raise NotImplementedError


@_makes(Picture, "png")
def image(surface: Surface, **options: Unpack[ImageFields]) -> Picture:
    """A picture of a surface, right to a quarter of a pixel."""
    raise NotImplementedError


@_answers(answers.Points)
def points(surface: Surface, **fields: Unpack[PointsFields]) -> answers.Points:
    """Points at parameters: with derivatives, normals and curvatures."""
    raise NotImplementedError


@_answers(answers.Curve, subject="curve")
def curve(curve: Mapping[str, Any], **options: Unpack[CurveFields]) -> answers.Curve:
    """Samples of a curve, by `resolution`, by `tolerance` or at `parameters`."""
    raise NotImplementedError


@_answers(answers.ClosestPoints)
def project(
    surface: Surface | None = None, **fields: Unpack[ProjectFields]
) -> answers.ClosestPoints:
    """The closest points of a surface, or of a `curve`, with proved distances."""
    raise NotImplementedError


@_answers(answers.Intersections)
def intersect(surface: Surface, **fields: Unpack[IntersectFields]) -> answers.Intersections:
    """Where `rays` hit a surface, or `planes` cut it."""
    raise NotImplementedError


@_answers(answers.Measures, reads_files=True)
def measure(surface: Surface, **fields: Unpack[MeasureFields]) -> answers.Measures:
    """Area, lengths of borders and volume, with proved bounds."""
    raise NotImplementedError


@_answers(answers.MeshCheck)
def check(surface: Surface, mesh: GivenMesh, **fields: Unpack[CheckFields]) -> answers.MeshCheck:
    """How far a mesh of any program and its surface are apart, with proved intervals."""
    raise NotImplementedError


@_answers(answers.Converted, reads_files=True)
def convert(surface: Surface, **fields: Unpack[ConvertFields]) -> answers.Converted:
    """The surface after `operations`; without any, a file as a dictionary."""
    raise NotImplementedError


@_answers(answers.Estimate, reads_files=True)
def estimate(surface: Surface, **options: Unpack[MeshFields]) -> answers.Estimate:
    """How large a mesh would be, and whether it would be refused."""
    raise NotImplementedError


@_answers(answers.Stored, reads_files=True)
def store(surface: Surface, **fields: Unpack[FileFields]) -> answers.Stored:
    """Stores a surface; its `id` then stands for it."""
    raise NotImplementedError


@_answers(answers.Signed, subject="url")
def sign(url: str, **fields: Unpack[SignFields]) -> answers.Signed:
    """Makes a URL of a surface or a mesh that can be read without a key for a time."""
    raise NotImplementedError
