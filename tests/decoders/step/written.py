"""Small STEP files, written by hand for tests."""

from collections.abc import Sequence
from itertools import pairwise

from service.decoders.cad.content import CadContent, Face, Part
from service.decoders.format import FileLimits
from service.decoders.step.entities import Entities
from service.decoders.step.read import read

HEADER = (
    "FILE_DESCRIPTION((''),'2;1');\n"
    "FILE_NAME('file','2026-01-01T00:00:00',(''),(''),'writer 1.0','system 2.0','');\n"
    "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 3 1 1 }'));\n"
)

EMPTY = "''"
Vector = tuple[float, float, float]


def wrap(data: str, header: str = HEADER) -> bytes:
    """A file with this data section; text beyond Latin-1 is not allowed."""
    text = f"ISO-10303-21;\nHEADER;\n{header}ENDSEC;\nDATA;\n{data}\nENDSEC;\nEND-ISO-10303-21;\n"
    return text.encode("latin-1")


def find_entities(data: str) -> Entities:
    """The entities of a data section."""
    return Entities(wrap(data), FileLimits())


class Writer:
    """Writes entities one after another, and numbers them.

    Each method returns the reference to the entity that it writes, such as `#12`.
    """

    def __init__(self) -> None:
        self.lines: list[str] = []

    def __call__(self, record: str) -> str:
        self.lines.append(f"#{len(self.lines) + 1}={record};")
        return f"#{len(self.lines)}"

    @property
    def data(self) -> str:
        return "\n".join(self.lines)

    def point(self, *coordinates: float) -> str:
        return self(f"CARTESIAN_POINT('',({','.join(map(str, coordinates))}))")

    def direction(self, *ratios: float) -> str:
        return self(f"DIRECTION('',({','.join(map(str, ratios))}))")

    def vector(self, *components: float, magnitude: float = 1.0) -> str:
        return self(f"VECTOR('',{self.direction(*components)},{magnitude})")

    def frame(
        self, origin: Vector = (0, 0, 0), z: Vector = (0, 0, 1), x: Vector = (1, 0, 0)
    ) -> str:
        axes = f"{self.direction(*z)},{self.direction(*x)}"
        return self(f"AXIS2_PLACEMENT_3D('',{self.point(*origin)},{axes})")

    def vertex(self, *coordinates: float) -> str:
        return self(f"VERTEX_POINT('',{self.point(*coordinates)})")

    def line(self, origin: Vector, direction: Vector, magnitude: float = 1.0) -> str:
        vector = self.vector(*direction, magnitude=magnitude)
        return self(f"LINE('',{self.point(*origin)},{vector})")

    def circle(self, radius: float, origin: Vector = (0, 0, 0), z: Vector = (0, 0, 1)) -> str:
        return self(f"CIRCLE('',{self.frame(origin, z)},{radius})")

    def edge(self, first: str, last: str, curve: str, same_sense: str = ".T.") -> str:
        return self(f"EDGE_CURVE('',{first},{last},{curve},{same_sense})")

    def loop(self, *edges: str) -> str:
        """A loop of edges; one that begins with a minus sign is used backwards."""
        oriented = [
            self(f"ORIENTED_EDGE('',*,*,{edge.lstrip('-')},{'.F.' if edge[0] == '-' else '.T.'})")
            for edge in edges
        ]
        return self(f"EDGE_LOOP('',({','.join(oriented)}))")

    def bound(self, loop: str, orientation: str = ".T.") -> str:
        return self(f"FACE_BOUND('',{loop},{orientation})")

    def face(
        self, surface: str, *bounds: str, same_sense: str = ".T.", name: str = "", kind: str = ""
    ) -> str:
        keyword = kind or "ADVANCED_FACE"
        return self(f"{keyword}('{name}',({','.join(bounds)}),{surface},{same_sense})")

    def polygon(self, *points: Vector) -> tuple[str, list[str]]:
        """A loop of lines through points, and its edges."""
        vertices = [self.vertex(*point) for point in points]
        edges = []
        corners = list(zip(vertices, points, strict=True))
        for (start, a), (end, b) in pairwise([*corners, corners[0]]):
            direction = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
            edges.append(self.edge(start, end, self.line(a, direction)))
        return self.loop(*edges), edges

    def square(self, *, same_sense: str = ".T.", name: str = "") -> str:
        """The face of the unit square in the plane z = 0."""
        loop, _ = self.polygon((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
        plane = self(f"PLANE('',{self.frame()})")
        orientation = same_sense
        return self.face(plane, self.bound(loop, orientation), same_sense=same_sense, name=name)

    def tetrahedron(self, size: float = 1.0, name: str = "solid") -> str:
        """A FACETED_BREP with a corner at the origin."""
        corners = [(0, 0, 0), (size, 0, 0), (0, size, 0), (0, 0, size)]
        points = [self.point(*corner) for corner in corners]
        faces = []
        for a, b, c in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)):
            loop = self(f"POLY_LOOP('',({points[a]},{points[b]},{points[c]}))")
            faces.append(self(f"FACE('',({self.bound(loop)}))"))
        shell = self(f"CLOSED_SHELL('',({','.join(faces)}))")
        return self(f"FACETED_BREP('{name}',{shell})")

    def shell(self, *faces: str, closed: bool = False) -> str:
        return self(f"{'CLOSED' if closed else 'OPEN'}_SHELL('',({','.join(faces)}))")

    def unit(self, prefix: str = ".MILLI.") -> str:
        return self(f"(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({prefix},.METRE.))")

    def context(self, *units: str, uncertainty: str = "") -> str:
        """A context with these units; radians are added."""
        radians = self("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
        assigned = f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({','.join([radians, *units])}))"
        more = f"GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({uncertainty}))" if uncertainty else ""
        return self(
            f"(GEOMETRIC_REPRESENTATION_CONTEXT(3){more}{assigned}REPRESENTATION_CONTEXT('',''))"
        )

    def representation(self, items: Sequence[str], context: str = "", name: str = "") -> str:
        where = context or self.context(self.unit())
        return self(f"SHAPE_REPRESENTATION('{name}',({','.join(items)}),{where})")

    def product(self, name: str, *representations: str) -> str:
        """A product with representations; returns its definition."""
        product = self(f"PRODUCT('id of {name}','{name}','',())")
        formation = self(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
        definition = self(f"PRODUCT_DEFINITION('design','',{formation},$)")
        shape = self(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
        for representation in representations:
            self(f"SHAPE_DEFINITION_REPRESENTATION({shape},{representation})")
        return definition

    def occurrence(
        self,
        parent: tuple[str, str],
        child: tuple[str, str],
        placements: tuple[str, str] = ("", ""),
        name: str = "",
    ) -> str:
        """A product in another one, each with its representation; returns what styles refer to."""
        found = self(f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('1','{name}','',{parent[0]},{child[0]},$)")
        if not placements[0]:
            return found
        moved = self(f"ITEM_DEFINED_TRANSFORMATION('','',{placements[0]},{placements[1]})")
        relationship = self(
            f"(REPRESENTATION_RELATIONSHIP('','',{child[1]},{parent[1]})"
            f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({moved})"
            "SHAPE_REPRESENTATION_RELATIONSHIP())"
        )
        shape = self(f"PRODUCT_DEFINITION_SHAPE('','',{found})")
        return self(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({relationship},{shape})")

    def style(self, item: str, color: str, kind: str = "STYLED_ITEM", more: str = "") -> str:
        """A colour of a surface, such as `COLOUR_RGB('',1.,0.,0.)`, for an item."""
        colour = self(f"FILL_AREA_STYLE_COLOUR('',{self(color)})")
        area = self(f"SURFACE_STYLE_FILL_AREA({self(f'FILL_AREA_STYLE({EMPTY},({colour}))')})")
        side = self(f"SURFACE_SIDE_STYLE('',({area}))")
        usage = self(f"SURFACE_STYLE_USAGE(.BOTH.,{side})")
        style = self(f"PRESENTATION_STYLE_ASSIGNMENT(({usage}))")
        return self(f"{kind}('',({style}),{item}{more})")

    def read(self, *items: str) -> CadContent:
        """Read the file; with items in a representation of one product named `part`."""
        if items:
            self.product("part", self.representation(items))
        return read(wrap(self.data), FileLimits())


def read_part(writer: Writer, item: str) -> Part:
    """The only part of a file with this item."""
    content = writer.read(item)
    parts = [part for definition in content.definitions for part in definition.parts]
    assert not content.reading.skipped_faces, content.reading.skipped_faces
    (part,) = parts
    return part


def read_face(writer: Writer, face: str) -> Face:
    """The face of a file whose only item is a face."""
    (face_,) = read_part(writer, face).faces
    return face_
