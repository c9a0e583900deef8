"""A tensor-product B-spline surface, polynomial or rational (NURBS)."""

from dataclasses import dataclass, field, replace

import numpy as np

from service.bases import knots as knot
from service.bases.arrays import FloatArray
from service.bases.extraction import plan_extraction
from service.bases.polynomials import restrict_to_cells
from service.bases.row_batches import row_slices
from service.surface.batches import TensorPatches
from service.surface.channels import NO_CHANNELS, Channels
from service.surface.checks import Up, check_up, validate_points, validate_weights
from service.surface.knots import (
    Knots,
    build_knot_vector,
    check_bezier_points,
    check_degree,
    count_merged,
    validate_knots,
)
from service.surface.lowered import Domain, Part, PatchModel, SplineNet
from service.surface.sizes import NUMBER, NetSurface, SurfaceSize, tensor_size

BLOCK_POINTS = 1 << 16
"""A net is lowered along v in blocks of at most this number of Bézier points (but at least one span
along u), so that a block stays in the processor's cache."""

MAX_BLOCK_MEMORY = 40 << 20
"""Temporary memory of lowering, in bytes, for nets that need several blocks: five arrays of 8 MiB,
the size of a block of `BLOCK_POINTS` points that have 16 numbers each."""


@dataclass(frozen=True, eq=False, slots=True)
class BsplineSurface(NetSurface):
    """S(u, v) = Σ_ij N_i^p(u) N_j^q(v) P_ij over [U_p, U_{n+1}] × [V_q, V_{m+1}].

    Rational if weights are given. Each span along u with each span along v is one Bézier patch.

    Attributes
    ----------
    control_net : ndarray of float64, shape (n+1, m+1, 3)
        Control points; axis 0 runs along u, axis 1 along v. Model units.
    degree : (int, int)
        (p, q), 1 to 64 each.
    knots : a name or an ndarray of float64 for u, and one for v
        n + p + 2 numbers that never decrease, with multiplicities up to p + 1: at a knot of
        multiplicity p the surface has a crease, at p + 1 a discontinuity. The first and the last
        knot may both be omitted. Or a name. With "clamped" the surface reaches its first and last
        control points, with "uniform" it does not. With "periodic" the surface closes with
        continuity C^{p−1}; its control points are not repeated. Spans of named knots have length
        1, and the first span begins at 0.
    weights : ndarray of float64, shape (n+1, m+1), or None
        Positive weights. Equal weights have no effect.
    up : "y" or "z"
        The model's vertical axis.
    name : str
        Name of the part and of its glTF node.
    channels : Channels
        Colours, texture coordinates and attributes. A net with as many rows and columns as the
        control net has the degree and knots of the surface; any other net is one Bézier net over
        the domain.

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the surface.

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
        points = validate_points(self.control_net, "control_net", axes=3)
        counts = points.shape[:2]
        for k in range(2):
            check_degree(self.degree[k], f"/degree/{k}")
        knots = tuple(
            validate_knots(self.knots[k], counts[k], self.degree[k], f"/knots/{k}", "/control_net")
            for k in range(2)
        )
        object.__setattr__(self, "control_net", points)
        object.__setattr__(self, "knots", knots)
        check_bezier_points(self.knot_vectors, self.degree, "/control_net")
        object.__setattr__(self, "weights", validate_weights(self.weights, counts))
        spans_u, spans_v = (
            len(knot.spans(u, p)) for u, p in zip(self.knot_vectors, self.degree, strict=True)
        )
        object.__setattr__(self, "_spans", (spans_u, spans_v))
        self.channels.check_spans(counts, self.degree, self._spans)
        check_up(self.up)

    @property
    def knot_vectors(self) -> tuple[FloatArray, FloatArray]:
        """The knots as numbers; in a periodic direction they fit the control points of `_wrap`."""
        u, v = (
            build_knot_vector(self.knots[k], self.control_net.shape[k], self.degree[k])
            for k in range(2)
        )
        return u, v

    def size(self) -> SurfaceSize:
        """The size of one patch for each pair of spans; nets are lowered along u, then along v."""
        (p, q), (spans_u, spans_v), channels = self.degree, self._spans, self.channels
        weights, patches = self.weights, spans_u * spans_v
        size = tensor_size(patches, (p, q), weights, channels, name=self.name)
        # The first p rows and q columns may be repeated: always count them, for an upper bound.
        rows, columns = self.control_net.shape[0] + p, self.control_net.shape[1] + q
        point_bytes = (3 + (weights is not None) + size.width) * NUMBER
        bezier_nets = [net for *_, net in channels.each() if not self._is_spline_net(net)]
        # A Bézier net is restricted to all patches by a matrix for each span along u and along v.
        restricted_numbers = sum(
            spans_u * net.shape[0] ** 2 + spans_v * net.shape[1] ** 2 for net in bezier_nets
        )
        # Its result, and two temporary arrays of at most the same size.
        restricted_numbers += 3 * patches * sum(net.size for net in bezier_nets)
        # The matrices of extraction, with temporary copies of them.
        extracting_bytes = 4 * (spans_u * (p + 1) ** 2 + spans_v * (q + 1) ** 2) * NUMBER
        result_bytes = size.control_points * point_bytes + restricted_numbers * NUMBER
        # The net with its repeated rows and columns, and this net lowered along u alone.
        half_lowered_bytes = (rows + spans_u * (p + 1)) * columns * point_bytes
        # A block has at least one span along u with all columns, or one span along v with all rows.
        least_block_points = (p + 1) * (columns + spans_v * (q + 1)) + (q + 1) * rows
        block_bytes = min(
            5 * max(result_bytes, half_lowered_bytes),
            MAX_BLOCK_MEMORY + 5 * least_block_points * point_bytes,
        )
        # The control net for drawing, which the model contains too.
        net_points = rows * columns
        drawn_bytes = 3 * net_points * NUMBER
        return replace(
            size,
            nets=1,
            net_points=net_points,
            net_segments=2 * net_points,
            net_cells=net_points,
            surface_bytes=self.control_net.size // 3 * (3 + (weights is not None)) * NUMBER
            + sum(net.nbytes for *_, net in channels.each())
            + (rows + columns + 2) * NUMBER,
            lowered_bytes=result_bytes + drawn_bytes,
            peak_bytes=result_bytes
            + drawn_bytes
            + half_lowered_bytes
            + block_bytes
            + extracting_bytes,
        )

    def lower(self) -> PatchModel:
        """One Bézier patch for each span; control points that spans share are computed once."""
        (p, q), (knots_u, knots_v) = self.degree, self.knot_vectors
        weights = None
        # If all weights are equal, they cancel, and the surface is polynomial.
        if self.weights is not None and self.weights.min() < self.weights.max():
            weights = self.weights
        along_u, along_v = (isinstance(k, str) and k == "periodic" for k in self.knots)
        net = SplineNet(
            self.degree, (knots_u, knots_v), self.control_net, weights, (along_u, along_v)
        )
        domain = Domain(knot.breaks(knots_u, p), knot.breaks(knots_v, q), net=net)
        points, bezier_weights = self._lower_net(self.control_net, weights)
        channels = self.channels.lower(
            lambda net: (
                self._lower_net(net)[0]
                if self._is_spline_net(net)
                else restrict_to_cells(net, domain.u, domain.v)
            )
        )
        batch = TensorPatches(points, bezier_weights, channels)
        part = Part(self.name, 0, batch.count)
        return PatchModel(
            self.name,
            (batch,),
            (part,),
            self.up,
            (domain,),
            control_nets=(TensorPatches(self._wrap(self.control_net, 1)[np.newaxis]),),
            merged_knots=sum(
                count_merged(self.knots[k], self.control_net.shape[k], self.degree[k])
                for k in range(2)
            ),
        )

    def _lower_net(
        self, net: FloatArray, weights: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Bézier nets (P, p+1, q+1, d) and weights of a spline net with the surface's knots."""
        (p, q), (knots_u, knots_v) = self.degree, self.knot_vectors
        net = self._wrap(net)
        weights = None if weights is None else self._wrap(weights)
        extraction_u = plan_extraction(knots_u, p, net, weights)
        half_lowered, half_weights = extraction_u.combine(net, weights)
        # `combine` works along axis 0, so v becomes axis 0.
        half_lowered = half_lowered.swapaxes(0, 1)
        half_weights = None if half_weights is None else half_weights.T
        extraction_v = plan_extraction(knots_v, q, half_lowered, half_weights)
        spans_u, spans_v = len(extraction_u.point_numbers), len(extraction_v.point_numbers)
        dimension = net.shape[-1]
        points = np.empty((spans_u, spans_v, p + 1, q + 1, dimension))
        bezier_weights = None if half_weights is None else np.empty(points.shape[:-1])
        for block in row_slices(spans_u, (p + 1) * spans_v * (q + 1), BLOCK_POINTS):
            # For each span along u of the block, its p + 1 points along u in `half_lowered`.
            point_numbers = extraction_u.point_numbers[block]
            first = point_numbers[0, 0]
            block_points = slice(first, point_numbers[-1, -1] + 1)
            values, weight = extraction_v.combine(
                np.ascontiguousarray(half_lowered[:, block_points]),
                None if half_weights is None else half_weights[:, block_points],
            )
            # For each control point of the patches, its position in `values` as a list of points.
            index = extraction_v.point_numbers[:, np.newaxis] * values.shape[1]
            index = index + (point_numbers - first)[:, np.newaxis, :, np.newaxis]
            # All indices are valid; with mode="clip" NumPy writes to `out` without a copy.
            values.reshape(-1, dimension).take(index, axis=0, out=points[block], mode="clip")
            if weight is not None and bezier_weights is not None:
                weight.reshape(-1).take(index, out=bezier_weights[block], mode="clip")
        return (
            points.reshape(-1, p + 1, q + 1, dimension),
            None if bezier_weights is None else bezier_weights.reshape(-1, p + 1, q + 1),
        )

    def _is_spline_net(self, net: FloatArray) -> bool:
        """Whether the net of a channel has as many rows and columns as the control net."""
        return net.shape[:2] == self.control_net.shape[:2]

    def _wrap(self, net: FloatArray, repeats: int | None = None) -> FloatArray:
        """A net, with its first rows or columns repeated at the end of each periodic direction.

        `repeats` is the number of repeated rows or columns; by default the degree, as the knots
        need. One repeated row or column closes the net for drawing.
        """
        for axis, (knots, degree) in enumerate(zip(self.knots, self.degree, strict=True)):
            if isinstance(knots, str) and knots == "periodic":
                net = knot.wrap_points(net, degree if repeats is None else repeats, axis)
        return net
