"""Channels of a surface: colours, texture coordinates and named attributes.

A channel is a polynomial function of the surface's parameters with a control net of its own,

    C(u, v) = Σ_ij B_i^a(u) B_j^b(v) C_ij,

and a degree of its own (degree 0 is a constant). On a rational surface channels are polynomial,
too: the weights apply to the points alone.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import TypeAlias

from service.bases.arrays import FloatArray
from service.bases.triangle import degree_or_none
from service.errors import InvalidRequest, Issue, count_nouns, pointer
from service.surface.batches import Channel, ChannelKind
from service.surface.channel_values import check_colors, check_names, validate_values
from service.surface.checks import MAX_DEGREE
from service.surface.lowered import PatchModel

MAX_DIMENSION = 16
"""Most numbers in one value of an attribute."""

MAX_NUMBERS = 1 << 23
"""Most numbers in the nets of one channel after the surface is lowered to patches (64 MiB)."""

Attributes: TypeAlias = tuple[tuple[str, FloatArray], ...]


@dataclass(frozen=True, eq=False, slots=True)
class Channels:
    """Control nets of the channels of a surface.

    The last axis of a net has the numbers of one value. Which axes are before it depends on the
    kind of surface: rows and columns; the points of a triangle, row after row; or the vertices.

    Attributes
    ----------
    colors : ndarray of float64, shape (…, 3) or (…, 4), or None
        sRGB, or sRGB and alpha, from 0 to 1.
    uvs : ndarray of float64, shape (…, 2), or None
        Texture coordinates.
    attributes : tuple of (name, ndarray of float64, shape (…, d))
        Other functions of the parameters, sorted by name. Two names must differ in more than case.

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the surface.
    """

    colors: FloatArray | None = None
    uvs: FloatArray | None = None
    attributes: Attributes = ()

    def __post_init__(self) -> None:
        if self.colors is not None:
            colors = validate_values(
                self.colors, ("colors",), 3, 4, "three or four numbers [r, g, b, a]"
            )
            check_colors(colors)
            object.__setattr__(self, "colors", colors)
        if self.uvs is not None:
            uvs = validate_values(self.uvs, ("uvs",), 2, 2, "two numbers [u, v]")
            object.__setattr__(self, "uvs", uvs)
        check_names([name for name, _ in self.attributes])
        needed = f"1 to {MAX_DIMENSION} numbers"
        attributes = tuple(
            (name, validate_values(net, ("attributes", name), 1, MAX_DIMENSION, needed))
            # Sorted, because JSON objects have no order: equal channels must be equal arrays.
            for name, net in sorted(self.attributes, key=itemgetter(0))
        )
        object.__setattr__(self, "attributes", attributes)

    def each(self) -> Iterator[tuple[str, ChannelKind, str, FloatArray]]:
        """Name, kind, pointer and net of each channel."""
        if self.colors is not None:
            yield "colors", "colors", "/colors", self.colors
        if self.uvs is not None:
            yield "uvs", "uvs", "/uvs", self.uvs
        for name, net in self.attributes:
            yield name, "attribute", pointer(("attributes", name)), net

    def check_spans(
        self,
        counts: tuple[int, ...] = (),
        degree: tuple[int, int] = (0, 0),
        spans: tuple[int, int] = (1, 1),
    ) -> None:
        """Refuse channels that the service cannot lower to the Bézier patches of a surface.

        These are nets that are not grids, that have too high a degree, or that would have too many
        numbers after lowering. By default, the surface is one Bézier patch.

        Parameters
        ----------
        counts : (int, int)
            Rows and columns of the control net. A channel whose net has the same counts is a
            B-spline with the surface's degree and knots; any other net is one Bézier net.
        degree : (int, int)
            Degree of the surface.
        spans : (int, int)
            Number of spans along u and v.
        """
        patches = spans[0] * spans[1]
        for _, _, where, net in self.each():
            if net.ndim != 3:
                raise InvalidRequest(_wrong_axes(where, net, "rows of values"))
            if net.shape[:2] == counts:
                size = (degree[0] + 1) * (degree[1] + 1) * net.shape[2]
                _check_numbers(where, patches * size)
                continue
            _check_degree(where, net)
            # The nets of all patches, and the matrices that restrict the net to each span.
            operators = (n * points**2 for n, points in zip(spans, net.shape[:2], strict=True))
            _check_numbers(where, max(patches * net.size, *operators))

    def check_triangles(self) -> None:
        """Refuse nets that do not have the shape of a triangle, or whose degree is too high."""
        for _, _, where, net in self.each():
            if net.ndim != 2:
                raise InvalidRequest(_wrong_axes(where, net, "one run of the values of all rows"))
            degree = degree_or_none(len(net))
            if degree is None or degree > MAX_DEGREE:
                raise InvalidRequest(
                    Issue(
                        "channel_shape",
                        "A function of degree n over a triangle has n + 1 rows of n + 1, n, … 1 "
                        "values.",
                        where,
                        count_nouns(len(net), "values"),
                        f"1, 3, 6, 10, … values, degrees up to {MAX_DEGREE}",
                    )
                )

    def check_per_vertex(self, vertices: int, indices: int) -> None:
        """Refuse nets without exactly one value for each vertex, and nets that become too large.

        `indices` is the number of vertex indices in all patches, each of which gets a value.
        """
        for _, _, where, net in self.each():
            if net.ndim != 2:
                raise InvalidRequest(_wrong_axes(where, net, "one value a vertex"))
            if len(net) != vertices:
                raise InvalidRequest(
                    Issue(
                        "channel_shape",
                        "There must be exactly one value for every vertex.",
                        where,
                        count_nouns(len(net), "values"),
                        count_nouns(vertices, "values"),
                    )
                )
            _check_numbers(where, indices * net.shape[-1])

    def lower(self, lower_net: Callable[[FloatArray], FloatArray]) -> tuple[Channel, ...]:
        """The channels of a batch of patches.

        `lower_net` converts the net of a channel of the surface to the nets of its P patches, shape
        (P, a+1, b+1, d), or (P, (a+1)(a+2)/2, d) for triangles.
        """
        return tuple(Channel(name, kind, lower_net(net)) for name, kind, _, net in self.each())


def keep_channels(model: PatchModel, is_kept: Callable[[Channel], bool]) -> PatchModel:
    """The model with only those channels for which `is_kept` is true."""
    if all(is_kept(channel) for batch in model.batches for channel in batch.channels):
        return model
    batches = (replace(b, channels=tuple(filter(is_kept, b.channels))) for b in model.batches)
    return replace(model, batches=tuple(batches))


def _check_degree(where: str, net: FloatArray) -> None:
    if max(net.shape[:2]) - 1 > MAX_DEGREE:
        raise InvalidRequest(
            Issue(
                "degree_too_high",
                "A net of r × c values is one function of degree r − 1 by c − 1.",
                where,
                f"degree {net.shape[0] - 1} × {net.shape[1] - 1}",
                f"degrees up to {MAX_DEGREE}",
            )
        )


def _check_numbers(where: str, count: int) -> None:
    if count > MAX_NUMBERS:
        raise InvalidRequest(
            Issue(
                "too_many_values",
                "The channel has too many numbers in all patches together.",
                where,
                count_nouns(count, "numbers"),
                f"at most {MAX_NUMBERS}",
            )
        )


def _wrong_axes(where: str, net: FloatArray, needed: str) -> Issue:
    return Issue(
        "channel_shape",
        "The net of a channel must have the axes that this kind of surface needs.",
        where,
        f"lists {net.ndim} deep",
        needed,
    )


NO_CHANNELS = Channels()
