"""Colours, texture coordinates and attributes at all samples of a layout.

On each patch a channel is a polynomial, whose degree may differ from that of the points, so it is
evaluated separately. If the values of samples at one position differ by rounding alone, they become
equal bit for bit: then welding only compares values for equality.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from operator import attrgetter

import numpy as np

from service.bases.arrays import AnyInts, FloatArray, Ints, RealArray
from service.bases.bernstein import bernstein, sample_basis
from service.bases.bernstein import sample_parameters as parameters
from service.bases.row_batches import row_slices
from service.bases.triangle import row_starts
from service.bases.triangle_basis import evaluate_triangles
from service.engine.clustering import find_leaders
from service.engine.extent import find_extent
from service.engine.plans.layout import Layout
from service.engine.plans.sample_numbers import Block
from service.engine.scratch import Real
from service.surface.batches import Channel, ChannelKind
from service.surface.lowered import Domain, PatchModel
from service.surface.sides import take_side

CHUNK_VALUES = 1 << 20
"""The most values that are computed together, but at least those of one patch. It limits the memory
of temporary arrays."""

SAME_RANGE = 2.0**-16
"""Two values of a channel without a unit (see `ChannelRows`) count as equal if their difference is
at most this fraction of the channel's range."""

SAME_VALUE = 2.0**-20
"""Two values also count as equal if their difference is at most this fraction of the largest value:
eight units in the last place of float32."""

TINY = float(np.finfo(np.float32).smallest_subnormal)
"""The smallest positive number of float32."""


@dataclass(frozen=True, eq=False, slots=True)
class ChannelRows:
    """The values (N, d) of one channel at all samples, in the precision of the mesh.

    The product of a value and the `unit` has no dimension: for mean curvatures, the unit is the
    model's size. If the channel has a unit, large values count as equal if their quotient is nearly
    1, and small values if their difference is nearly 0; a value is small if its product with the
    unit is below 1. Values of a channel with `is_exact` are equal only bit for bit: parameters are
    exact, because a surface may change much between near parameters.
    """

    name: str
    kind: ChannelKind
    values: RealArray
    unit: float | None = None
    is_exact: bool = False

    def take(self, rows: AnyInts) -> "ChannelRows":
        """The channel with only these rows, in this order."""
        return replace(self, values=self.values.take(rows, axis=0))


def sample_channels(
    model: PatchModel, layout: Layout, dtype: Real, uvs: bool
) -> tuple[ChannelRows, ...]:
    """The rows of every channel of the model.

    If `uvs`, and the model has no texture coordinates, the parameters are a channel, too.
    """
    channels = model.batches[0].channels
    rows_by_channel = [
        ChannelRows(channel.name, channel.kind, _build_rows(model, layout, number, dtype))
        for number, channel in enumerate(channels)
    ]
    if uvs and not any(channel.kind == "uvs" for channel in channels):
        rows = _parameter_rows(layout, model.domains, dtype)
        rows_by_channel.append(ChannelRows("uvs", "uvs", rows, is_exact=True))
    return tuple(rows_by_channel)


def split_by_kind(
    channels: tuple[ChannelRows, ...],
) -> tuple[RealArray | None, RealArray | None, tuple[tuple[str, RealArray], ...]]:
    """Texture coordinates, colours, and named attributes, as `Mesh` stores them."""
    by_kind = {channel.kind: channel.values for channel in channels if channel.kind != "attribute"}
    named = tuple((c.name, c.values) for c in channels if c.kind == "attribute")
    return by_kind.get("uvs"), by_kind.get("colors"), named


def match_values(same_position: AnyInts, channels: tuple[ChannelRows, ...]) -> Ints:
    """For each sample, one sample at its position that has the same value in every channel.

    Values that differ by rounding alone become equal, channel by channel.

    Parameters
    ----------
    same_position : ndarray of int, shape (N,)
        For each sample, the number of one sample at its position, the same for all samples there.
    channels : tuple of ChannelRows
        Their values are overwritten.
    """
    sample_leaders = np.arange(len(same_position))
    # Only the few samples that share their position with another sample are compared.
    is_shared = same_position != sample_leaders
    is_shared[same_position[is_shared]] = True
    rows = np.flatnonzero(is_shared)
    # From here on, the samples `rows` have the numbers 0, 1, …; `position_rows` has, for each of
    # them, one at its position, and `leader` one that also has equal values in the channels so far.
    position_rows = np.searchsorted(rows, same_position[rows])
    leader = position_rows
    for channel in channels:
        values = channel.values[rows]
        scaled_values, radius = values, 0.0  # `radius`: the largest difference that counts as zero
        if not channel.is_exact:
            scaled_values, radius = _scale_values(channel, values), 1.0
        first = find_leaders(position_rows, scaled_values, radius)
        channel.values[rows] = values[first]
        # Groups of earlier channels are divided by `first`. Its values are whole numbers: at most
        # 0.5 apart, they are equal.
        leader = find_leaders(leader, first[:, np.newaxis].astype(np.float64), 0.5)
    sample_leaders[rows] = rows[leader]
    return sample_leaders


def _scale_values(channel: ChannelRows, values: RealArray) -> FloatArray:
    """The values (N, d) in units of the largest difference that counts as zero.

    If the channel has a unit, the result uses the arsinh of the values. The arsinh is linear near 0
    and logarithmic far from 0: so for small values the result compares their difference, for large
    values their quotient.
    """
    if channel.unit is not None:
        return np.arcsinh(values.astype(np.float64) * channel.unit) / SAME_VALUE
    # For each column, (d,): the largest difference that counts as zero; 0 for a column of zeros.
    low, high = (bound.astype(np.float64) for bound in find_extent(channel.values))
    largest = np.maximum(SAME_RANGE * (high - low), SAME_VALUE * np.maximum(-low, high))
    # Values that float32 rounds to zero count as zero.
    factors: FloatArray = np.where(largest > 0, 1.0 / np.maximum(largest, TINY), 0.0)
    return values * factors


def _build_rows(model: PatchModel, layout: Layout, number: int, dtype: Real) -> RealArray:
    """Values (N, d) of one channel: on the grids, then at the extra samples of stitched sides."""
    dimension = model.batches[0].channels[number].dimension
    rows = np.empty((layout.size, dimension), dtype=dtype)
    for block in layout.blocks:
        channel = model.batches[block.batch].channels[number]
        out = rows[block.base : block.base + block.count * len(block.patches)]
        out = out.reshape(len(block.patches), block.count, dimension)
        _write_values(channel, block, out)
        # For each extra sample of a side: its patch, its parameter along the side, its number.
        for side, patches, along, samples in layout.iterate_extras(block):
            edges = take_side(channel.nets, side)[patches]
            basis = bernstein(edges.shape[1] - 1, along)
            rows[samples] = np.einsum("ni,nid->nd", basis, edges)
    if channel.kind == "colors":
        np.clip(rows, 0.0, 1.0, out=rows)
    np.add(rows, 0.0, out=rows)  # turns -0.0 into 0.0, as for points
    return rows


def _write_values(channel: Channel, block: Block, out: RealArray) -> None:
    """Writes the values at all samples of every patch, computed in float64.

    On grids they are B(u) C B(v)ᵀ for every component, on triangles Σ B_ijk C_ijk.
    """
    for rows in row_slices(len(block.patches), block.count, CHUNK_VALUES):
        nets = channel.nets[block.patches[rows]]
        if block.is_triangle:
            out[rows] = evaluate_triangles(nets, block.resolution[0])
            continue
        along_u, along_v = (
            sample_basis(points - 1, divisions)
            for points, divisions in zip(nets.shape[1:3], block.resolution, strict=True)
        )
        for component in range(channel.dimension):
            plane = along_u @ np.ascontiguousarray(nets[..., component]) @ along_v.T
            out[rows, :, component] = plane.reshape(len(nets), -1)


def _parameter_rows(layout: Layout, domains: tuple[Domain, ...], dtype: Real) -> RealArray:
    """The parameters (N, 2) of all samples.

    They are parameters of the surface's domain; if the model has no domains, of each patch, in
    [0, 1].
    """
    rows = np.empty((layout.size, 2), dtype=dtype)
    for block in layout.blocks:
        if block.is_triangle:
            _write_triangle_parameters(block, rows)
            continue
        ends = find_limits(block.first + block.patches, domains)
        u, v = (
            _interpolate(limits, parameters(r))
            for limits, r in zip(ends, block.resolution, strict=True)
        )
        out = rows[block.base : block.base + block.count * len(block.patches)]
        # `u` (m, Ru+1) and `v` (m, Rv+1) are the parameters of the m patches.
        grid = out.reshape(len(u), u.shape[1], v.shape[1], 2)
        grid[..., 0] = u[:, :, np.newaxis]
        grid[..., 1] = v[:, np.newaxis]
        for side, patches, along, samples in layout.iterate_extras(block):
            limits = find_limits(block.first + patches, domains)
            axis = 1 if side < 2 else 0  # the sides u = 0 and u = 1 run along v
            low, high = limits[axis].T
            rows[samples, axis] = (1.0 - along) * low + along * high
            rows[samples, 1 - axis] = limits[1 - axis][:, side % 2]
    return rows


def _write_triangle_parameters(block: Block, rows: RealArray) -> None:
    """Writes the parameters (s, t) of all samples of triangles."""
    divisions = block.resolution[0]
    out = rows[block.base : block.base + block.count * len(block.patches)]
    out = out.reshape(len(block.patches), block.count, 2)
    for row, (first, last) in enumerate(pairwise(row_starts(divisions).tolist())):
        out[:, first:last, 0] = np.arange(last - first) / divisions
        out[:, first:last, 1] = row / divisions


def find_limits(patches: Ints, domains: tuple[Domain, ...]) -> tuple[FloatArray, FloatArray]:
    """The first and the last u, and v, of patches with these numbers in the model: (m, 2) each.

    They are knots of the patch's domain; without domains, 0 and 1.
    """
    if not domains:
        unit = np.tile([0.0, 1.0], (len(patches), 1))
        return unit, unit
    domains = tuple(sorted(domains, key=attrgetter("first")))
    first, u_counts, v_counts = (
        np.array(numbers)
        for numbers in zip(*((d.first, len(d.u), len(d.v)) for d in domains), strict=True)
    )
    domain_numbers = np.searchsorted(first, patches, side="right") - 1
    # A domain with n knots along v has n − 1 columns of patches.
    row, column = np.divmod(patches - first[domain_numbers], v_counts[domain_numbers] - 1)
    # The knots of all domains are in one array, one domain after another.
    row += (np.cumsum(u_counts) - u_counts)[domain_numbers]
    column += (np.cumsum(v_counts) - v_counts)[domain_numbers]
    u, v = (np.concatenate(knots) for knots in zip(*((d.u, d.v) for d in domains), strict=True))
    return _span_ends(u, row), _span_ends(v, column)


def _span_ends(knots: FloatArray, span: Ints) -> FloatArray:
    """The two knots at the ends of each span, (m, 2)."""
    return np.stack([knots[span], knots[span + 1]], axis=1)


def _interpolate(limits: FloatArray, t: FloatArray) -> FloatArray:
    """Equally spaced parameters (m, R+1) between limits (m, 2), which they include bit for bit."""
    return limits[:, :1] * (1.0 - t) + limits[:, 1:] * t
