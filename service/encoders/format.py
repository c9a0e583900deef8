"""The type of a format: name, media type, suffix, abilities, and a function from mesh to bytes."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Literal, TypeAlias

from service.encoders.pieces import Content
from service.engine.mesh.mesh_value import Mesh, Overlay
from service.engine.scenes.scene import Scene, flatten
from service.surface.batches import ChannelKind
from service.surface.lowered import PatchModel

OoglForm: TypeAlias = Literal["cquad", "mesh", "off", "bez"]
Compression: TypeAlias = Literal["none", "meshopt"]


@dataclass(frozen=True, slots=True)
class EncodeOptions:
    """Options that change only the file, not the mesh."""

    oogl: OoglForm | None = None
    """OOGL form; None means `cquad` for a mesh made of grids, else `off`."""

    quantize: bool = False
    """Whether positions are quantized (`service.engine.grid`) and all numbers stored in fewer bits,
    in formats that are `compact`."""

    compression: Compression = "none"
    """Compression of the arrays, in formats that are `compact`."""

    @property
    def exact(self) -> bool:
        """Whether the file shall contain the Bézier patches themselves."""
        return self.oogl == "bez"


COMPACT = frozenset({"quantize", "compression"})
"""Options that a format refuses unless it supports them."""


@dataclass(frozen=True, slots=True)
class MeshSize:
    """Counts from shapes alone, which determine an upper bound of the bytes of a file.

    `vertices` counts the samples of each patch separately: welding only reduces them. `named`
    counts parts and overlays; `name_bytes` are the UTF-8 bytes of all names together, including
    that of the mesh. `control_points` counts the control points of all lowered patches. `colors` is
    the number of components of a colour, or 0; `attributes` has the name and number of components
    of each attribute.
    """

    vertices: int
    triangles: int
    quads: int
    patches: int
    control_points: int
    named: int
    name_bytes: int
    overlay_points: int = 0
    overlay_segments: int = 0
    overlay_cells: int = 0
    colors: int = 0
    attributes: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True, slots=True)
class FileFormat:
    """The properties of every format; `suffix` is without a dot.

    `single` formats store float32 positions relative to a local origin, others float64.
    """

    name: str
    title: str
    media_type: str
    suffix: str
    single: bool


@dataclass(frozen=True, slots=True)
class Format(FileFormat):
    """A format of meshes.

    `quads`, `overlays`: whether the format can store them. `encode` gives the file's bytes;
    `byte_bound` an upper bound of their number, before anything is computed. A format that can
    store Bézier patches has `encode_exact`; one with nodes has `encode_scene`, and the others get
    groups flattened to one mesh. `carries` are the kinds of channels that it can store; other
    channels are omitted. A `single` format without a local origin is not `local`: its positions are
    rounded in model coordinates. `fixed` means that only faces take bytes, the same number each, so
    that the bound is exact if the number of faces is. A format that writes fewer digits than
    positions have needs `coarseness`: a bound of the distance by which it moves a vertex. `reads`
    names the fields of `EncodeOptions` that the format uses; it refuses the other `COMPACT`
    options, and ignores all others.
    """

    quads: bool
    overlays: bool
    encode: Callable[[Mesh, EncodeOptions], Content]
    byte_bound: Callable[[MeshSize, EncodeOptions], int]
    encode_exact: Callable[[PatchModel, tuple[Overlay, ...]], bytes] | None = None
    carries: frozenset[ChannelKind] = frozenset()
    encode_scene: Callable[[Scene, EncodeOptions], bytes] | None = None
    local: bool = True
    fixed: bool = False
    coarseness: Callable[[Mesh, EncodeOptions], float] | None = None
    reads: frozenset[str] = frozenset()

    @property
    def ignored(self) -> frozenset[str]:
        """Names of the options without effect on this format."""
        unread = frozenset(field.name for field in fields(EncodeOptions)) - self.reads - COMPACT
        return unread if "uvs" in self.carries else unread | {"uvs"}

    @property
    def compact(self) -> bool:
        """Whether the format can store quantized positions and compressed arrays."""
        return self.reads >= COMPACT

    def write_scene(self, scene: Scene, options: EncodeOptions) -> Content:
        """The file of a scene; formats without nodes get one flattened mesh."""
        if self.encode_scene is None:
            return self.encode(flatten(scene), options)
        return self.encode_scene(scene, options)
