"""Cuts surfaces along parameter lines, as the insertion of a knot does.

A cut of a patch goes on through all patches of its surface in the same span, so that the pieces are
still a grid. The borders that no cut crosses keep their bits, and so do equal borders on both sides
of a line: each number is cut separately (`service.bases.affine_combination`).
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.polynomials import Net, split
from service.engine.joining.near_points import run_starts
from service.engine.joining.shared_curves import Cuts
from service.surface.batches import Patches, TensorPatches
from service.surface.lowered import Domain, PatchModel
from service.surface.repatched import rebuild, surfaces_of

ROUNDING = 2.0**-49
"""Bound of the error of cutting, in units of the largest coordinate: some roundings for each
degree."""


@dataclass(frozen=True, eq=False, slots=True)
class Lines:
    """Parameter lines along which surfaces are cut: all of shape (K,), in order.

    `surface` is a number among `surfaces_of`; `axis` is 0 if u is constant along the line; `at` is
    the local parameter within `span`.
    """

    surface: Ints
    axis: Ints
    span: Ints
    at: FloatArray


def lines_of(model: PatchModel, cuts: Cuts) -> Lines:
    """The lines through cuts of sides; lines with nearly equal parameters count once.

    Triangles are not cut.
    """
    surfaces = surfaces_of(model)
    first = np.array([domain.first for domain in surfaces])
    columns = np.array([len(domain.v) - 1 for domain in surfaces])
    surface = np.searchsorted(first, cuts.patch, side="right") - 1
    local_patch, axis = cuts.patch - first[surface], (cuts.side < 2).astype(np.intp)
    span = np.where(axis == 0, local_patch // columns[surface], local_patch % columns[surface])
    ends = np.cumsum([batch.count for batch in model.batches])
    grids = np.array([isinstance(batch, TensorPatches) for batch in model.batches])
    order = np.lexsort((cuts.at, span, axis, surface))
    order = order[grids[np.searchsorted(ends, cuts.patch, side="right")][order]]
    surface, axis, span, at = surface[order], axis[order], span[order], cuts.at[order]
    slack = cuts.slack[order]
    begins = np.ones(len(order), dtype=bool)
    begins[1:] = (surface[1:] != surface[:-1]) | (axis[1:] != axis[:-1]) | (span[1:] != span[:-1])
    begins[1:] |= at[1:] - at[:-1] > np.maximum(slack[1:], slack[:-1])
    return Lines(surface[begins], axis[begins], span[begins], at[begins])


def cut(model: PatchModel, lines: Lines) -> PatchModel:
    """The model with its surfaces cut along lines; parts and parameters stay."""
    surfaces = surfaces_of(model)
    starts = run_starts(lines.surface)
    stops = np.append(starts[1:], len(lines.at))
    runs = {
        number: slice(start, stop)
        for number, start, stop in zip(lines.surface[starts].tolist(), starts, stops, strict=True)
    }
    ends = np.cumsum([batch.count for batch in model.batches]).tolist()
    pieces: list[list[Patches]] = [[] for _ in model.batches]
    owners: list[Ints] = []
    domains: list[Domain] = []
    next_patch = added = 0
    for number in [*sorted(runs), len(surfaces)]:
        stop = surfaces[number].first if number < len(surfaces) else model.patch_count
        domains += [replace(d, first=d.first + added) for d in surfaces[len(domains) : number]]
        for which, end in enumerate(ends):
            begin = end - model.batches[which].count
            rows = np.arange(max(next_patch, begin), min(stop, end))
            if len(rows):
                pieces[which].append(model.batches[which].take(rows - begin))
                owners.append(rows)
        if number == len(surfaces):
            break
        domain = surfaces[number]
        which = int(np.searchsorted(ends, domain.first, side="right"))
        batch = model.batches[which]
        assert isinstance(batch, TensorPatches)
        rows = domain.first + np.arange(domain.patch_count)
        piece = batch.take(rows - (ends[which] - batch.count))
        places = runs[number]
        axis, span, at = lines.axis[places], lines.span[places], lines.at[places]
        grid = rows.reshape(len(domain.u) - 1, -1)
        knots = []
        for direction, old in enumerate((domain.u, domain.v)):
            is_across = axis == direction
            piece, grid = _cut_grid(piece, grid, direction, span[is_across], at[is_across])
            inner = old[span[is_across]] + at[is_across] * np.diff(old)[span[is_across]]
            knots.append(np.sort(np.concatenate([old, inner])))
        pieces[which].append(piece)
        owners.append(grid.ravel())
        domains.append(Domain(knots[0], knots[1], domain.first + added))
        added += grid.size - domain.patch_count
        next_patch = domain.first + domain.patch_count
    low, high = model.bounds
    degree = max(max(batch.side_degrees) for batch in model.batches)
    rounding = degree * ROUNDING * float(max(-low.min(), high.max()))
    owner = np.concatenate(owners)
    return replace(rebuild(model, pieces, owner, tuple(domains)), moved=model.moved + rounding)


def _cut_grid(
    batch: TensorPatches, grid: Ints, axis: int, span: Ints, at: FloatArray
) -> tuple[TensorPatches, Ints]:
    """A grid (M_u, M_v) of patches cut along lines of one axis, and the old patch of each piece."""
    if not len(span):
        return batch, grid

    def turn(grids: FloatArray) -> FloatArray:
        """Moves the cut direction of nets (M_u, M_v, p+1, q+1, …) to the front, or back."""
        return grids.swapaxes(0, 1).swapaxes(2, 3) if axis else grids

    def stack(rows: list[FloatArray], shape: tuple[int, ...]) -> FloatArray:
        """The rows of pieces as nets of this shape, one after another."""
        pieces = turn(np.stack([row.swapaxes(0, 1) for row in rows]))
        return np.ascontiguousarray(pieces).reshape(-1, *shape)

    def divide(nets: FloatArray, weights: FloatArray | None) -> Net:
        """The cut nets and weights of all patches."""
        net_grid = turn(nets.reshape(*grid.shape, *nets.shape[1:]))
        weight_grid = None
        if weights is not None:
            weight_grid = turn(weights.reshape(*grid.shape, *weights.shape[1:]))
        pieces: list[Net] = []
        for number, net_row in enumerate(net_grid):
            # `split` divides the first axis; the patches beside each other come after it.
            weight_row = None if weight_grid is None else weight_grid[number].swapaxes(0, 1)
            net: Net = net_row.swapaxes(0, 1), weight_row
            before = 0.0
            for t in at[span == number].tolist():
                piece, net = split(net, (t - before) / (1 - before))
                pieces.append(piece)
                before = t
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
