"""Partials up to the second at all samples of a block of patches, in chunks.

Each net is moved to its middle, scaled and differenced in float64. So the second partials are as
exact as those at single parameters (`service.engine.points.differential`).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases import triangle, triangle_basis
from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import sample_basis, sample_basis_columns, sample_grid_basis
from service.bases.homogeneous import to_homogeneous
from service.bases.row_batches import row_runs
from service.engine.curvatures.forms import Planes, find_measure
from service.engine.evaluation.evaluate import choose_formulation
from service.engine.evaluation.nets import PARTIALS, DerivativeNets
from service.engine.evaluation.triangle_nets import partial_nets
from service.engine.evaluation.triangle_normals import localize
from service.surface.batches import TensorPatches, TrianglePatches

CHUNK_SAMPLES = 16_384
"""Samples in one chunk: some dozens of planes of them are a few MiB."""

CHUNK_NUMBERS = 1 << 20
"""Numbers in the nets of the patches of one chunk."""


@dataclass(frozen=True, eq=False, slots=True)
class Chunk:
    """Samples [begin, end) of patches [first, last), all of them r × n.

    Attributes
    ----------
    partials : list of six Planes
        Homogeneous if the patches are rational; in the scale of each patch.
    scale : ndarray of float64, shape (r,)
        The factors by which lengths were multiplied.
    measure : ndarray of float64, shape (r,)
        See `service.engine.curvatures.forms.find_measure`.
    """

    first: int
    last: int
    begin: int
    end: int
    partials: list[Planes]
    scale: FloatArray
    measure: FloatArray


def grid_partials(patches: TensorPatches, resolution: tuple[int, int]) -> Iterator[Chunk]:
    """Partials at the samples (i/Ru, j/Rv), numbered i (Rv + 1) + j."""
    columns = resolution[1] + 1
    at_once = choose_formulation(patches, resolution, normals=False) == "kronecker"
    for first, last in _patch_runs(patches, (resolution[0] + 1) * columns):
        nets = DerivativeNets(patches, np.arange(first, last))
        partial_nets = [_planes_first(nets.partial_net(i, j)) for i, j in PARTIALS]
        measure = find_measure(*(_require_net(nets.partial_net(i, j)) for i, j in PARTIALS[1:3]))
        for begin, end in row_runs(resolution[0] + 1, max(1, CHUNK_SAMPLES // columns)):
            rows = slice(begin, end)
            samples = begin * columns, end * columns
            empty = np.zeros((nets.point.shape[1], last - first, samples[1] - samples[0]))
            product = _evaluate_grid if at_once else _evaluate_rows
            partials = [
                empty if net is None else product(net, resolution, rows) for net in partial_nets
            ]
            yield Chunk(first, last, *samples, partials, nets.scale, measure)


def triangle_partials(patches: TrianglePatches, divisions: int) -> Iterator[Chunk]:
    """Partials along s and t at all samples of triangles."""
    n = patches.degree
    starts = triangle.row_starts(divisions)
    for first, last in _patch_runs(patches, triangle.count_points(divisions)):
        local = localize(patches.take(np.arange(first, last)))
        net = to_homogeneous(local.patches.points, local.patches.weights).transpose(1, 2, 0)
        ds, dt = (n * part for part in partial_nets(net))
        of: list[FloatArray | None] = [net, ds, dt, None, None, None]
        if n > 1:
            dss, dst = partial_nets(ds)
            of[3:] = [(n - 1) * part for part in (dss, dst, partial_nets(dt)[1])]
        measure = find_measure(*(part.transpose(2, 1, 0) for part in (ds, dt)))
        small = triangle_basis.is_small(n, divisions)
        for begin, end in _row_runs(starts):
            samples = int(starts[begin]), int(starts[end])
            empty = np.zeros((net.shape[1], last - first, samples[1] - samples[0]))
            partials = [
                empty
                if part is None
                else _evaluate_triangle(part, divisions, range(begin, end), samples, small=small)
                for part in of
            ]
            yield Chunk(first, last, *samples, partials, local.scale, measure)


def _patch_runs(patches: TensorPatches | TrianglePatches, each: int) -> Iterator[tuple[int, int]]:
    """Runs of patches that stay within `CHUNK_SAMPLES` and `CHUNK_NUMBERS`."""
    numbers = len(PARTIALS) * 4 * patches.points[0].size // 3
    return row_runs(patches.count, max(1, min(CHUNK_SAMPLES // each, CHUNK_NUMBERS // numbers)))


def _row_runs(starts: Ints) -> Iterator[tuple[int, int]]:
    """Runs of rows of samples of a triangle."""
    low, count = 0, len(starts) - 1
    while low < count:
        last = np.searchsorted(starts, starts[low] + CHUNK_SAMPLES, side="right") - 1
        high = max(low + 1, int(last))
        yield low, high
        low = high


def _planes_first(net: FloatArray | None) -> FloatArray | None:
    """Nets (r, d, m, n) with their coordinates before the patches."""
    return None if net is None else np.ascontiguousarray(net.swapaxes(0, 1))


def _require_net(net: FloatArray | None) -> FloatArray:
    if net is None:
        raise ValueError("patches have degree 1 at least")
    return net


def _evaluate_grid(net: FloatArray, resolution: tuple[int, int], rows: slice) -> Planes:
    """Some rows of samples (d, r, n) of nets (d, r, m, n), by one product with a cached basis."""
    planes, count, m, n = net.shape
    columns = resolution[1] + 1
    basis = sample_grid_basis((m - 1, n - 1), resolution)[
        :, rows.start * columns : rows.stop * columns
    ]
    return (net.reshape(planes * count, m * n) @ basis).reshape(planes, count, -1)


def _evaluate_rows(net: FloatArray, resolution: tuple[int, int], rows: slice) -> Planes:
    """Some rows of samples (d, r, n) of nets (d, r, m, n), first along u, then along v."""
    planes, count, m, n = net.shape
    along_u = sample_basis(m - 1, resolution[0])[rows] @ net
    return (along_u @ sample_basis_columns(n - 1, resolution[1])).reshape(planes, count, -1)


def _evaluate_triangle(
    net: FloatArray, divisions: int, rows: range, samples: tuple[int, int], *, small: bool
) -> Planes:
    """Some rows of samples (d, r, n) of triangular nets (K, d, r)."""
    count, planes, patches = net.shape
    columns = net.reshape(count, -1)
    if small:
        basis = triangle_basis.sample_triangle_basis(triangle.degree_of(count), divisions)
        values = columns.T @ basis[:, slice(*samples)]
    else:
        values = np.empty((planes * patches, samples[1] - samples[0]))
        curves = triangle_basis.row_curves(columns)
        triangle_basis.evaluate_rows(curves, divisions, rows, np.float64, values)
    return values.reshape(planes, patches, -1)
