"""What a format is: a name, a media type, a suffix, what it can hold, and a function to bytes."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Literal, TypeAlias

from service.encoders.pieces import Content
from service.engine.mesh.mesh import Mesh, Overlay
from service.engine.scenes.scene import Scene, flattened
from service.surface.batches import ChannelKind
from service.surface.lowered import PatchModel

OoglForm: TypeAlias = Literal["cquad", "mesh", "off", "bez"]
Compression: TypeAlias = Literal["none", "meshopt"]


@dataclass(frozen=True, slots=True)
class EncodeOptions:
    """Choices that concern the written form alone, not the mesh."""

    oogl: OoglForm | None = None
    """OOGL form; None takes `cquad` where the mesh is made of grids, else `off`."""

    quantize: bool = False
    """Whether the mesh is put on a grid before it is written (`service.engine.grid`), and all its
    numbers in fewer bits: in formats that are `compact`."""

    compression: Compression = "none"
    """How the arrays of a format that is `compact` are compressed."""

    @property
    def exact(self) -> bool:
        """Whether the patches themselves are wanted, in a format that can hold them."""
        return self.oogl == "bez"


COMPACT = frozenset({"quantize", "compression"})
"""Options that a format refuses unless it reads them."""


@dataclass(frozen=True, slots=True)
class MeshSize:
    """Counts known from the shapes alone: enough to predict how many bytes a format will need.

    `vertices` counts the samples of every patch by itself: welding only makes them fewer.
    `named` counts what carries a name, parts and overlays; `name_bytes` are the UTF-8 bytes of all
    names together, the mesh's own included. `control_points` counts those of all lowered patches.
    `colors` is the number of numbers of a colour, 0 without any; `attributes` has the name and the
    number of numbers of each attribute.
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
    """What every format has: `suffix` without a dot.

    `single` formats store float32 positions about a local origin, the others float64.
    """

    name: str
    title: str
    media_type: str
    suffix: str
    single: bool


@dataclass(frozen=True, slots=True)
class Format(FileFormat):
    """One way of writing a mesh.

    `quads`, `overlays`: whether the format can hold them. `encode` gives the file's bytes;
    `byte_bound` an upper bound of their number, before anything is computed. A format that can hold
    Bézier patches as they are has `encode_exact`; one that has nodes has `encode_scene`, and the
    others get groups flattened to one mesh. `carries` are the kinds of channels that it can hold;
    others are left out. A `single` format that has no place for an origin is not `local`: its
    positions are rounded in model coordinates. `fixed` means that faces take so many bytes each and
    nothing else takes any, so that the bound is exact where their number is. A format that writes
    fewer digits than positions have has `coarseness`: how far from its place it may put a vertex.
    `reads` names the fields of `EncodeOptions` that concern the format; where others are given, the
    `COMPACT` ones are refused and the rest ignored.
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
        """Names of the options that change nothing here, whatever they say."""
        unread = frozenset(field.name for field in fields(EncodeOptions)) - self.reads - COMPACT
        return unread if "uvs" in self.carries else unread | {"uvs"}

    @property
    def compact(self) -> bool:
        """Whether it can hold whole numbers, and compressed ones."""
        return self.reads >= COMPACT

    def write_scene(self, scene: Scene, options: EncodeOptions) -> Content:
        """The file of a scene: of one mesh where the format has no nodes."""
        if self.encode_scene is None:
            return self.encode(flattened(scene), options)
        return self.encode_scene(scene, options)
