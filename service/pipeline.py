"""Surface and options in, bytes out: the product as a list of steps.

HTTP, the command line and whatever else comes call these functions and nothing below them.
"""

from dataclasses import dataclass
from typing import Protocol

from service.encoders.format import EncodeOptions, Format, MeshSize
from service.encoders.oogl_patches import encode_patches
from service.engine.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.tessellate import overlays_of, predicted_size, tessellate
from service.errors import Issue, TooLarge, UnsupportedByFormat
from service.surface.lowered import PatchModel


class Surface(Protocol):
    """Whatever lowers to Bézier patches."""

    def lower(self) -> PatchModel:
        """The surface as batches of Bézier patches."""
        ...


@dataclass(frozen=True, slots=True)
class Limits:
    """The largest result that is computed: vertices, and bytes of one answer."""

    max_vertices: int = 4_500_000
    max_bytes: int = 256 << 20


PLAIN = EncodeOptions()
DEFAULT_LIMITS = Limits()


def render(
    surface: Surface,
    options: MeshOptions,
    fmt: Format,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
) -> bytes:
    """The surface as a file of this format.

    Raises
    ------
    TooLarge, UnsupportedByFormat
        Before anything is computed.
    """
    model = surface.lower()
    check(model, options, fmt, encode, limits)
    if fmt.name == "oogl" and encode.oogl == "bez":
        return encode_patches(model, overlays_of(model, options))
    return fmt.encode(mesh(model, options, fmt), encode)


def mesh(model: PatchModel, options: MeshOptions, fmt: Format) -> Mesh:
    """The mesh of a model in the precision that the format stores."""
    return tessellate(model, options, single=fmt.single)


def predict(surface: Surface, options: MeshOptions) -> MeshSize:
    """Counts of the mesh from the shapes alone; upper bounds where welding will take some away."""
    return predicted_size_of(surface.lower(), options)


def predicted_size_of(model: PatchModel, options: MeshOptions) -> MeshSize:
    """The same for a surface that is lowered already."""
    vertices, triangles, quads = predicted_size(model, options)
    points = segments = cells = 0
    control_points = sum(batch.points.size // 3 for batch in model.batches)
    if "control_net" in options.overlays:
        points += control_points
        # A control point begins at most two segments and one cell.
        segments += 2 * control_points
        cells += control_points
    if "boundary" in options.overlays:
        segments += 4 * model.patch_count * max(options.resolution)
        points += 4 * model.patch_count * (max(options.resolution) + 1)
    names = [model.name, *(part.name for part in model.parts), *options.overlays]
    return MeshSize(
        vertices,
        triangles,
        quads,
        model.patch_count,
        named=len(names) - 1,
        name_bytes=sum(len(name.encode()) for name in names),
        overlay_points=points,
        overlay_segments=segments,
        overlay_cells=cells,
        control_points=control_points,
    )


def check(
    model: PatchModel,
    options: MeshOptions,
    fmt: Format,
    encode: EncodeOptions,
    limits: Limits,
) -> None:
    """Refuses what the format cannot hold and what would be too large, from shapes alone."""
    if options.faces == "quads" and not fmt.quads:
        raise UnsupportedByFormat(
            Issue(
                "unsupported_by_format",
                f"{fmt.title} has only triangles.",
                "/faces",
                "quads",
                "triangles, or another format",
            )
        )
    if options.overlays and not fmt.overlays:
        raise UnsupportedByFormat(
            Issue(
                "unsupported_by_format",
                f"{fmt.title} has no place for lines.",
                "/overlays",
                "overlays",
                "none, or another format",
            )
        )
    size = predicted_size_of(model, options)
    if size.vertices > limits.max_vertices:
        raise TooLarge(
            Issue(
                "too_many_vertices",
                "The mesh would have too many vertices.",
                "/resolution",
                f"{size.vertices} vertices",
                f"at most {limits.max_vertices}",
            )
        )
    least = fmt.byte_bound(size, encode)
    if least > limits.max_bytes:
        raise TooLarge(
            Issue(
                "too_many_bytes",
                f"The answer as {fmt.title} could become too large.",
                "/resolution",
                f"up to {least} bytes",
                f"at most {limits.max_bytes}",
            )
        )
