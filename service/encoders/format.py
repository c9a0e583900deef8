"""File formats: their names, their encoders, what they can store; and the content of a file."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields
from typing import Literal, TypeAlias

from service.engine.mesh.mesh import Mesh, Overlay
from service.engine.scenes.flattening import flatten
from service.engine.scenes.scene import Scene
from service.surface.batches import ChannelKind
from service.surface.lowered import PatchModel


@dataclass(frozen=True, eq=False, slots=True)
class SplitContent:
    """The bytes of a file in several buffers, in order; `bytes(content)` joins them."""

    buffers: tuple[bytes | memoryview, ...]

    def __len__(self) -> int:
        return sum(map(len, self.buffers))

    def __iter__(self) -> Iterator[bytes | memoryview]:
        return iter(self.buffers)

    def __bytes__(self) -> bytes:
        return b"".join(self.buffers)

    def join_short(self, max_bytes: int) -> Iterator[bytes | memoryview]:
        """Join neighbouring short buffers to at most `max_bytes` bytes each; keep long buffers."""
        short_buffers: list[bytes | memoryview] = []
        bytes_left = max_bytes
        for buffer in self.buffers:
            if len(buffer) > bytes_left and short_buffers:
                yield b"".join(short_buffers)
                short_buffers, bytes_left = [], max_bytes
            if len(buffer) > max_bytes:
                yield buffer
            else:
                short_buffers.append(buffer)
                bytes_left -= len(buffer)
        if short_buffers:
            yield b"".join(short_buffers)


Content: TypeAlias = bytes | SplitContent
"""The bytes of a file, in one buffer or in several."""

MAX_JOINED_BYTES = 1 << 16
"""Files of at most this number of bytes are returned as one buffer."""


def pack(buffers: tuple[bytes | memoryview, ...]) -> Content:
    """The bytes of a file in these buffers, joined if the file is short."""
    content = SplitContent(buffers)
    return bytes(content) if len(content) <= MAX_JOINED_BYTES else content


OoglForm: TypeAlias = Literal["cquad", "mesh", "off", "bez"]
Compression: TypeAlias = Literal["none", "meshopt"]
StlForm: TypeAlias = Literal["binary", "ascii"]


@dataclass(frozen=True, slots=True)
class EncodeOptions:
    """Options that change only the file, not the mesh.

    Attributes
    ----------
    oogl : str or None
        Form of an OOGL file; None means `cquad` for a mesh made of grids, else `off`.
    quantize : bool
        Whether positions are quantized (`service.engine.stored_positions`), and all numbers stored
        in fewer bits. Only for formats that are `compact`.
    compression : str
        Compression of the arrays. Only for formats that are `compact`.
    stl : str
        Form of an STL file.
    """

    oogl: OoglForm | None = None
    quantize: bool = False
    compression: Compression = "none"
    stl: StlForm = "binary"

    @property
    def exact(self) -> bool:
        """Whether the file shall have the Bézier patches themselves in place of a mesh."""
        return self.oogl == "bez"


COMPACT_OPTIONS = frozenset({"quantize", "compression"})
"""Names of the options that a format refuses if it does not support them."""


@dataclass(frozen=True, slots=True)
class MeshSize:
    """Counts of a mesh, known from shapes alone, that bound the bytes of its file.

    Attributes
    ----------
    vertices, triangles, quads : int
        `vertices` counts the samples of each patch separately; welding only reduces them.
    patches, control_points : int
        Number of lowered patches, and of their control points.
    drawables, name_bytes : int
        Number of parts and overlays; UTF-8 bytes of all names, including the name of the mesh.
    overlay_points, overlay_segments, overlay_cells : int
        Number of points, segments and cells (quads of control nets) of all overlays.
    colors : int
        Number of components of a colour; 0 without colours.
    attributes : tuple of (name, int)
        The name of each attribute, and its number of components.
    faces : int
        Number of faces of breps. Each is a part of the mesh, but not a drawable: a drawable has all
        faces of one colour.
    placed_faces, defined_faces, face_name_bytes : int
        Number of these faces if each copy counts, and if equal surfaces count once; and the bytes
        of the names of all placed faces.
    listed_patches : int
        Number of patches that the report lists, because they were turned or have no orientation.
    """

    vertices: int
    triangles: int
    quads: int
    patches: int
    control_points: int
    drawables: int
    name_bytes: int
    overlay_points: int = 0
    overlay_segments: int = 0
    overlay_cells: int = 0
    colors: int = 0
    attributes: tuple[tuple[str, int], ...] = ()
    faces: int = 0
    placed_faces: int = 0
    defined_faces: int = 0
    face_name_bytes: int = 0
    listed_patches: int = 0


@dataclass(frozen=True, eq=False, slots=True)
class FileFormat:
    """The properties that formats of meshes and of lines have.

    Attributes
    ----------
    name, title, media_type : str
    suffix : str
        Without a dot.
    is_float32 : bool
        Whether the format stores float32, usually relative to a local origin; others store float64.
    other_suffixes : tuple of str
        Further suffixes that files of this format have.
    """

    name: str
    title: str
    media_type: str
    suffix: str
    is_float32: bool
    other_suffixes: tuple[str, ...] = field(default=(), kw_only=True)


@dataclass(frozen=True, eq=False, slots=True)
class Format(FileFormat):
    """A format of meshes.

    Attributes
    ----------
    has_quads, has_overlays : bool
        Whether the format can store quads, and overlays (lines).
    encode : callable
        Encodes a mesh as the bytes of a file.
    byte_bound : callable
        Returns an upper bound of the number of these bytes, before the mesh is computed.
    encode_exact : callable or None
        Encodes Bézier patches and overlays; None if the format cannot store patches.
    carries : frozenset of str
        The kinds of channels that the format can store; other channels are omitted.
    encode_scene : callable or None
        Encodes a scene; None if the format has no nodes. Groups are then flattened to one mesh.
    has_local_origin : bool
        Whether positions of a float32 format are relative to a local origin. If not, they are
        rounded in model coordinates.
    has_exact_bound : bool
        Whether `byte_bound` returns the exact number of bytes if the number of faces is exact: the
        file is a head of fixed size, and a fixed number of bytes for each face.
    repeats_meshes : bool
        Whether the file of a scene has a mesh again for each colour of its copies.
    coarseness : callable or None
        For formats that write fewer digits than positions have: returns a bound of the distance by
        which the format moves a vertex.
    reads : frozenset of str
        The fields of `EncodeOptions` that the format uses. The format refuses unused fields that
        are in `COMPACT_OPTIONS`, and ignores the other unused fields.
    """

    has_quads: bool
    has_overlays: bool
    encode: Callable[[Mesh, EncodeOptions], Content]
    byte_bound: Callable[[MeshSize, EncodeOptions], int]
    encode_exact: Callable[[PatchModel, tuple[Overlay, ...]], bytes] | None = None
    carries: frozenset[ChannelKind] = frozenset()
    encode_scene: Callable[[Scene, EncodeOptions], bytes] | None = None
    has_local_origin: bool = True
    has_exact_bound: bool = False
    repeats_meshes: bool = False
    coarseness: Callable[[Mesh, EncodeOptions], float] | None = None
    reads: frozenset[str] = frozenset()

    @property
    def ignored(self) -> frozenset[str]:
        """Names of the options that have no effect on files of this format."""
        unread = (
            frozenset(field.name for field in fields(EncodeOptions)) - self.reads - COMPACT_OPTIONS
        )
        # `uvs` is an option of the mesh, and not a field of `EncodeOptions`. A format that cannot
        # store uvs ignores this option.
        return unread if "uvs" in self.carries else unread | {"uvs"}

    @property
    def compact(self) -> bool:
        """Whether the format can store quantized positions and compressed arrays."""
        return self.reads >= COMPACT_OPTIONS

    def write_scene(self, scene: Scene, options: EncodeOptions) -> Content:
        """Encode a scene as a file; in a format without nodes, as one flattened mesh."""
        if self.encode_scene is None:
            return self.encode(flatten(scene), options)
        return self.encode_scene(scene, options)
