"""Many Bézier patches over shared vertices, grids as the files of the teapot are, and triangles."""

from dataclasses import dataclass, field, replace
from itertools import chain
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases import triangle
from service.bases.arrays import FloatArray
from service.errors import MAX_ISSUES, InvalidRequest, Issue, pointer
from service.surface.batches import Channel, Patches, TensorPatches, TrianglePatches
from service.surface.channels import NO_CHANNELS, Channels
from service.surface.checks import (
    Up,
    check_grid,
    check_triangle,
    check_up,
    checked_points,
    checked_weights,
)
from service.surface.lowered import Part, PatchModel
from service.surface.sizes import NUMBER, SurfaceKind, SurfaceSize, tensor_size

PartMembers: TypeAlias = tuple[tuple[str, tuple[int, ...]], ...]
"""Names of parts, each with the numbers of its patches."""

NO_GRIDS: NDArray[np.int64] = np.empty((0, 2, 2), dtype=np.int64)
NO_TRIANGLES: NDArray[np.int64] = np.empty((0, 3), dtype=np.int64)


@dataclass(frozen=True, eq=False, slots=True)
class PatchSurface(SurfaceKind):
    """Patches that are indices into one list of vertices: grids, triangles, or both.

    All grids have one degree (p, q), all triangles one degree n. Patches that name the same
    vertices along a side meet there, whatever their kind.

    Attributes
    ----------
    vertices : ndarray of float64, shape (V, 3)
        Control points that the patches share. Model units.
    patches : ndarray of int64, shape (P, p+1, q+1)
        Rows of `vertices`, from 0; axis 1 runs along u, axis 2 along v. P may be 0.
    weights : ndarray of float64, shape (V,), or None
        One positive weight a vertex.
    parts : tuple of (name, patch numbers)
        Named groups of patches, numbered grids first, triangles after them. A patch belongs to at
        most one group; those in none form a last part of the surface's own name. They are kept in
        the order of the first patch that each lists, in whichever they are given.
    up : "y" or "z"
        The model's vertical axis.
    name : str
        Name of the model.
    channels : Channels
        Colours, texture coordinates and attributes: one value a vertex, in the patches' degree.
    triangles : ndarray of int64, shape (T, (n+1)(n+2)/2)
        Rows of `vertices` in the order of `service.bases.triangle`. T may be 0.

    Raises
    ------
    InvalidRequest
        At birth, with pointers relative to the surface.
    """

    vertices: FloatArray
    patches: NDArray[np.int64] = field(default_factory=lambda: NO_GRIDS)
    weights: FloatArray | None = None
    parts: PartMembers = ()
    up: Up = "y"
    name: str = "surface"
    channels: Channels = NO_CHANNELS
    triangles: NDArray[np.int64] = field(default_factory=lambda: NO_TRIANGLES)
    _name_bytes: int = field(init=False, repr=False)

    def __post_init__(self) -> None:
        vertices = checked_points(self.vertices, "vertices", axes=2)
        patches = np.array(self.patches, dtype=np.int64, order="C")
        triangles = np.array(self.triangles, dtype=np.int64, order="C")
        _check_shapes(patches, triangles)
        _check_indices(patches, len(vertices), "patches")
        _check_indices(triangles, len(vertices), "triangles")
        patches.flags.writeable = triangles.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "patches", patches)
        object.__setattr__(self, "triangles", triangles)
        if self.weights is not None:
            object.__setattr__(self, "weights", checked_weights(self.weights, (len(vertices),)))
        self.channels.check_per_vertex(len(vertices), patches.size + triangles.size)
        _check_parts(self.parts, len(patches) + len(triangles))
        object.__setattr__(self, "parts", tuple(sorted(self.parts, key=_first_patch)))
        names = sum(len(name.encode()) for name, _ in self.parts)
        object.__setattr__(self, "_name_bytes", names)
        check_up(self.up)

    @property
    def degree(self) -> tuple[int, int]:
        """Degree (p, q) of every grid."""
        return self.patches.shape[1] - 1, self.patches.shape[2] - 1

    @property
    def triangle_degree(self) -> int:
        """Degree of every triangle."""
        return triangle.degree_of(self.triangles.shape[1])

    def size(self) -> SurfaceSize:
        """The grids and the triangles, their points taken from the list of vertices."""
        grids, triangles, n = len(self.patches), len(self.triangles), self.triangle_degree
        weights, channels, name = self.weights, self.channels, self.name
        size = tensor_size(grids, self.degree, weights, channels, name=name)
        own = self.vertices.nbytes + (0 if weights is None else weights.nbytes)
        rows = self.patches.size + self.triangles.size
        numbers = 3 + (weights is not None) + size.width
        kept = (rows * numbers + 2 * size.grids + 2 * triangles) * NUMBER
        # Indices in the order of the parts, and how that order is found.
        beside = (rows + 8 * (grids + triangles)) * NUMBER
        return replace(
            size,
            degree=(max(self.degree[0], n), max(self.degree[1], n)),
            triangles=triangles,
            control_points=self.patches.size + 2 * self.triangles.size,
            net_points=rows,
            net_segments=2 * self.patches.size + 3 * self.triangles.size,
            net_cells=rows,
            parts=len(self.parts) + 1,
            name_bytes=size.name_bytes + self._name_bytes,
            own=own + NUMBER * rows + sum(net.nbytes for *_, net in channels.each()),
            arrays=kept,
            peak=kept + beside,
            sides=size.sides + triangles * (numbers - size.width) * NUMBER * 4 * (n + 1),
        )

    def lower(self) -> PatchModel:
        """A batch of the grids and one of the triangles, each ordered part by part."""
        grids = len(self.patches)
        listed, parts = _ordered(self.parts, grids + len(self.triangles), self.name)
        order = listed
        if listed is not None and grids and len(self.triangles):
            # Grids come first, whichever part has them: one batch of each kind, however many parts.
            order = listed[np.argsort(listed >= grids, kind="stable")]
        batches: list[Patches] = []
        if grids:
            chosen = self.patches if order is None else self.patches[order[:grids]]
            batches.append(TensorPatches(*self._gathered(chosen)))
        if len(self.triangles):
            chosen = self.triangles if order is None else self.triangles[order[grids:] - grids]
            batches.append(TrianglePatches(*self._gathered(chosen)))
        sequence = None
        if len(batches) == 2 and order is not None:
            sequence = np.argsort(order)[listed]
        return PatchModel(
            self.name,
            tuple(batches),
            parts,
            self.up,
            order=order,
            sequence=sequence,
        )

    def _gathered(
        self, indices: NDArray[np.int64]
    ) -> tuple[FloatArray, FloatArray | None, tuple[Channel, ...]]:
        """Points, weights and channels of some patches."""
        weights = None if self.weights is None else self.weights[indices]
        channels: tuple[Channel, ...] = ()
        if self.channels is not NO_CHANNELS:
            channels = self.channels.lower(lambda values: values[indices])
        return self.vertices.take(indices, axis=0), weights, channels


def _first_patch(part: tuple[str, tuple[int, ...]]) -> tuple[tuple[int, ...], str]:
    """By what parts are sorted: the objects of JSON have no order."""
    name, members = part
    return members[:1], name


def _ordered(
    parts: PartMembers, count: int, name: str
) -> tuple[NDArray[np.intp] | None, tuple[Part, ...]]:
    """Order of the patches that makes each part a run, None without parts; and the runs."""
    if not parts:
        return None, (Part(name, 0, count),)
    order = np.fromiter(chain.from_iterable(members for _, members in parts), np.intp)
    if len(order) < count:
        is_left = np.ones(count, bool)
        is_left[order] = False
        order = np.concatenate([order, is_left.nonzero()[0]])
    runs: list[Part] = []
    first = 0
    for title, members in parts:
        if members:
            runs.append(Part(title, first, first + len(members)))
            first += len(members)
    if first < count:
        runs.append(Part(name, first, count))
    return order, tuple(runs)


def _check_shapes(patches: NDArray[np.int64], triangles: NDArray[np.int64]) -> None:
    """Refuses what are no grids of one degree and no triangles of one degree, or none at all."""
    if patches.ndim != 3:
        raise InvalidRequest(
            Issue(
                "too_few_points",
                "Every patch is a grid of vertex indices.",
                "/patches",
                f"indices of shape {patches.shape}",
                "patches × rows × columns",
            )
        )
    if triangles.ndim != 2:
        raise InvalidRequest(
            Issue(
                "too_few_points",
                "Every triangle is one row after another of vertex indices.",
                "/triangles",
                f"indices of shape {triangles.shape}",
                "triangles × indices",
            )
        )
    if not len(patches) + len(triangles):
        raise InvalidRequest(
            Issue(
                "too_few_points",
                "There must be at least one patch, in `patches` or in `triangles`.",
                "/patches",
                "no patch",
                "grids of vertex indices, triangles of them, or both",
            )
        )
    check_grid(patches.shape[1], patches.shape[2], "patches")
    check_triangle(triangles.shape[1], "triangles")


def _check_indices(patches: NDArray[np.int64], count: int, name: str) -> None:
    """Refuses indices that name no vertex; -1 is an error here, not the last one."""
    # As numbers without a sign those below zero are the largest.
    if not patches.size or np.maximum.reduce(patches.view(np.uint64), axis=None) < count:
        return
    places = np.argwhere((patches < 0) | (patches >= count))[:MAX_ISSUES]
    raise InvalidRequest(
        *(
            Issue(
                "index_out_of_range",
                "Patches index the list of vertices from 0.",
                f"/{name}" + pointer(place),
                str(patches[tuple(place)]),
                f"0 to {count - 1}",
            )
            for place in places.tolist()
        )
    )


def _check_parts(parts: PartMembers, count: int) -> None:
    """Refuses parts that name a patch that is not there, or one patch twice."""
    named = [member for _, members in parts for member in members]
    if not named or (min(named) >= 0 and max(named) < count and len(set(named)) == len(named)):
        return
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
