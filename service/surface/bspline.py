"""A tensor-product B-spline surface, polynomial or rational (NURBS)."""

from dataclasses import dataclass, field, replace

import numpy as np

from service.bases import knots as knot
from service.bases.arrays import FloatArray
from service.bases.extraction import plan_extraction
from service.bases.restriction import restricted
from service.bases.row_batches import chunks
from service.surface.batches import TensorPatches
from service.surface.channels import NO_CHANNELS, Channels
from service.surface.checks import Up, check_up, checked_points, checked_weights
from service.surface.knots import (
    Knots,
    check_bezier_points,
    check_degree,
    checked_knots,
    count_merged,
    knot_vector,
)
from service.surface.lowered import Domain, Part, PatchModel
from service.surface.sizes import NUMBER, SurfaceKind, SurfaceSize, tensor_size

BLOCK_POINTS = 1 << 16
"""Control points that are lowered along v at a time: they stay in the cache."""

BLOCKS = 40 << 20
"""Bytes of the blocks that are worked on while nets are lowered, if these are larger: five of 8 MiB
each (`service.bases.extraction`)."""


@dataclass(frozen=True, eq=False, slots=True)
class BsplineSurface(SurfaceKind):
    """S(u, v) = Σ_ij N_i^p(u) N_j^q(v) P_ij over [U_p, U_{n+1}] × [V_q, V_{m+1}].

    Rational if weights are given. Every span of the knots is a Bézier patch.

    Attributes
    ----------
    control_net : ndarray of float64, shape (n+1, m+1, 3)
        Control points; axis 0 runs along u, axis 1 along v. Model units.
    degree : (int, int)
        (p, q), 1 to 64 each.
    knots : a name or an ndarray of float64 for u, and one for v
        n + p + 2 numbers that never decrease, none more than p + 1 times: at p times there is a
        crease, at p + 1 the surface parts. The first and the last may be left out. Or
        "clamped": it reaches its first and last points; "uniform": it does not; "periodic": it
        closes, C^{p−1}, the control points given once. Spans of named knots have length one, the
        first begins at 0.
    weights : ndarray of float64, shape (n+1, m+1), or None
        Positive weights. Equal ones are the same as none.
    up : "y" or "z"
        The model's vertical axis.
    name : str
        Name of the part and of its glTF node.
    channels : Channels
        Colours, texture coordinates and attributes. A net of the control net's rows and columns is
        a function in the surface's own degree and knots; any other is one Bézier net over the whole
        domain.

    Raises
    ------
    InvalidRequest
        At birth, with pointers relative to the surface.

    References
    ----------
    Piegl and Tiller, The NURBS Book, 2nd ed., sections 3.4 and 4.4.
    """

    control_net: FloatArray
    degree: tuple[int, int] = (3, 3)
    knots: tuple[Knots, Knots] = ("clamped", "clamped")
    weights: FloatArray | None = None
    up: Up = "y"
    name: str = "surface"
    channels: Channels = NO_CHANNELS
    _spans: tuple[int, int] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        points = checked_points(self.control_net, "control_net", axes=3)
        counts = points.shape[:2]
        for k in range(2):
            check_degree(self.degree[k], f"/degree/{k}")
        checked = tuple(
            checked_knots(self.knots[k], counts[k], self.degree[k], f"/knots/{k}", "/control_net")
            for k in range(2)
        )
        object.__setattr__(self, "control_net", points)
        object.__setattr__(self, "knots", checked)
        check_bezier_points(self.knot_vectors, self.degree, "/control_net")
        if self.weights is not None:
            object.__setattr__(self, "weights", checked_weights(self.weights, counts))
        rows, columns = (
            len(knot.spans(u, p)) for u, p in zip(self.knot_vectors, self.degree, strict=True)
        )
        object.__setattr__(self, "_spans", (rows, columns))
        self.channels.check_spans(counts, self.degree, self._spans)
        check_up(self.up)

    @property
    def knot_vectors(self) -> tuple[FloatArray, FloatArray]:
        """The knots as numbers; along a periodic direction those of the wrapped control points."""
        u, v = (
            knot_vector(self.knots[k], self.control_net.shape[k], self.degree[k]) for k in range(2)
        )
        return u, v

    def size(self) -> SurfaceSize:
        """A patch a span of each direction; nets are lowered along u, then along v."""
        (p, q), (rows, columns), channels = self.degree, self._spans, self.channels
        weights, patches = self.weights, rows * columns
        size = tensor_size(patches, (p, q), weights, channels, name=self.name)
        # A net that closes has its first lines once more at its end.
        height, width = self.control_net.shape[0] + p, self.control_net.shape[1] + q
        numbers = 3 + (weights is not None) + size.width
        others = [net for *_, net in channels.each() if not self._own(net)]
        restricting = sum(rows * n.shape[0] ** 2 + columns * n.shape[1] ** 2 for n in others)
        restricting += 3 * patches * sum(net.size for net in others)
        extracting = 4 * (rows * (p + 1) ** 2 + columns * (q + 1) ** 2) * NUMBER
        kept = (size.control_points * numbers + restricting) * NUMBER
        lines = (rows * (p + 1) + height) * width * numbers * NUMBER
        # At least one span of all columns, and of all rows, is worked on at a time.
        block = (p + 1) * (width + columns * (q + 1)) + (q + 1) * height
        working = min(5 * max(kept, lines), BLOCKS + 5 * block * numbers * NUMBER)
        net = height * width
        return replace(
            size,
            net_points=net,
            net_segments=2 * net,
            net_cells=net,
            own=self.control_net.size // 3 * (3 + (weights is not None)) * NUMBER
            + sum(n.nbytes for *_, n in channels.each())
            + (height + width + 2) * NUMBER,
            arrays=kept + 3 * net * NUMBER,
            peak=kept + 3 * net * NUMBER + lines + working + extracting,
        )

    def lower(self) -> PatchModel:
        """One Bézier patch a span, the control points that spans share computed once."""
        (p, q), (knots_u, knots_v) = self.degree, self.knot_vectors
        domain = Domain(knot.breaks(knots_u, p), knot.breaks(knots_v, q))
        weights = None
        # Equal weights cancel.
        if self.weights is not None and self.weights.min() < self.weights.max():
            weights = self.weights
        points, loads = self._nets(self.control_net, weights)
        channels = self.channels.lower(
            lambda net: (
                self._nets(net)[0] if self._own(net) else restricted(net, domain.u, domain.v)
            )
        )
        batch = TensorPatches(points, loads, channels)
        part = Part(self.name, 0, batch.count)
        return PatchModel(
            self.name,
            (batch,),
            (part,),
            self.up,
            (domain,),
            control_nets=(TensorPatches(self._wrapped(self.control_net, 1)[np.newaxis]),),
            merged_knots=sum(
                count_merged(self.knots[k], self.control_net.shape[k], self.degree[k])
                for k in range(2)
            ),
        )

    def _nets(
        self, net: FloatArray, weights: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Bézier nets (P, p+1, q+1, d), and weights, of what the control points or others say."""
        (p, q), (knots_u, knots_v) = self.degree, self.knot_vectors
        net, loads = self._wrapped(net), None if weights is None else self._wrapped(weights)
        along_u = plan_extraction(knots_u, p, net, loads)
        lines, heavy = along_u.points(net, loads)
        # Lines become columns, so that control points along v are rows again.
        lines = lines.swapaxes(0, 1)
        heavy = None if heavy is None else heavy.T
        along_v = plan_extraction(knots_v, q, lines, heavy)
        rows, columns, width = *(len(a.places) for a in (along_u, along_v)), net.shape[-1]
        points = np.empty((rows, columns, p + 1, q + 1, width))
        loads = None if heavy is None else np.empty(points.shape[:-1])
        for block in chunks(rows, (p + 1) * columns * (q + 1), BLOCK_POINTS):
            places = along_u.places[block]
            some = slice(places[0, 0], places[-1, -1] + 1)
            values, weight = along_v.points(
                np.ascontiguousarray(lines[:, some]), None if heavy is None else heavy[:, some]
            )
            # Number of each control point of the patches among these, in rows of one value of v.
            count = values.shape[1]
            index = along_v.places[:, np.newaxis] * count
            index = index + (places - places[0, 0])[:, np.newaxis, :, np.newaxis]
            values.reshape(-1, width).take(index, axis=0, out=points[block], mode="clip")
            if weight is not None and loads is not None:
                weight.reshape(-1).take(index, out=loads[block], mode="clip")
        return (
            points.reshape(-1, p + 1, q + 1, width),
            None if loads is None else loads.reshape(-1, p + 1, q + 1),
        )

    def _own(self, net: FloatArray) -> bool:
        """Whether the net of a channel has the form of the control net."""
        return net.shape[:2] == self.control_net.shape[:2]

    def _wrapped(self, net: FloatArray, lines: int | None = None) -> FloatArray:
        """A net over the control points, continued along periodic directions.

        By as many lines as the degree, or by so many: by one it closes.
        """
        for axis, (knots, degree) in enumerate(zip(self.knots, self.degree, strict=True)):
            if isinstance(knots, str) and knots == "periodic":
                net = knot.wrapped(net, degree if lines is None else lines, axis)
        return net
