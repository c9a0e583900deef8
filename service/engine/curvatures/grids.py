"""Partials up to the second at all samples of patches of one degree, in chunks.

Each net is translated by its middle, scaled, and then differenced in float64. So the second
partials are as exact as those that `service.engine.points.jets` computes.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases import triangle, triangle_basis
from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import FloatArray
from service.bases.bernstein import sample_basis, sample_basis_columns, sample_grid_basis
from service.bases.row_batches import row_runs
from service.engine.curvatures.forms import Coordinates, find_squared_norm
from service.engine.evaluation.evaluate import choose_formulation
from service.engine.evaluation.nets import PARTIALS, DerivativeNets
from service.engine.evaluation.triangle_nets import find_partial_nets, localize
from service.surface.batches import TensorPatches, TrianglePatches

CHUNK_SAMPLES = 16_384
"""Samples in one chunk: the work arrays, some dozens of numbers for each sample, take a few MiB."""

CHUNK_NUMBERS = 1 << 20
"""Numbers in the nets of the patches of one chunk."""


@dataclass(frozen=True, eq=False, slots=True)
class Chunk:
    """The partials at the samples [begin, end) of the patches [first, last).

    The chunk has r patches with n samples each.

    Attributes
    ----------
    partials : list of six Coordinates
        S, S_u, S_v, S_uu, S_uv, S_vv; homogeneous if the patches are rational; in the scale of each
        patch.
    scale : ndarray of float64, shape (r,)
        The factors by which lengths were multiplied.
    squared_norm : ndarray of float64, shape (r,)
        A typical |S_u × S_v|², the result of `service.engine.curvatures.forms.find_squared_norm`.
    """

    first: int
    last: int
    begin: int
    end: int
    partials: list[Coordinates]
    scale: FloatArray
    squared_norm: FloatArray


def grid_partials(patches: TensorPatches, resolution: tuple[int, int]) -> Iterator[Chunk]:
    """Partials up to the second at the samples (i/Ru, j/Rv), numbered i (Rv + 1) + j."""
    (p, q), columns = patches.degree, resolution[1] + 1
    is_kronecker = choose_formulation(patches, resolution, normals=False) == "kronecker"
    for first, last in _patch_runs(patches, (resolution[0] + 1) * columns):
        nets = DerivativeNets(patches, np.arange(first, last))
        planes_of_nets = [_planes_first(nets.partial_net(i, j)) for i, j in PARTIALS]
        squared_norm = find_squared_norm(nets.du * float(p), nets.dv * float(q))
        for begin, end in row_runs(resolution[0] + 1, max(1, CHUNK_SAMPLES // columns)):
            rows = slice(begin, end)
            samples = begin * columns, end * columns
            # The partials whose order is above the degree.
            zeros = np.zeros((nets.point.shape[1], last - first, samples[1] - samples[0]))
            evaluate = _evaluate_grid if is_kronecker else _evaluate_rows
            partials = [
                zeros if net is None else evaluate(net, resolution, rows) for net in planes_of_nets
            ]
            yield Chunk(first, last, *samples, partials, nets.scale, squared_norm)


def triangle_partials(patches: TrianglePatches, divisions: int) -> Iterator[Chunk]:
    """Partials along s and t, up to the second, at all samples of triangles."""
    n = patches.degree
    starts = triangle.row_starts(divisions)
    for first, last in _patch_runs(patches, triangle.count_points(divisions)):
        local = localize(patches.take(np.arange(first, last)))
        net = to_homogeneous(local.patches.points, local.patches.weights).transpose(1, 2, 0)
        nets = find_partial_nets(net)
        first_partials = (nets[key].transpose(2, 1, 0) for key in PARTIALS[1:3])
        squared_norm = find_squared_norm(*first_partials)
        is_small = triangle_basis.is_small(n, divisions)
        for begin, end in triangle.row_runs(divisions, CHUNK_SAMPLES):
            samples = int(starts[begin]), int(starts[end])
            zeros = np.zeros((net.shape[1], last - first, samples[1] - samples[0]))
            partials = [
                _evaluate_triangle(
                    nets[key], divisions, range(begin, end), samples, is_small=is_small
                )
                if key in nets
                else zeros
                for key in PARTIALS
            ]
            yield Chunk(first, last, *samples, partials, local.scale, squared_norm)


def _patch_runs(
    patches: TensorPatches | TrianglePatches, samples: int
) -> Iterator[tuple[int, int]]:
    """Runs of patches that stay within `CHUNK_SAMPLES` and `CHUNK_NUMBERS`, or of one patch.

    `samples` is the number of samples of each patch.
    """
    control_points = patches.points[0].size // 3
    numbers = len(PARTIALS) * 4 * control_points
    return row_runs(patches.count, max(1, min(CHUNK_SAMPLES // samples, CHUNK_NUMBERS // numbers)))


def _planes_first(net: FloatArray | None) -> FloatArray | None:
    """Nets (r, d, m, n) as (d, r, m, n): coordinates before patches."""
    return None if net is None else np.ascontiguousarray(net.swapaxes(0, 1))


def _evaluate_grid(net: FloatArray, resolution: tuple[int, int], rows: slice) -> Coordinates:
    """Some rows of samples (d, r, n) of nets (d, r, m, n), by one product with a cached basis."""
    planes, count, m, n = net.shape
    columns = resolution[1] + 1
    basis = sample_grid_basis((m - 1, n - 1), resolution)[
        :, rows.start * columns : rows.stop * columns
    ]
    return (net.reshape(planes * count, m * n) @ basis).reshape(planes, count, -1)


def _evaluate_rows(net: FloatArray, resolution: tuple[int, int], rows: slice) -> Coordinates:
    """Some rows of samples (d, r, n) of nets (d, r, m, n), first along u, then along v."""
    planes, count, m, n = net.shape
    along_u = sample_basis(m - 1, resolution[0])[rows] @ net
    return (along_u @ sample_basis_columns(n - 1, resolution[1])).reshape(planes, count, -1)


def _evaluate_triangle(
    net: FloatArray, divisions: int, rows: range, samples: tuple[int, int], *, is_small: bool
) -> Coordinates:
    """Some rows of samples (d, r, n) of triangular nets (K, d, r)."""
    count, planes, patches = net.shape
    columns = net.reshape(count, -1)
    if is_small:
        basis = triangle_basis.sample_triangle_basis(triangle.degree_of(count), divisions)
        values = columns.T @ basis[:, slice(*samples)]
    else:
        values = np.empty((planes * patches, samples[1] - samples[0]))
        curves = triangle_basis.row_curves(columns)
        triangle_basis.evaluate_rows(curves, divisions, rows, np.float64, values)
    return values.reshape(planes, patches, -1)
