"""The JSON language of meshes that clients give: vertices, and faces of three or four corners.

The fields are those of a mesh in JSON as `POST /v1/mesh` answers, so that such an answer can be
sent back as it is.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from typing import Annotated, Any, Self, TypeAlias

import numpy as np
from pydantic import (
    BeforeValidator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import core_schema

from service.bases.arrays import FloatArray, Ints
from service.bases.cache import build_by_text
from service.errors import MAX_ISSUES, Issue, count_nouns
from service.schemas.arrays import NumberGrid, tuple_schema
from service.schemas.document import DocumentLimits
from service.schemas.fields import Omittable, StrictModel, length_issue, optional
from service.schemas.validation import (
    Path,
    empty_list,
    limits_of,
    to_invalid,
    to_refusal,
    wrong_type,
)
from service.surface.checks import validate_points
from service.surface.given_mesh import (
    NO_CORNER,
    VERTICES_PER_TRIANGLE,
    GivenMesh,
    QuadDiagonal,
    divide_faces,
)

VERTICES = NumberGrid(
    ("vertices", "coordinates"), width=3, width_rule="A vertex has exactly three coordinates."
)
NORMALS = NumberGrid(
    ("normals", "coordinates"), width=3, width_rule="A normal has exactly three coordinates."
)
CORNERS = NumberGrid(("corners",), integers=True)

_NEEDED_FACES = "a list of faces"


class FaceLists:
    """The annotation of a field of faces, which become an array (f, 3), or (f, 4) with quads.

    If only some of the faces have four corners, the last corner of the others is `NO_CORNER`.
    """

    def array(self, value: object) -> Ints:
        """Convert lists of three or four whole numbers, or an array that has this form already.

        Raises
        ------
        pydantic.ValidationError
            With one detail for each of the first `MAX_ISSUES` errors.
        """
        if isinstance(value, np.ndarray):
            if value.ndim != 2 or value.shape[1] not in (3, 4) or value.dtype.kind not in "iu":
                raise to_refusal([((), wrong_type({}, _NEEDED_FACES))])
            return np.ascontiguousarray(value, np.intp)
        if not isinstance(value, list):
            raise to_refusal([((), wrong_type(value, _NEEDED_FACES))])
        if not value:
            raise to_refusal([((), empty_list(_NEEDED_FACES))])
        if set(map(type, value)) != {list} or not set(map(len, value)) <= {3, 4}:
            raise to_refusal(_find_faults(value))
        indices = list(chain.from_iterable(value))
        if not CORNERS.has_numbers(indices):
            raise to_refusal(_find_faults(value))
        flat = np.fromiter(indices, np.intp, len(indices))
        counts = np.fromiter(map(len, value), np.intp, len(value))
        if counts.min() == counts.max():
            return flat.reshape(len(value), -1)
        faces = np.full((len(value), 4), NO_CORNER, np.intp)
        faces[np.arange(4) < counts[:, np.newaxis]] = flat
        return faces

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """The validator of the field; arrays of lists that were sent before come from a cache."""

        def validate(value: object) -> Ints:
            return build_by_text(value, "faces", lambda: self.array(value))

        return core_schema.no_info_plain_validator_function(validate)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """The JSON Schema of the field: arrays of three or four indices."""
        corners = tuple_schema({"type": "integer", "minimum": 0}, 3) | {"maxItems": 4}
        return {"type": "array", "items": corners, "minItems": 1}


def _find_faults(faces: list[Any]) -> Iterator[tuple[Path, Issue]]:
    """Yields the errors of faces, one after another, as (path, issue)."""
    for number, face in enumerate(faces):
        if isinstance(face, list) and len(face) not in (3, 4):
            message = "A face has three or four corners."
            got = count_nouns(len(face), "corners")
            yield (number,), Issue("wrong_dimension", message, "", got, "3 or 4 corners")
        else:
            for path, issue in CORNERS.find_faults(face):
                yield (number, *path), issue


def _ignore(_: object) -> None:
    """The value of a field that a mesh may have, and that is not read."""


Ignored: TypeAlias = Annotated[
    Any,
    BeforeValidator(_ignore),
    WithJsonSchema({}),
    Field(
        default=None,
        description="It is ignored, so that a mesh of this service can be sent as it is.",
    ),
]


class MeshDefinition(StrictModel):
    """A mesh by its vertices and faces, as `POST /v1/mesh` writes it with `format=json`."""

    vertices: Annotated[FloatArray, VERTICES] = Field(
        description="Positions [x, y, z], in the coordinates of the surface.",
        examples=[[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]],
    )
    faces: Annotated[Ints, FaceLists()] = Field(
        description="For each face the numbers of its three or four vertices, from 0, "
        "counter-clockwise seen from outside.",
        examples=[[[0, 1, 2, 3]]],
    )
    normals: Annotated[FloatArray | None, Omittable(), NORMALS] = optional(
        "Normals [x, y, z] of any length, one for every vertex; [0, 0, 0] stands for none. If there"
        " are `attribute_faces`, they say which normal a corner has.",
        [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1]],
    )
    attribute_faces: Annotated[Ints | None, Omittable(), FaceLists()] = optional(
        "For each corner of `faces` the number of its normal, if that is not the number of its "
        "vertex.",
        [[0, 1, 2, 3]],
    )
    uvs: Ignored
    colors: Ignored
    attributes: Ignored
    parts: Ignored
    lines: Ignored
    report: Ignored

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> Self:
        _check_size(len(self.vertices), _count_triangles(self.faces), limits_of(info))
        _check_indices(self.faces, len(self.vertices), "faces", "Faces index the list of vertices.")
        if self.normals is None:
            return self
        if self.attribute_faces is None:
            _check_length("normals", self.normals, len(self.vertices))
            return self
        _check_length("attribute_faces", self.attribute_faces, len(self.faces))
        if not np.array_equal(_count_corners(self.faces), _count_corners(self.attribute_faces)):
            message, needed = "`attribute_faces` have the corners of `faces`.", "the same corners"
            issue = Issue("wrong_dimension", message, "/attribute_faces", "other corners", needed)
            raise to_invalid(issue)
        message = "The corners of `attribute_faces` index the list of normals."
        _check_indices(self.attribute_faces, len(self.normals), "attribute_faces", message)
        return self

    def to_mesh(self, diagonal: QuadDiagonal) -> GivenMesh:
        """The mesh; each face of four corners is divided into two triangles along a diagonal.

        Raises
        ------
        InvalidRequest
            `coordinate_too_large`, with pointers into this object.
        """
        positions = validate_points(self.vertices, "vertices", 2)
        triangles = divide_faces(self.faces, diagonal)
        normals, rows = self.normals, self.attribute_faces
        if normals is None or rows is None:
            return GivenMesh(positions, triangles, normals)
        # A vertex for each pair of a position and a normal that some corner has.
        pairs = triangles * len(normals) + divide_faces(rows, diagonal)
        used, numbers = np.unique(pairs, return_inverse=True)
        position_rows, normal_rows = np.divmod(used, len(normals))
        shape = triangles.shape
        return GivenMesh(positions[position_rows], numbers.reshape(shape), normals[normal_rows])


def _count_corners(faces: Ints) -> Ints:
    """The number of corners of each face, shape (f,)."""
    counts: Ints = (faces != NO_CORNER).sum(axis=1)
    return counts


def _count_triangles(faces: Ints) -> int:
    """The number of triangles after each face of four corners has been divided."""
    return len(faces) + int((_count_corners(faces) == 4).sum())


def _check_size(vertices: int, triangles: int, limits: DocumentLimits) -> None:
    """Refuse a mesh with more vertices or triangles than the service takes."""
    most = limits.max_control_points
    message, needed = "The mesh is larger than this service takes.", f"at most {most} triangles"
    if triangles > most:
        got = count_nouns(triangles, "triangles")
        raise to_invalid(Issue("too_many_triangles", message, "", got, needed))
    if vertices > VERTICES_PER_TRIANGLE * most:
        got, needed = count_nouns(vertices, "vertices"), f"at most {VERTICES_PER_TRIANGLE * most}"
        raise to_invalid(Issue("too_many_vertices", message, "", got, needed))


def _check_length(name: str, values: FloatArray | Ints, count: int) -> None:
    """Refuse a list that does not have `count` items."""
    if len(values) != count:
        issue = length_issue(f"a list of {len(values)}", f"a list of {count}")
        raise to_invalid(replace(issue, pointer=f"/{name}"))


def _check_indices(faces: Ints, count: int, name: str, message: str) -> None:
    """Refuse indices outside of 0 … count − 1."""
    is_wrong = ((faces < 0) | (faces >= count)) & (faces != NO_CORNER)
    if is_wrong.any():
        raise to_refusal(
            (
                (name, *place),
                Issue(
                    "index_out_of_range", message, "", str(faces[tuple(place)]), f"0 to {count - 1}"
                ),
            )
            for place in np.argwhere(is_wrong)[:MAX_ISSUES].tolist()
        )
