"""How many vertices and faces a mesh will have: exactly, or at most."""

from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, replace

import numpy as np

from service.encoders.format import EncodeOptions, MeshSize
from service.engine.adaptive.accuracy import Accuracy
from service.engine.adaptive.aims import box, goal_of, stated
from service.engine.adaptive.beforehand import Most, most_of
from service.engine.count import Counts, count
from service.engine.curvatures.care import surely_affordable
from service.engine.gridded import grid_error
from service.engine.models import highest_degree
from service.engine.options import MeshOptions
from service.errors import InvalidRequest
from service.pipeline.certified import most_triangles
from service.pipeline.limits import Limits
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sweep_model import SweepModel

LEAST_FACE, LEAST_COMPRESSED = 6, 1
"""Bytes that no format writes a triangle in fewer of: three indices of 16 bits, or a code."""

SURE = 2.0**-16
"""A tolerance above this part of the largest coordinate is above whatever is rounded."""

GRID_SHARE = 4
"""A tolerance is above what putting vertices on a grid leaves if it is so many times that."""


@dataclass(frozen=True, slots=True)
class Foreseen:
    """What is known of the size of a mesh.

    Attributes
    ----------
    once, copies : Counts
        Of every different model once, and of every copy.
    exact : bool
        Whether these are the very numbers; else upper bounds.
    certain : bool
        Whether a mesh of this size is within the limits, whatever comes out.
    rows : bool
        Whether the vertices are counted as they are stored, and take the place of a prediction.
    pieces : int
        Segments of the boundary, beyond those that were predicted.
    """

    once: Counts
    copies: Counts
    exact: bool
    certain: bool = True
    rows: bool = False
    pieces: int = 0

    def within(self, size: MeshSize, *, shared: bool) -> MeshSize:
        """A prediction, with what is known better."""
        known = self.once if shared else self.copies
        return replace(
            size,
            vertices=known.vertices if self.rows else size.vertices,
            triangles=known.triangles if self.rows or self.exact else size.triangles,
            quads=known.quads if self.rows or self.exact else size.quads,
            overlay_points=size.overlay_points + self.pieces,
            overlay_segments=size.overlay_segments + self.pieces,
        )


def foreseen(
    model: Model, options: MeshOptions, size: MeshSize, limits: Limits, encode: EncodeOptions
) -> Foreseen:
    """What will come of a model, where its size was predicted to be this at most.

    Exact at a resolution, but for what is swept along curves and for wires with faces, since how
    often these bend is seen only when they are made, and for what is too large to be made anyway.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small`, as the mesh itself.
    """
    models = model.models if isinstance(model, GroupModel) else (model,)
    patches = [own for own in models if isinstance(own, PatchModel)]
    most = Counts(size.vertices, size.triangles, size.quads)
    if len(patches) < len(models) or options.solid_wires:
        return Foreseen(most, most, exact=False)
    if options.accuracy is not None and not isinstance(model, SweepModel):
        return _by_tolerance(model, options, options.accuracy, limits, encode)
    if size.vertices > limits.max_vertices:
        return Foreseen(most, most, exact=False)
    found = [count(own, options) if options.surface else Counts(0, 0, 0) for own in patches]
    certain = not options.curvatures or all(surely_affordable(p, size.vertices) for p in patches)
    return Foreseen(_added(found), _added(_copies(model, found)), exact=True, certain=certain)


def _by_tolerance(
    model: PatchModel | GroupModel,
    options: MeshOptions,
    accuracy: Accuracy,
    limits: Limits,
    encode: EncodeOptions,
) -> Foreseen:
    """Upper bounds of a mesh by tolerance; none is answered that is larger than is allowed."""
    moved = grid_error(model, options) if encode.quantize else 0.0
    try:
        once, copies = most_of(model, accuracy, moved)
    except InvalidRequest as error:
        issues = (replace(issue, pointer=stated(accuracy)) for issue in error.issues)
        raise InvalidRequest(*issues) from None
    pieces = copies.pieces if "boundary" in options.overlays else 0
    if not options.surface:
        nothing = Counts(0, 0, 0)
        return Foreseen(nothing, nothing, exact=True, rows=True, pieces=pieces)
    allowed = min(most_triangles(limits), accuracy.max_triangles or most_triangles(limits))
    if accuracy.max_bytes is not None:
        least = LEAST_FACE if encode.compression == "none" else LEAST_COMPRESSED
        allowed = min(allowed, accuracy.max_bytes // least)
    # What a budget or an angle leads to has no other bound.
    bounded = not accuracy.budgeted and accuracy.angle_tolerance is None
    certain = (
        bounded
        and copies.triangles <= allowed
        and copies.vertices + pieces <= limits.max_vertices
        and copies.triangles * _effort(model) <= limits.max_multiplications
        and _clear_of_rounding(model, accuracy, moved)
    )
    if options.curvatures:
        models = model.models if isinstance(model, GroupModel) else (model,)
        own = [each for each in models if isinstance(each, PatchModel)]
        certain = certain and all(surely_affordable(each, copies.vertices) for each in own)

    def clipped(most: Most) -> Counts:
        triangles = min(most.triangles, allowed) if bounded else allowed
        # A face of T triangles has T + 2 vertices at most.
        vertices = min(limits.max_vertices, triangles + 2 * model.patch_count)
        return Counts(min(vertices, most.vertices) if bounded else vertices, triangles, 0)

    return Foreseen(clipped(once), clipped(copies), False, certain, rows=True, pieces=pieces)


def _effort(model: PatchModel | GroupModel) -> int:
    """Multiplications that a triangle may take, of nets of this degree: cut, judged, certified."""
    degree = highest_degree(model)
    return 16 * (degree + 1) ** 2 * (2 * degree)


def _clear_of_rounding(model: PatchModel | GroupModel, accuracy: Accuracy, moved: float) -> bool:
    """Whether no format rounds so much that the tolerance could be too small."""
    goal = goal_of(accuracy, model)
    least = (
        goal.tolerance
        if goal.view is None
        else min(goal.tolerance, goal.view.rate * goal.view.near)
    )
    return least >= SURE * float(np.abs(box(model)).max()) + GRID_SHARE * moved


def _copies(model: Model, found: Sequence[Counts]) -> Sequence[Counts]:
    """Counts of every copy, from those of every model."""
    if not isinstance(model, GroupModel):
        return found
    return [found[member.model] for member in model.members]


def _added(counts: Iterable[Counts]) -> Counts:
    """Counts of several meshes together."""
    vertices, triangles, quads = zip(*map(astuple, counts), strict=True)
    return Counts(sum(vertices), sum(triangles), sum(quads))
