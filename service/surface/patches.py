"""Many Bézier patches of one degree over shared vertices, as the files of the teapot are."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray
from service.errors import MAX_ISSUES, InvalidRequest, Issue, pointer
from service.surface.channels import NO_CHANNELS, Channels
from service.surface.checks import check_grid, check_up, checked_points, checked_weights
from service.surface.lowered import Part, PatchModel, TensorPatches, Up

PartMembers: TypeAlias = tuple[tuple[str, tuple[int, ...]], ...]
"""Names of parts, each with the numbers of its patches."""


@dataclass(frozen=True, eq=False, slots=True)
class PatchSurface:
    """P patches of degree (p, q), each a grid of indices into one list of vertices.

    Attributes
    ----------
    vertices : ndarray of float64, shape (V, 3)
        Control points that the patches share. Model units.
    patches : ndarray of int64, shape (P, p+1, q+1)
        Rows of `vertices`, from 0; axis 1 runs along u, axis 2 along v.
    weights : ndarray of float64, shape (V,), or None
        One positive weight a vertex.
    parts : tuple of (name, patch numbers)
        Named groups of patches. A patch belongs to at most one; those in none form a last part
        of the surface's own name.
    up : "y" or "z"
        The model's vertical axis.
    name : str
        Name of the model.
    channels : Channels
        Colours, texture coordinates and attributes: one value a vertex, in the patches' degree.

    Raises
    ------
    InvalidRequest
        At birth, with pointers relative to the surface.
    """

    vertices: FloatArray
    patches: NDArray[np.int64]
    weights: FloatArray | None = None
    parts: PartMembers = ()
    up: Up = "y"
    name: str = "surface"
    channels: Channels = NO_CHANNELS

    def __post_init__(self) -> None:
        vertices = checked_points(self.vertices, "vertices", axes=2)
        patches = np.array(self.patches, dtype=np.int64, order="C")
        if patches.ndim != 3 or len(patches) == 0:
            raise InvalidRequest(
                Issue(
                    "too_few_points",
                    "There must be at least one patch, each a grid of vertex indices.",
                    "/patches",
                    f"indices of shape {patches.shape}",
                    "patches × rows × columns",
                )
            )
        check_grid(patches.shape[1], patches.shape[2], "patches")
        _check_indices(patches, len(vertices))
        patches.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "patches", patches)
        if self.weights is not None:
            object.__setattr__(self, "weights", checked_weights(self.weights, (len(vertices),)))
        self.channels.check_per_vertex(len(vertices), patches.size)
        _check_parts(self.parts, len(patches))
        check_up(self.up)

    @property
    def degree(self) -> tuple[int, int]:
        """Degree (p, q) of every patch."""
        return self.patches.shape[1] - 1, self.patches.shape[2] - 1

    def lower(self) -> PatchModel:
        """The patches as one batch, ordered part by part."""
        order, parts = _ordered(self.parts, len(self.patches), self.name)
        indices = self.patches if order is None else self.patches[order]
        weights = None if self.weights is None else self.weights[indices]
        channels = self.channels.lower(lambda values: values[indices])
        batch = TensorPatches(self.vertices[indices], weights, channels)
        return PatchModel(self.name, (batch,), parts, self.up, order=order)


def _ordered(
    parts: PartMembers, count: int, name: str
) -> tuple[NDArray[np.intp] | None, tuple[Part, ...]]:
    """Order of the patches that makes each part a run, and the runs."""
    if not parts:
        return None, (Part(name, 0, count),)
    named = [np.array(members, dtype=np.intp) for _, members in parts]
    rest = np.setdiff1d(np.arange(count), np.concatenate(named))
    groups = [*zip((title for title, _ in parts), named, strict=True), (name, rest)]
    runs: list[Part] = []
    first = 0
    for title, members in groups:
        if len(members):
            runs.append(Part(title, first, first + len(members)))
            first += len(members)
    return np.concatenate([*named, rest]), tuple(runs)


def _check_indices(patches: NDArray[np.int64], count: int) -> None:
    """Refuses indices that name no vertex; -1 is an error here, not the last one."""
    if patches.min() >= 0 and patches.max() < count:
        return
    places = np.argwhere((patches < 0) | (patches >= count))[:MAX_ISSUES]
    raise InvalidRequest(
        *(
            Issue(
                "index_out_of_range",
                "Patches index the list of vertices from 0.",
                "/patches" + pointer(place),
                str(patches[tuple(place)]),
                f"0 to {count - 1}",
            )
            for place in places.tolist()
        )
    )


def _check_parts(parts: PartMembers, count: int) -> None:
    """Refuses parts that name a patch that is not there, or one patch twice."""
    issues: list[Issue] = []
    owner: set[int] = set()
    for title, members in parts:
        for position, member in enumerate(members):
            where = pointer(("parts", title, position))
            if not 0 <= member < count:
                issues.append(
                    Issue(
                        "index_out_of_range",
                        "Parts list patches by number from 0.",
                        where,
                        str(member),
                        f"0 to {count - 1}",
                    )
                )
            elif member in owner:
                issues.append(
                    Issue(
                        "repeated_patch",
                        "A patch belongs to at most one part.",
                        where,
                        f"patch {member} once more",
                        "each patch once",
                    )
                )
            owner.add(member)
            if len(issues) == MAX_ISSUES:
                raise InvalidRequest(*issues)
    if issues:
        raise InvalidRequest(*issues)
