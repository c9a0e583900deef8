"""The JSON language of breps: solids and open shells of trimmed faces."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal, TypeAlias, cast

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    Field,
    ValidationInfo,
    WrapValidator,
    model_validator,
)
from pydantic_core.core_schema import ValidatorFunctionWrapHandler

from service.bases.arrays import FloatArray
from service.errors import Issue, count_nouns
from service.schemas.arrays import NumberGrid
from service.schemas.batch_field import ReadInBatches
from service.schemas.brep_batches import (
    check_edges,
    check_face_columns,
    read_edges,
    read_faces,
)
from service.schemas.brep_parts import EdgeDefinition, FaceDefinition, ShellDefinition
from service.schemas.brep_writing import list_edges, list_faces
from service.schemas.document import DocumentLimits
from service.schemas.fields import (
    MetresPerUnit,
    NameField,
    Omittable,
    StrictModel,
    UpField,
    optional,
)
from service.schemas.validation import limits_of, to_invalid
from service.surface.brep import BrepSurface, InvalidFaces
from service.surface.brep_lists import EdgeColumns, FaceColumns

_VERTICES = NumberGrid(("vertices", "coordinates"), width=3, point_levels=1)
_UNCERTAINTIES = NumberGrid(("numbers",), point_levels=1)


def _accept_empty(value: object, handler: ValidatorFunctionWrapHandler) -> Any:
    """Accept an empty list too: a sphere has no vertices."""
    return np.empty((0, 3)) if isinstance(value, list) and not value else handler(value)


def _read_some_faces(items: Sequence[Any], limits: DocumentLimits) -> FaceColumns:
    """Read faces, unless they are too many."""
    _limit_faces(len(items), limits)
    return read_faces(items, limits)


def _check_some_faces(faces: FaceColumns, limits: DocumentLimits) -> FaceColumns:
    """Check the columns of faces, unless they are too many."""
    _limit_faces(len(faces), limits)
    return check_face_columns(faces, limits)


def _limit_faces(count: int, limits: DocumentLimits) -> None:
    if count > limits.max_faces:
        raise to_invalid(_too_many_faces(count, limits))


def check_faces(definitions: Iterable[BaseModel], where: str, info: ValidationInfo) -> None:
    """Refuse surfaces whose breps together have too many faces; `where` is the pointer."""
    breps = [each for each in definitions if isinstance(each, BrepDefinition)]
    total, limits = sum(brep.face_count for brep in breps), limits_of(info)
    if total > limits.max_faces:
        raise to_invalid(replace(_too_many_faces(total, limits), pointer=where))


def _too_many_faces(count: int, limits: DocumentLimits) -> Issue:
    return Issue(
        "too_many_faces",
        "The surface has more faces than this service takes.",
        "",
        count_nouns(count, "faces"),
        f"at most {limits.max_faces}",
    )


Edges: TypeAlias = Annotated[
    tuple[EdgeDefinition, ...],
    Field(strict=False),
    ReadInBatches(read_edges, EdgeDefinition, "edges", EdgeColumns, check_edges, list_edges),
]
Faces: TypeAlias = Annotated[
    tuple[FaceDefinition, ...],
    Field(strict=False, min_length=1),
    ReadInBatches(
        _read_some_faces,
        FaceDefinition,
        "faces",
        FaceColumns,
        _check_some_faces,
        list_faces,
        min_count=1,
    ),
]


class BrepDefinition(StrictModel):
    """A solid, or open shells, of trimmed faces that share edges.

    The words are those of ISO 10303-42. A *face* is the part of a surface inside its *loops*; a
    loop runs along *edges*, and an edge lies between two *vertices*. A solid is a closed *shell*,
    and further closed shells are its voids. One trimmed face is a brep of one face. Both faces at
    an edge get the very same vertices of the mesh, so that it has no cracks.
    """

    type: Literal["brep"] = Field(description="The kind of surface.")
    vertices: Annotated[FloatArray, _VERTICES, WrapValidator(_accept_empty)] = Field(
        default_factory=lambda: np.empty((0, 3)),
        description="The vertices [x, y, z]. Only a brep without edges has none.",
        json_schema_extra={"minItems": 0},
        examples=[[[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0], [7, 5, 0]]],
    )
    vertex_uncertainties: Annotated[
        FloatArray | None, _UNCERTAINTIES, WrapValidator(_accept_empty), AfterValidator(np.ravel)
    ] = Field(
        default=None,
        description="For each vertex, how far it may be from the true one, in model units. The "
        "default is the uncertainty of the brep.",
        json_schema_extra={"minItems": 0},
        examples=[[1e-6, 1e-6, 1e-6, 1e-6, 1e-6]],
    )
    edges: Edges = Field(
        default=(),
        description="The edges.",
        examples=[[{"vertices": [0, 1]}, {"vertices": [1, 2]}, {"vertices": [2, 0]}]],
    )
    faces: Faces = Field(
        description="The faces. The limits of faces and of control points are for the brep, or for "
        "the group with this brep, as a whole.",
        examples=[
            [
                {
                    "surface": {"control_net": [[[0, 0, 0], [0, 9, 0]], [[9, 0, 0], [9, 9, 0]]]},
                    "loops": [{"edges": [0, 1, 2]}],
                }
            ]
        ],
    )
    shells: Annotated[
        tuple[ShellDefinition, ...] | None, Omittable(), Field(strict=False, min_length=1)
    ] = optional(
        "The shells. Left out, all faces are one open shell. Of a solid, the first shell is the "
        "outer one.",
        [{"faces": [0], "closed": False}],
    )
    uncertainty: Annotated[float | None, Omittable(), Field(ge=0)] = optional(
        "How far points may be from the true ones, in model units. A given pcurve is used if it "
        "is at most this far from its edge. The default is 1e-6 of the diagonal of the box about "
        "vertices and edges.",
        1e-6,
    )
    invalid_faces: InvalidFaces = Field(
        default="refuse",
        description="What happens if a face is invalid: its loop is open, loops cross, an edge is "
        "far from its surface. With `refuse` the brep is refused; with `skip` the face is left out "
        "and listed in the report. If the edges of a face are further from its surface than the "
        "uncertainty, its loops never refuse the brep, because a gap is no mistake of the request.",
    )
    metres_per_unit: MetresPerUnit = None
    up: UpField = "y"
    name: NameField = "brep"

    @model_validator(mode="after")
    def _check_size(self, info: ValidationInfo) -> "BrepDefinition":
        limit, total = limits_of(info).max_control_points, self.point_count
        if total > limit:
            raise to_invalid(
                Issue(
                    "too_many_control_points",
                    "The surface has more control points than this service takes.",
                    "",
                    count_nouns(total, "control points"),
                    f"at most {limit}",
                )
            )
        return self

    @property
    def face_count(self) -> int:
        """Number of faces."""
        return len(self._faces)

    @property
    def point_count(self) -> int:
        """Number of control points of all curves and surfaces, and of vertices."""
        edges, faces = self._edges, self._faces
        points = [faces.surfaces.points, faces.pcurves.points, edges.curves.points]
        return len(self.vertices) + sum(map(len, points))

    @property
    def _edges(self) -> EdgeColumns:
        """The edges, which `ReadInBatches` has read to columns."""
        return cast(EdgeColumns, self.edges) if len(self.edges) else NO_EDGES

    @property
    def _faces(self) -> FaceColumns:
        """The faces, which `ReadInBatches` has read to columns."""
        return cast(FaceColumns, self.faces)

    def to_surface(self) -> BrepSurface:
        """The brep as a value; raises `InvalidRequest` with pointers relative to the surface."""
        edges, faces = self._edges, self._faces
        lists = [np.arange(self.face_count)]
        is_closed = [False]
        if self.shells is not None:
            lists = [shell.faces for shell in self.shells]
            is_closed = [shell.closed for shell in self.shells]
        return BrepSurface(
            self.vertices,
            edges.vertices,
            edges.curve_numbers,
            edges.is_degenerate,
            edges.curves,
            faces.surfaces,
            faces.names,
            faces.palette,
            faces.colors,
            faces.is_reversed,
            faces.loop_faces,
            faces.loop_counts,
            faces.coedge_edges,
            faces.coedge_reversed,
            faces.coedge_pcurves,
            faces.pcurves,
            np.array(list(map(len, lists)), np.intp),
            np.concatenate(lists),
            np.array(is_closed, bool),
            self.uncertainty,
            self.vertex_uncertainties,
            edges.uncertainties,
            self.invalid_faces,
            self.up,
            self.name,
            self.metres_per_unit,
        )


NO_EDGES = read_edges([], DocumentLimits())
