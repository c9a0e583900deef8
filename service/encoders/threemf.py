"""3MF: a ZIP archive with one XML document of meshes, for 3D printing.

Lengths are millimetres, and z is the vertical axis: the model is turned and scaled by the transform
of its build item. Each mesh is an object; a scene is an object whose components are the copies of
meshes. A copy in another colour, and a mirrored one, have an object of their own: the format has no
colours of copies, and readers disagree about transforms that mirror. Meshes that are not closed are
of the type `surface`. Colours of parts and copies are base materials, those of vertices a colour
group. The archive is the same for the same mesh: its times are fixed.

References
----------
3MF Consortium, 3MF Core Specification 1.3: 3.3 (transforms), 4.1 (meshes), 4.2 (components), 5.1
(base materials); 3MF Materials and Properties Extension 1.2: color groups. ECMA-376, part 2.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from io import BytesIO
from xml.sax.saxutils import quoteattr
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np

from service.bases.arrays import Bytes, FloatArray, IndexArray, Ints, RealArray
from service.bases.row_batches import unique_rows
from service.cancellation import checkpoint
from service.encoders.content import add_opacity, bound_comment, refuse_quads, to_bytes
from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.text import FLOAT32_CHARS, digits, row_chunks, rows
from service.encoders.units import MILLIMETRE
from service.engine.mesh.mesh import Mesh
from service.engine.scenes.colors import tint
from service.engine.scenes.placing import reverse_faces
from service.engine.scenes.scene import Scene
from service.surface.lowered import Color, PlacedModel
from service.surface.placement import is_identity, is_mirroring, turn_upright

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
MATERIALS = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"

MODEL_PATH = "3D/3dmodel.model"

CONTENT_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" '
    'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n'
)

RELATIONSHIPS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    f'<Relationship Target="/{MODEL_PATH}" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>\n'
)

EARLIEST = (1980, 1, 1, 0, 0, 0)
"""The time of all files in the archive, the earliest that ZIP can store."""

LEVEL = 6
"""The level of compression."""

FILE_BYTES, DRAWABLE_BYTES = 4_000, 1_200
"""Bytes of a file, and of an object or a component, without vertices, triangles and names."""

LONGEST_ESCAPE = 6
"""The most characters of a byte of a name: a quotation mark is `&quot;`."""

WHITE: Color = (1.0, 1.0, 1.0, 1.0)
"""The colour of triangles without one, if others of the object have one."""

MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])
"""The reflection that is baked into the objects of mirrored copies."""


def encode(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The file of a mesh; raises `UnsupportedByFormat` if it has quads."""
    node = PlacedModel(mesh.name, 0)
    writer = _Writer()
    number = writer.add_object(_Form(mesh, None, is_mirrored=False), mesh.name)
    whole = _upright(mesh.up, mesh.report.metres_per_unit) @ _place(mesh, node)
    comment = bound_comment(mesh.report)
    return _pack(_write_model(mesh.name, comment, writer.chunks, number, whole))


def encode_scene(scene: Scene, _options: EncodeOptions) -> bytes:
    """The file of a scene; raises `UnsupportedByFormat` if a mesh has quads."""
    writer = _Writer()
    numbers: dict[tuple[int, Color | None, bool], int] = {}
    uses: dict[int, int] = {}
    for node in scene.nodes:
        uses[node.model] = uses.get(node.model, 0) + 1
    components = []
    for node in scene.nodes:
        mesh = scene.meshes[node.model]
        if not len(mesh.triangles) and not len(mesh.quads):
            continue
        is_mirrored = is_mirroring(node.matrix)
        key = node.model, node.color, is_mirrored
        if key not in numbers:
            name = node.name if uses[node.model] == 1 else mesh.name
            numbers[key] = writer.add_object(_Form(mesh, node.color, is_mirrored), name)
        matrix = _place(mesh, node)
        components.append((numbers[key], matrix @ MIRROR if is_mirrored else matrix))
    root = writer.add_components(scene.name, components)
    whole = _upright(scene.up, scene.report.metres_per_unit)
    comment = bound_comment(scene.report)
    return _pack(_write_model(scene.name, comment, writer.chunks, root, whole))


def byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """The most bytes of the file; compression makes no file longer than the text by 1/1000."""
    index = digits(size.vertices)
    vertex = len('<vertex x="" y="" z=""/>\n') + 3 * FLOAT32_CHARS
    color = len('<m:color color="#RRGGBBAA"/>\n') if size.colors else 0
    corners = len('<triangle v1="" v2="" v3="" pid="" p1="" p2="" p3=""/>\n') + 6 * index + 9
    text = (
        size.vertices * (vertex + color)
        + (size.triangles + 2 * size.quads) * corners
        + (size.drawables + 1) * DRAWABLE_BYTES
        + LONGEST_ESCAPE * size.name_bytes
        + FILE_BYTES
    )
    return text + text // 1000


def _place(mesh: Mesh, node: PlacedModel) -> FloatArray:
    """The placement (4, 4) of the stored positions of a copy, which are relative to an origin."""
    origin = np.eye(4)
    origin[:3, 3] = mesh.origin
    return origin if node.matrix is None else node.matrix @ origin


def _upright(up: str, metres_per_unit: float | None) -> FloatArray:
    """The placement (4, 4) of a model in the file: z upwards, in millimetres."""
    turn = turn_upright(None, "y", "z") if up == "y" else None
    matrix = np.eye(4) if turn is None else turn.copy()
    scale = 1.0 if metres_per_unit is None else metres_per_unit / MILLIMETRE
    matrix[:3] *= round(scale, 12)
    return matrix


@dataclass(frozen=True, eq=False, slots=True)
class _Form:
    """The form in which a mesh becomes an object: the colour of its copies, and mirrored or not."""

    mesh: Mesh
    color: Color | None
    is_mirrored: bool

    def triangles(self) -> tuple[RealArray, Ints, Ints]:
        """The distinct positions, and the triangles without those that have a corner twice.

        Returns
        -------
        positions : ndarray, shape (W, 3)
            Relative to the origin of the mesh.
        triangles : ndarray of int, shape (T, 3)
            Rows of the positions.
        kept : ndarray of int, shape (T,)
            The rows of the triangles in the mesh.
        """
        mesh = self.mesh
        positions, faces = mesh.positions, mesh.triangles.astype(np.intp)
        if mesh.welds is not None:
            leaders, number = np.unique(mesh.welds, return_inverse=True)
            positions, faces = positions[leaders], number[faces]
        a, b, c = faces.T
        kept = np.flatnonzero((a != b) & (b != c) & (c != a))
        faces = faces[kept]
        if self.is_mirrored:
            positions = positions * np.array([1, 1, -1], positions.dtype)
            faces = faces[:, [0, 2, 1]]
        return positions, faces, kept


class _Writer:
    """Writes the resources of a model: materials and objects, which share their numbers."""

    def __init__(self) -> None:
        self.chunks: list[bytes] = []
        self._count = 0

    def add_object(self, form: _Form, name: str) -> int:
        """Add the object of a mesh; returns its number."""
        refuse_quads(form.mesh, "3MF")
        positions, faces, kept = form.triangles()
        corners = form.mesh.triangles[kept]
        if form.is_mirrored:
            corners = reverse_faces(corners)
        group, columns = self._add_colors(form, kept, corners)
        number = self._next()
        kind = "model" if form.mesh.report.watertight else "surface"
        default = f' pid="{group}" pindex="0"' if group else ""
        head = f'<object id="{number}" type="{kind}" name={quoteattr(name)}{default}>\n<mesh>\n'
        self.chunks.append(head.encode() + b"<vertices>\n")
        self.chunks += _write_rows(positions, b"vertex", ("x", "y", "z"))
        self.chunks.append(b"</vertices>\n<triangles>\n")
        names: tuple[str, ...] = ("v1", "v2", "v3")
        values = faces
        if columns is not None:
            pids = np.full((len(faces), 1), group)
            values = np.concatenate([faces, pids, columns], axis=1)
            names += ("pid", "p1", "p2", "p3")[: 1 + columns.shape[1]]
        self.chunks += _write_rows(values, b"triangle", names)
        self.chunks.append(b"</triangles>\n</mesh>\n</object>\n")
        return number

    def add_components(self, name: str, components: Iterable[tuple[int, FloatArray]]) -> int:
        """Add an object of placed objects; returns its number."""
        number = self._next()
        lines = [f'<object id="{number}" type="model" name={quoteattr(name)}>\n<components>\n']
        lines += [
            f'<component objectid="{k}"{_write_transform(matrix)}/>\n' for k, matrix in components
        ]
        self.chunks.append("".join([*lines, "</components>\n</object>\n"]).encode())
        return number

    def _next(self) -> int:
        self._count += 1
        return self._count

    def _add_colors(self, form: _Form, kept: Ints, corners: IndexArray) -> tuple[int, Ints | None]:
        """Add the colours of an object.

        Returns the number of their group, 0 without colours; and for each triangle the number of
        its colour, (T, 1), or of each of its corners, (T, 3).
        """
        mesh = form.mesh
        if mesh.colors is not None:
            colors = mesh.colors
            if form.color is not None:
                colors = tint(colors, np.array(form.color), len(colors))
            first, number = unique_rows(to_bytes(add_opacity(colors)).astype(np.float64))
            palette = to_bytes(add_opacity(colors[first]))
            group = self._next()
            lines = "".join(f'<m:color color="{_write_color(c)}"/>\n' for c in palette)
            text = f'<m:colorgroup id="{group}">\n{lines}</m:colorgroup>\n'
            self.chunks.append(text.encode())
            return group, number[corners.astype(np.intp)]
        parts = [part for part in mesh.parts if part.triangles[0] < part.triangles[1]]
        chosen = [part.color or form.color for part in parts]
        if not any(chosen):
            return 0, None
        numbers: dict[Color, int] = {}
        of_part = [numbers.setdefault(color or WHITE, len(numbers)) for color in chosen]
        counts = [part.triangles[1] - part.triangles[0] for part in parts]
        group = self._next()
        lines = "".join(
            f'<base name="color {k + 1}" '
            f'displaycolor="{_write_color(to_bytes(np.array(color)))}"/>\n'
            for color, k in numbers.items()
        )
        self.chunks.append(f'<basematerials id="{group}">\n{lines}</basematerials>\n'.encode())
        if len(numbers) == 1:
            return group, None
        return group, np.repeat(of_part, counts)[kept][:, np.newaxis]


def _write_color(color: Bytes) -> str:
    """A colour in sRGB with its opacity, #RRGGBBAA."""
    return f"#{color.tobytes().hex().upper()}"


def _write_transform(matrix: FloatArray) -> str:
    """The attribute of a placement: the columns of the matrix, without its last row."""
    if is_identity(matrix):
        return ""
    numbers = (matrix[:3].T + 0.0).ravel().tolist()
    return f' transform="{" ".join(map(repr, numbers))}"'


def _write_rows(values: RealArray | Ints, tag: bytes, names: Iterable[str]) -> Iterator[bytes]:
    """An element for each row of an array (N, K), with K attributes."""
    first, *others = names
    marks = bytes(range(1, len(others) + 1))
    begin = b"<" + tag + b" " + first.encode() + b'="'
    for chunk in row_chunks(values):
        checkpoint()
        # `rows` writes separators of one character; each stands for the name of an attribute.
        text = rows(values[chunk], begin, marks)
        for mark, name in zip(marks, others, strict=True):
            text = text.replace(bytes([mark]), f'" {name}="'.encode())
        yield text.replace(b"\n", b'"/>\n')


def _write_model(
    name: str, comment: str, resources: Iterable[bytes], root: int, matrix: FloatArray
) -> Iterator[bytes]:
    """The XML document in chunks; `root` is the object to print."""
    about = f'<metadata name="Description">{comment}</metadata>\n' if comment else ""
    title = quoteattr(name)[1:-1]
    yield (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<model unit="millimeter" xml:lang="en-US" xmlns="{CORE}" xmlns:m="{MATERIALS}">\n'
        f'<metadata name="Title">{title}</metadata>\n{about}<resources>\n'
    ).encode()
    yield from resources
    item = f'<item objectid="{root}"{_write_transform(matrix)}/>'
    yield f"</resources>\n<build>\n{item}\n</build>\n</model>\n".encode()


def _pack(model: Iterable[bytes]) -> bytes:
    """The archive with a model."""
    content = BytesIO()
    with ZipFile(content, "w", ZIP_DEFLATED, compresslevel=LEVEL) as archive:
        parts = (
            ("[Content_Types].xml", [CONTENT_TYPES.encode()]),
            ("_rels/.rels", [RELATIONSHIPS.encode()]),
        )
        for path, chunks in (*parts, (MODEL_PATH, model)):
            about = ZipInfo(path, EARLIEST)
            about.compress_type = ZIP_DEFLATED
            about.create_system = 0
            with archive.open(about, "w") as file:
                for chunk in chunks:
                    checkpoint()
                    file.write(chunk)
    return content.getvalue()
