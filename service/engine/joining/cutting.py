"""Cuts surfaces along parameter lines, as the insertion of a knot does.

A line cuts all patches of its surface in the same span, so that the pieces are still a grid. The
borders that no line crosses keep their bits. Borders that were equal are cut into equal pieces, bit
for bit, because each number is computed separately (`service.bases.affine_combination`).
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.polynomials import Net, split
from service.bases.row_batches import split_runs
from service.engine.joining.shared_curves import Cuts
from service.surface.batches import Patches, TensorPatches
from service.surface.lowered import Domain, PatchModel
from service.surface.multipatch import order_as_before, rebuild, surfaces_of

ROUNDING = 2.0**-49
"""Bound of the rounding error of cutting, for each degree, relative to the largest coordinate."""


@dataclass(frozen=True, eq=False, slots=True)
class Lines:
    """K parameter lines along which surfaces are cut, sorted by surface, axis and parameter.

    All arrays have the shape (K,). `surface` is the number of a surface in the tuple that
    `surfaces_of` returns. `axis` is 0 if u is constant along the line, 1 if v is. `span` is the
    number of the knot span that the line cuts, and `at`, between 0 and 1, is the parameter within
    this span.
    """

    surface: Ints
    axis: Ints
    span: Ints
    at: FloatArray


def find_lines(model: PatchModel, cuts: Cuts) -> Lines:
    """The lines through cuts of sides; of several lines with nearly equal parameters, the first.

    Triangles are not cut.
    """
    surfaces = surfaces_of(model)
    first = np.array([domain.first for domain in surfaces])
    columns = np.array([len(domain.v) - 1 for domain in surfaces])
    surface = np.searchsorted(first, cuts.patch, side="right") - 1
    local_patch, axis = cuts.patch - first[surface], (cuts.side < 2).astype(np.intp)
    span = np.where(axis == 0, local_patch // columns[surface], local_patch % columns[surface])
    ends = np.cumsum([batch.count for batch in model.batches])
    has_grids = np.array([isinstance(batch, TensorPatches) for batch in model.batches])
    order = np.lexsort((cuts.at, span, axis, surface))
    order = order[has_grids[np.searchsorted(ends, cuts.patch, side="right")][order]]
    surface, axis, span, at = surface[order], axis[order], span[order], cuts.at[order]
    slack = cuts.slack[order]
    is_new = np.ones(len(order), dtype=bool)
    is_new[1:] = (surface[1:] != surface[:-1]) | (axis[1:] != axis[:-1]) | (span[1:] != span[:-1])
    is_new[1:] |= at[1:] - at[:-1] > np.maximum(slack[1:], slack[:-1])
    return Lines(surface[is_new], axis[is_new], span[is_new], at[is_new])


def cut(model: PatchModel, lines: Lines) -> PatchModel:
    """The model with its surfaces cut along lines; parts and parameters of points stay the same."""
    surfaces = surfaces_of(model)
    is_break = lines.surface[1:] != lines.surface[:-1]
    runs = {int(lines.surface[run.start]): run for run in split_runs(is_break)}
    ends = np.cumsum([batch.count for batch in model.batches]).tolist()
    pieces: list[list[Patches]] = [[] for _ in model.batches]
    owners: list[Ints] = []
    domains: list[Domain] = []
    next_patch = added_patches = 0
    # For each surface with lines: first the patches between the surface before and this surface,
    # which are not cut, then the pieces of this surface. The last number stands for the end.
    for number in [*sorted(runs), len(surfaces)]:
        stop = surfaces[number].first if number < len(surfaces) else model.patch_count
        domains += [
            replace(d, first=d.first + added_patches) for d in surfaces[len(domains) : number]
        ]
        for batch_number, end in enumerate(ends):
            begin = end - model.batches[batch_number].count
            rows = np.arange(max(next_patch, begin), min(stop, end))
            if len(rows):
                pieces[batch_number].append(model.batches[batch_number].take(rows - begin))
                owners.append(rows)
        if number == len(surfaces):
            break
        domain = surfaces[number]
        batch_number = int(np.searchsorted(ends, domain.first, side="right"))
        batch = model.batches[batch_number]
        assert isinstance(batch, TensorPatches)
        rows = domain.first + np.arange(domain.patch_count)
        piece = batch.take(rows - (ends[batch_number] - batch.count))
        line_rows = runs[number]
        axis, span, at = lines.axis[line_rows], lines.span[line_rows], lines.at[line_rows]
        grid = rows.reshape(len(domain.u) - 1, -1)
        knots = []
        for direction, old_knots in enumerate((domain.u, domain.v)):
            is_across = axis == direction
            piece, grid = _cut_grid(piece, grid, direction, span[is_across], at[is_across])
            new_knots = (
                old_knots[span[is_across]] + at[is_across] * np.diff(old_knots)[span[is_across]]
            )
            knots.append(np.sort(np.concatenate([old_knots, new_knots])))
        pieces[batch_number].append(piece)
        owners.append(grid.ravel())
        domains.append(Domain(knots[0], knots[1], domain.first + added_patches))
        added_patches += grid.size - domain.patch_count
        next_patch = domain.first + domain.patch_count
    low, high = model.bounds
    degree = max(max(batch.side_degrees) for batch in model.batches)
    rounding = degree * ROUNDING * float(max(-low.min(), high.max()))
    owner = np.concatenate(owners)
    ordered = order_as_before(model, domains)
    return replace(rebuild(model, pieces, owner, ordered), moved=model.moved + rounding)


def _cut_grid(
    batch: TensorPatches, grid: Ints, axis: int, span: Ints, at: FloatArray
) -> tuple[TensorPatches, Ints]:
    """Cuts a grid (M_u, M_v) of patches along lines of one axis.

    Returns the pieces, and a grid with the number of the original patch of each piece.
    """
    if not len(span):
        return batch, grid

    def move_axis(grids: FloatArray) -> FloatArray:
        """Makes the cut direction of nets (M_u, M_v, p+1, q+1, …) the first, or moves it back."""
        return grids.swapaxes(0, 1).swapaxes(2, 3) if axis else grids

    def stack(rows: list[FloatArray], shape: tuple[int, ...]) -> FloatArray:
        """The rows of pieces as nets of this shape, one after another."""
        pieces = move_axis(np.stack([row.swapaxes(0, 1) for row in rows]))
        return np.ascontiguousarray(pieces).reshape(-1, *shape)

    def divide(nets: FloatArray, weights: FloatArray | None) -> Net:
        """The cut nets and weights of all patches."""
        net_grid = move_axis(nets.reshape(*grid.shape, *nets.shape[1:]))
        weight_grid = None
        if weights is not None:
            weight_grid = move_axis(weights.reshape(*grid.shape, *weights.shape[1:]))
        pieces: list[Net] = []
        for number, net_row in enumerate(net_grid):
            # `split` divides along the first axis; the patches of the row are along the second.
            weight_row = None if weight_grid is None else weight_grid[number].swapaxes(0, 1)
            net: Net = net_row.swapaxes(0, 1), weight_row
            last_cut = 0.0
            for t in at[span == number].tolist():
                piece, net = split(net, (t - last_cut) / (1 - last_cut))
                pieces.append(piece)
                last_cut = t
            pieces.append(net)
        points = stack([piece for piece, _ in pieces], nets.shape[1:])
        if weights is None:
            return points, None
        return points, stack([w for _, w in pieces if w is not None], weights.shape[1:])

    points, weights = divide(batch.points, batch.weights)
    channels = tuple(replace(c, nets=divide(c.nets, None)[0]) for c in batch.channels)
    repeats = 1 + np.bincount(span, minlength=grid.shape[axis])
    cut_batch = replace(batch, points=points, weights=weights, channels=channels)
    return cut_batch, np.repeat(grid, repeats, axis=axis)
