"""Helpers of the conversions: nets along an axis, surfaces of one patch, limits of size, sharing.

A surface of patches is made from control nets: equal control points become one vertex.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, Ints
from service.bases.polynomials import Net, map_net
from service.bases.row_batches import find_first_rows
from service.errors import InvalidRequest, Issue, TooLarge, count_nouns
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.channels import MAX_NUMBERS, NO_CHANNELS, Channels
from service.surface.checks import MAX_DEGREE, Up
from service.surface.grids import NO_GRIDS, PartMembers
from service.surface.patches import NO_TRIANGLES, PatchSurface
from service.surface.sizes import NetSurface

NetChange: TypeAlias = Callable[[Net], Net]


@dataclass(frozen=True, slots=True)
class SizeLimits:
    """The most control points, and the highest degree, after every operation of a conversion."""

    control_points: int = 1_000_000
    degree: int = MAX_DEGREE


def apply_along(net: Net, axis: int, change: NetChange) -> Net:
    """Apply a function of nets, which works along the first axis, along another axis of a net."""
    return move_axis(change(move_axis(net, 0, axis)), axis, 0)


def move_axis(net: Net, target: int, axis: int) -> Net:
    """The net with its axis `axis` moved to the position `target`."""
    return map_net(net, lambda values: np.moveaxis(values, axis, target))


def add_batch_axis(net: Net) -> Net:
    """The net as a batch of one net."""
    return map_net(net, lambda values: values[np.newaxis])


def map_channels(channels: Channels, change: Callable[[FloatArray], FloatArray]) -> Channels:
    """The channels after `change` was applied to the net of each."""
    return Channels(
        None if channels.colors is None else change(channels.colors),
        None if channels.uvs is None else change(channels.uvs),
        tuple((name, change(net)) for name, net in channels.attributes),
    )


def require_patch(surface: BezierSurface | PatchSurface) -> BezierSurface:
    """A surface of one patch as a Bézier surface.

    Raises
    ------
    InvalidRequest
        `several_patches`.
    """
    if isinstance(surface, BezierSurface):
        return surface
    if len(surface.patches) != 1 or len(surface.triangles):
        grid_count, triangle_count = len(surface.patches), len(surface.triangles)
        raise InvalidRequest(
            Issue(
                "several_patches",
                "The patches of this surface have no parameters in common.",
                "",
                f"{count_nouns(grid_count, 'four-sided patches')} and "
                f"{count_nouns(triangle_count, 'triangles')}",
                "a surface of one four-sided patch, or a B-spline; or `patch` for one of several",
            )
        )
    (points, weights), channels = Batch.of_patches(surface, surface.patches[0])
    return BezierSurface(points, weights, surface.up, surface.name, channels)


def require_triangle(surface: TriangleSurface | PatchSurface) -> TriangleSurface:
    """A surface of one triangle, and of nothing else, as a triangle surface.

    The caller checks that a surface of patches is of this form (`split_patches`).
    """
    if isinstance(surface, TriangleSurface):
        return surface
    (points, weights), channels = Batch.of_patches(surface, surface.triangles[0])
    return TriangleSurface(points, weights, surface.up, surface.name, channels)


def check_count(count: int, allowed: SizeLimits, channel_numbers: int = 0) -> None:
    """Refuse too many control points.

    `channel_numbers` is the number of numbers that all channels have at each control point.
    """
    # The 4 are x, y, z and the weight.
    max_count = min(allowed.control_points, MAX_NUMBERS // (4 + channel_numbers))
    if count > max_count:
        raise TooLarge(
            Issue(
                "too_many_control_points",
                "The surface would have more control points, or more values at them, than this "
                "service takes.",
                "",
                count_nouns(count, "control points"),
                f"at most {max_count}",
            )
        )


def check_degree(degree: int, allowed: SizeLimits, where: str = "") -> None:
    """Refuse a degree above the limit."""
    if degree > allowed.degree:
        raise InvalidRequest(
            Issue(
                "degree_too_high",
                "The degree of the surface would be too high to be useful.",
                where,
                f"degree {degree}",
                f"degrees up to {allowed.degree}",
            )
        )


class Batch(NamedTuple):
    """The nets of P patches of one degree, and the nets of their channels in the same degree.

    `net` has points of shape (P, p+1, q+1, 3) for grids, or (P, (n+1)(n+2)/2, 3) for triangles.
    Its weights, or None, have the same shape without the last axis. The nets of channels differ
    from the points only in the last axis.

    A batch may begin as one patch, without the axis of patches and with channels of other degrees,
    if a function that adds the axis and elevates the nets is then applied to it.
    """

    net: Net
    channels: Channels = NO_CHANNELS

    @staticmethod
    def of_patches(surface: PatchSurface, indices: NDArray[np.int64]) -> "Batch":
        """The nets of some patches of a surface: of grids of one degree, or of triangles.

        `indices` are the vertex indices of these patches, with the patches along axis 0.
        """
        net = map_net((surface.vertices, surface.weights), lambda values: values[indices])
        return Batch(net, map_channels(surface.channels, lambda values: values[indices]))

    @staticmethod
    def of_net(surface: NetSurface) -> "Batch":
        """The net of a surface, without the axis of patches."""
        return Batch((surface.control_net, surface.weights), surface.channels)

    @property
    def nets(self) -> list[FloatArray]:
        """The points, and the nets of the channels."""
        return [self.net[0], *(net for *_, net in self.channels.each())]

    @property
    def channel_numbers(self) -> int:
        """How many numbers all channels together have at one control point."""
        return sum(net.shape[-1] for net in self.nets[1:])

    @staticmethod
    def join(batches: Sequence["Batch"], numbers: Sequence[Ints]) -> "Batch":
        """Join batches of one degree.

        `numbers` has, for each batch, the numbers of its patches in the joined batch.
        """
        if len(batches) == 1:
            return batches[0]
        order = np.argsort(np.concatenate(numbers))

        def join(arrays: Iterable[FloatArray]) -> FloatArray:
            return np.concatenate(list(arrays))[order]

        first_batch = batches[0]
        # Every batch has the same channels, in the same order.
        nets_of_batches = [iter([net for *_, net in batch.channels.each()]) for batch in batches]
        channels = map_channels(
            first_batch.channels, lambda _: join(next(nets) for nets in nets_of_batches)
        )
        weights = None
        if first_batch.net[1] is not None:
            weights = join(batch.net[1] for batch in batches if batch.net[1] is not None)
        return Batch((join(batch.net[0] for batch in batches), weights), channels)

    def apply(self, change: NetChange) -> "Batch":
        """The batch after `change` was applied to its nets and to the nets of its channels."""
        return Batch(
            change(self.net), map_channels(self.channels, lambda values: change((values, None))[0])
        )

    @property
    def columns(self) -> list[FloatArray]:
        """Positions, channels and weights, each as an array of one row for each control point."""
        points, weights = self.net
        values = self.nets if weights is None else [*self.nets, weights]
        return [value.reshape(points.size // 3, -1) for value in values]


def share_vertices(
    grids: Batch | None,
    triangles: Batch | None = None,
    parts: PartMembers = (),
    up: Up = "y",
    name: str = "surface",
) -> PatchSurface:
    """A surface of patches in which equal control points are one vertex.

    Control points are equal if their position, weight and channels are equal. Vertices are numbered
    in the order in which they first occur, vertices of grids before vertices of triangles.
    """
    batches = [batch for batch in (grids, triangles) if batch is not None]
    columns = [np.concatenate(arrays) for arrays in zip(*(b.columns for b in batches), strict=True)]
    # Adding 0 turns −0 into 0.
    first, indices = find_first_rows(np.concatenate(columns, axis=1) + 0.0)
    # Positions, channels and weights of the vertices: `next` takes them in the order of
    # `Batch.columns`.
    vertex_columns = iter([column[first] for column in columns])
    # `indices` has first the control points of the grids, then those of the triangles.
    grid_count = 0 if grids is None else grids.net[0].size // 3
    return PatchSurface(
        vertices=next(vertex_columns),
        channels=map_channels(batches[0].channels, lambda _: next(vertex_columns)),
        weights=None if batches[0].net[1] is None else next(vertex_columns)[:, 0],
        patches=(
            NO_GRIDS if grids is None else indices[:grid_count].reshape(grids.net[0].shape[:-1])
        ),
        triangles=(
            NO_TRIANGLES
            if triangles is None
            else indices[grid_count:].reshape(triangles.net[0].shape[:-1])
        ),
        parts=parts,
        up=up,
        name=name,
    )
