"""The report of reading a CAD file, as JSON."""

from typing import Annotated

from pydantic import Field

from service.api.models.meshes import Count, Length, Missing, ResponseModel


class UnreadFace(ResponseModel):
    """A face of a CAD file that is not in the surface."""

    entity: Annotated[str, Field(examples=["#120"])]
    """Its number in the file."""
    reason: str
    """Why it could not be read."""


class Reading(ResponseModel):
    """The report of reading a CAD file: its content, and every face that could not be read."""

    format: Annotated[str, Field(examples=["step"])]
    """Name of the format."""
    schema_: Annotated[str | Missing, Field(alias="schema", examples=["AUTOMOTIVE_DESIGN"])] = None
    """Schema that the file names."""
    system: str | Missing = None
    """System that wrote the file, as the file says."""
    units: list[str]
    """Names of the units of length in the file; that of the surface is first."""
    metres_per_unit: Annotated[float, Field(gt=0)] | Missing = None
    """Metres in a unit of the surface; missing if the file does not say."""
    uncertainty: Length | Missing = None
    """The largest uncertainty of lengths that the file states, in units of the surface."""
    products: Count
    """Products, each once, however often it is placed; so are all counts."""
    solids: Count
    """Solids."""
    closed_shells: Count
    """Closed shells."""
    open_shells: Count
    """Open shells; loose faces are one."""
    faces: Count
    """Faces of the surface."""
    skipped_entities: Annotated[dict[str, Count], Field(examples=[{"GEOMETRIC_SET": 2}])]
    """Numbers of entities that were not read, by their keyword or type."""
    skipped_faces: list[UnreadFace]
    """All faces of the file that are not in the surface."""
    changed_names: Count
    """Names that were shortened, or lost characters that names cannot have."""
    edge_gap: Length
    """Largest distance from an edge to a surface that was found, in units of the surface."""
    vertex_gap: Length
    """Largest distance from a vertex to an edge that was found."""
    unfollowed_references: Count
    """References to other files; none of them was opened."""
    open_edges: Count
    """Edges of only one face. Where faces do not share edges in the file (IGES): the borders of
    open shells, and borders that agree only in part; else in shells that the file calls closed,
    which are then read as open."""
