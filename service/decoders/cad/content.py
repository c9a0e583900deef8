"""The content of a CAD file as values: solids and shells, their placements, and a report.

Each reader of a format makes these values; `service.decoders.cad.document` makes a brep or a group
of them. Lengths are in the unit of the file's root: a reader converts parts of other units.
"""

from dataclasses import dataclass, field

from service.bases.arrays import FloatArray
from service.decoders.format import FileLimits

__all__ = [
    "CadContent",
    "Coedge",
    "Curve",
    "Definition",
    "Edge",
    "Face",
    "FileLimits",
    "Part",
    "Placement",
    "Reading",
    "Shell",
    "SkippedFace",
    "Surface",
]


@dataclass(frozen=True, eq=False, slots=True)
class Curve:
    """A clamped B-spline curve in homogeneous coordinates, of n points and degree p.

    Attributes
    ----------
    degree : int
    knots : ndarray of float64, shape (n + p + 1,)
    points : ndarray of float64, shape (n, D + 1)
        Rows (w x, w y, w z, w) of a curve in space (D = 3); (w u, w v, w) of a pcurve (D = 2).
    """

    degree: int
    knots: FloatArray
    points: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Surface:
    """A clamped B-spline surface in homogeneous coordinates, of n × m points and degrees (p, q).

    Attributes
    ----------
    degrees : tuple of two ints
    knots : tuple of two ndarrays of float64
        Shapes (n + p + 1,) and (m + q + 1,).
    points : ndarray of float64, shape (n, m, 4)
        Rows (w x, w y, w z, w); the first axis is that of u.
    """

    degrees: tuple[int, int]
    knots: tuple[FloatArray, FloatArray]
    points: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Edge:
    """A curve between two vertices of a part.

    Attributes
    ----------
    vertices : tuple of two ints
    curve : Curve or None
        None for a line, and for a pole.
    is_degenerate : bool
        Whether the edge is a pole: a border of the surface that is one point.
    uncertainty : float or None
        How far the curve may be from the true one; None for that of the part.
    """

    vertices: tuple[int, int]
    curve: Curve | None = None
    is_degenerate: bool = False
    uncertainty: float | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Coedge:
    """The use of an edge by a loop; `pcurve` runs along the edge's own direction."""

    edge: int
    is_reversed: bool = False
    pcurve: Curve | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Face:
    """A trimmed face.

    Attributes
    ----------
    surface : Surface
    loops : tuple of tuples of Coedge
        Material is on the left, seen against du × dv of the surface, whether or not the face is
        reversed. No loops: the whole surface.
    is_reversed : bool
        Whether the face's normal is opposite to du × dv.
    name : str
    color : tuple of three or four floats, or None
    """

    surface: Surface
    loops: tuple[tuple[Coedge, ...], ...]
    is_reversed: bool = False
    name: str = ""
    color: tuple[float, ...] | None = None


@dataclass(frozen=True, slots=True)
class Shell:
    """Faces of a part, by number; of a solid the first shell is the outer one."""

    faces: tuple[int, ...]
    is_closed: bool


@dataclass(frozen=True, eq=False, slots=True)
class Part:
    """A solid, or open shells: what becomes one brep.

    Attributes
    ----------
    name : str
    vertices : ndarray of float64, shape (V, 3)
    edges : tuple of Edge
    faces : tuple of Face
    shells : tuple of Shell
        Each face is in exactly one of them.
    uncertainty : float or None
    color : tuple of three or four floats, or None
        Of faces without a colour of their own.
    """

    name: str
    vertices: FloatArray
    edges: tuple[Edge, ...]
    faces: tuple[Face, ...]
    shells: tuple[Shell, ...]
    uncertainty: float | None = None
    color: tuple[float, ...] | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Placement:
    """An instance: a definition, placed in another one or in the file's root.

    Attributes
    ----------
    definition : int
        Number in `CadContent.definitions`; placements never form a circle.
    name : str
        Name of the instance; if it is empty, that of the definition counts.
    matrix : ndarray of float64, shape (4, 4), or None
        Acts on columns (x, y, z, 1); may mirror and scale. None stands for the identity.
    color : tuple of three or four floats, or None
    """

    definition: int
    name: str = ""
    matrix: FloatArray | None = None
    color: tuple[float, ...] | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Definition:
    """A product: parts of its own, and placements of other products."""

    name: str
    parts: tuple[Part, ...] = ()
    placements: tuple[Placement, ...] = ()


@dataclass(frozen=True, slots=True)
class SkippedFace:
    """A face of the file that is not in the surface: its number in the file, and the reason."""

    entity: str
    reason: str


@dataclass(frozen=True, slots=True)
class Reading:
    """The report of reading a file: nothing is lost silently.

    Attributes
    ----------
    format : str
        Name of the decoder.
    schema : str
        Schema that the file names, such as AUTOMOTIVE_DESIGN.
    system : str
        The system that wrote the file, as the file says.
    units : tuple of str
        Names of the units of length in the file, such as "inch"; the root's first.
    metres_per_unit : float or None
        The root's unit.
    uncertainty : float or None
        The largest that a representation states, in the root's unit.
    products, solids, closed_shells, open_shells, faces : int
        Counts of definitions, each once, however often it is placed.
    skipped_entities : dict
        Count of skipped entities by keyword or number of type.
    skipped_faces : tuple of SkippedFace
    changed_names : int
        Names that were shortened or cleaned.
    edge_gap, vertex_gap : float
        Largest distance from an edge to a surface, and from a vertex to an edge, that was found.
    unfollowed_references : int
        References to other files, none of which was opened.
    open_edges : int
        Edges of only one face: in files whose faces do not share edges, where borders of faces do
        not agree as a whole; else in shells that the file calls closed, which are then open.
    """

    format: str
    schema: str = ""
    system: str = ""
    units: tuple[str, ...] = ()
    metres_per_unit: float | None = None
    uncertainty: float | None = None
    products: int = 0
    solids: int = 0
    closed_shells: int = 0
    open_shells: int = 0
    faces: int = 0
    skipped_entities: dict[str, int] = field(default_factory=dict)
    skipped_faces: tuple[SkippedFace, ...] = ()
    changed_names: int = 0
    edge_gap: float = 0.0
    vertex_gap: float = 0.0
    unfollowed_references: int = 0
    open_edges: int = 0


@dataclass(frozen=True, eq=False, slots=True)
class CadContent:
    """All that was read from one file; the first placements are those of its roots."""

    definitions: tuple[Definition, ...]
    roots: tuple[Placement, ...]
    reading: Reading
    metres_per_unit: float | None = None
    up: str = "z"
