"""Colours, texture coordinates and attributes at all samples of a layout.

A channel is a polynomial of its own degree over the parameters of each patch, so it is evaluated
like the points, but separately. Samples at one place whose values differ by rounding alone get
equal values, bit for bit: so welding only compares values for equality.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, Ints, RealArray
from service.bases.bernstein import bernstein, sample_basis
from service.bases.bernstein import sample_parameters as parameters
from service.bases.row_batches import row_slices
from service.bases.triangle import row_starts
from service.bases.triangle_basis import evaluate_triangles
from service.engine.clustering import find_leaders
from service.engine.extent import find_extent
from service.engine.mesh.layout import Layout
from service.engine.mesh.runs import Block
from service.engine.scratch import Real
from service.surface.batches import Channel, ChannelKind
from service.surface.lowered import Domain, PatchModel
from service.surface.sides import take_side

CHUNK_VALUES = 1 << 20
"""Values in one chunk."""

SAME_RANGE = 2.0**-16
"""Values whose difference is below this share of the channel's range count as equal."""

SAME_VALUE = 2.0**-20
"""Values whose difference is below this share of the largest value count as equal, too: eight units
in the last place of a float32."""


TINY = float(np.finfo(np.float32).smallest_subnormal)


@dataclass(frozen=True, eq=False, slots=True)
class ChannelRows:
    """The values (N, d) of one channel at all samples, in the precision of the mesh.

    If the channel has a `unit`, values whose quotient is nearly 1 count as equal, and a value is
    small if its product with the unit is below 1. An `exact` channel compares bit for bit:
    parameters are exact, because a surface may change much between near parameters.
    """

    name: str
    kind: ChannelKind
    values: RealArray
    unit: float | None = None
    exact: bool = False

    def take(self, chosen: Ints) -> "ChannelRows":
        """The chosen rows, in this order."""
        return replace(self, values=self.values.take(chosen, axis=0))


def sample_channels(
    model: PatchModel, layout: Layout, dtype: Real, uvs: bool
) -> tuple[ChannelRows, ...]:
    """Every channel of the model; with `uvs`, parameters where it has no texture coordinates."""
    channels = model.batches[0].channels
    rows_by_channel = [
        ChannelRows(channel.name, channel.kind, _build_rows(model, layout, number, dtype))
        for number, channel in enumerate(channels)
    ]
    if uvs and not any(channel.kind == "uvs" for channel in channels):
        rows = _parameter_rows(layout, model.domains, dtype)
        rows_by_channel.append(ChannelRows("uvs", "uvs", rows, exact=True))
    return tuple(rows_by_channel)


def split_by_kind(
    channels: tuple[ChannelRows, ...],
) -> tuple[RealArray | None, RealArray | None, tuple[tuple[str, RealArray], ...]]:
    """Texture coordinates, colours, and named attributes, in the form of `Mesh`."""
    by_kind = {channel.kind: channel.values for channel in channels if channel.kind != "attribute"}
    named = tuple((c.name, c.values) for c in channels if c.kind == "attribute")
    return by_kind.get("uvs"), by_kind.get("colors"), named


def match_values(place: Ints, channels: tuple[ChannelRows, ...]) -> Ints:
    """For each sample the first sample at its place with the same value in every channel.

    Values that differ by rounding alone become equal, channel by channel.

    Parameters
    ----------
    place : ndarray of int, shape (N,)
        For each sample, the number of one sample at its position, the same for all samples there.
    channels : tuple of ChannelRows
        Written into.
    """
    identity = np.arange(len(place))
    # The few samples that share their place with another sample, numbered from 0.
    shared = np.zeros(len(place), dtype=bool)
    shared[place != identity] = True
    shared[place[shared]] = True
    rows = np.flatnonzero(shared)
    spot = np.searchsorted(rows, place[rows])
    local = spot
    for channel in channels:
        values = channel.values[rows]
        near = (values, 0.0) if channel.exact else (_scale_values(channel, values), 1.0)
        first = find_leaders(spot, *near)
        channel.values[rows] = values[first]
        local = find_leaders(local, first[:, np.newaxis].astype(np.float64), 0.5)
    alike = identity
    alike[rows] = rows[local]
    return alike


def _scale_values(channel: ChannelRows, values: RealArray) -> FloatArray:
    """Values of a channel in units of the largest difference that counts as zero.

    With a unit, arsinh is applied first. It is linear near 0 and logarithmic far from 0: so small
    values are compared by their difference, and large values by their quotient.
    """
    if channel.unit is None:
        return values * _scale(channel.values)
    steps: FloatArray = np.arcsinh(values.astype(np.float64) * channel.unit) / SAME_VALUE
    return steps


def _scale(values: RealArray) -> FloatArray:
    """1 divided by the difference that counts as zero, column by column; 0 for columns of zeros."""
    low, high = (bound.astype(np.float64) for bound in find_extent(values))
    same = np.maximum(SAME_RANGE * (high - low), SAME_VALUE * np.maximum(-low, high))
    # Values that float32 rounds to zero count as zero.
    return np.where(same > 0, 1.0 / np.maximum(same, TINY), 0.0)


def _build_rows(model: PatchModel, layout: Layout, number: int, dtype: Real) -> RealArray:
    """Values (N, d) of one channel: on the grids, then at the extra samples of framed sides."""
    dimension = model.batches[0].channels[number].dimension
    rows = np.empty((layout.size, dimension), dtype=dtype)
    for block in layout.blocks:
        channel = model.batches[block.batch].channels[number]
        out = rows[block.base : block.base + block.count * len(block.patches)]
        out = out.reshape(len(block.patches), block.count, dimension)
        if block.is_triangle:
            _write_triangles(channel, block, out)
            continue
        _write_grids(channel, block, out)
        for side, patches, along, samples in layout.iterate_extras(block):
            edges = take_side(channel.nets, side)[patches]
            basis = bernstein(edges.shape[1] - 1, along)
            rows[samples] = np.einsum("ni,nid->nd", basis, edges)
    if channel.kind == "colors":
        np.clip(rows, 0.0, 1.0, out=rows)
    # As for points: adding 0.0 turns -0.0 into 0.0.
    np.add(rows, 0.0, out=rows)
    return rows


def _write_grids(channel: Channel, block: Block, out: RealArray) -> None:
    """B(u) C B(v)ᵀ for every component of every patch, computed in float64."""
    a, b = channel.nets.shape[1] - 1, channel.nets.shape[2] - 1
    along_u, along_v = sample_basis(a, block.resolution[0]), sample_basis(b, block.resolution[1]).T
    for rows in row_slices(len(block.patches), block.count, CHUNK_VALUES):
        nets = channel.nets[block.patches[rows]]
        for component in range(channel.dimension):
            plane = along_u @ np.ascontiguousarray(nets[..., component]) @ along_v
            out[rows, :, component] = plane.reshape(len(nets), -1)


def _write_triangles(channel: Channel, block: Block, out: RealArray) -> None:
    """Σ B_ijk C_ijk at all samples of every triangle, row by row."""
    for rows in row_slices(len(block.patches), block.count, CHUNK_VALUES):
        nets = channel.nets[block.patches[rows]]
        out[rows] = evaluate_triangles(nets, block.resolution[0])


def _parameter_rows(layout: Layout, domains: tuple[Domain, ...], dtype: Real) -> RealArray:
    """Parameters (N, 2) of every sample: in the domain of its surface, or in its patch."""
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
        grid = out.reshape(len(u), u.shape[1], v.shape[1], 2)
        grid[..., 0] = u[:, :, np.newaxis]
        grid[..., 1] = v[:, np.newaxis]
        for side, patches, along, samples in layout.iterate_extras(block):
            limits = find_limits(block.first + patches, domains)
            axis = 1 if side < 2 else 0
            low, high = limits[axis].T
            rows[samples, axis] = (1.0 - along) * low + along * high
            rows[samples, 1 - axis] = limits[1 - axis][:, side % 2]
    return rows


def _write_triangle_parameters(block: Block, rows: RealArray) -> None:
    """(s, t) of every sample of triangles."""
    divisions = block.resolution[0]
    out = rows[block.base : block.base + block.count * len(block.patches)]
    out = out.reshape(len(block.patches), block.count, 2)
    for row, (first, last) in enumerate(pairwise(row_starts(divisions).tolist())):
        out[:, first:last, 0] = np.arange(last - first) / divisions
        out[:, first:last, 1] = row / divisions


def find_limits(patches: Ints, domains: tuple[Domain, ...]) -> tuple[FloatArray, FloatArray]:
    """First and last u, and v, of patches by their numbers in the model: (m, 2) each."""
    if not domains:
        unit = np.tile([0.0, 1.0], (len(patches), 1))
        return unit, unit
    domains = tuple(sorted(domains, key=attrgetter("first")))
    first, rows, columns = (
        np.array(numbers)
        for numbers in zip(*((d.first, len(d.u), len(d.v)) for d in domains), strict=True)
    )
    owner = np.searchsorted(first, patches, side="right") - 1
    row, column = np.divmod(patches - first[owner], columns[owner] - 1)
    # The knots of all domains, one after another.
    row += (np.cumsum(rows) - rows)[owner]
    column += (np.cumsum(columns) - columns)[owner]
    u, v = (np.concatenate(knots) for knots in zip(*((d.u, d.v) for d in domains), strict=True))
    return _span_ends(u, row), _span_ends(v, column)


def _span_ends(knots: FloatArray, span: NDArray[np.intp]) -> FloatArray:
    return np.stack([knots[span], knots[span + 1]], axis=1)


def _interpolate(limits: FloatArray, t: FloatArray) -> FloatArray:
    """Parameters (m, R+1) from limits (m, 2); the ends are equal to the limits bit for bit."""
    return limits[:, :1] * (1.0 - t) + limits[:, 1:] * t
