"""Faces cut into cells, until each cell is near enough to two triangles.

A cell is a box of places of a face. It is cut at the middle; where it spans several patches, at
the knot nearest the middle: so neighbouring patches that are flat stay one cell. What becomes of a
cell depends on that cell alone.
"""

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.cutting.boxes import SHORTEST, Cells, Leaves
from service.engine.adaptive.cutting.estimate import judged
from service.engine.adaptive.cutting.halving import halve, over
from service.engine.adaptive.cutting.spans import flattened
from service.engine.adaptive.cutting.task import Task
from service.engine.adaptive.cutting.turning import scale
from service.engine.bounds.faces import SPAN
from service.engine.bounds.patch_nets import Nets

BLOCK = 1 << 18
"""Numbers in the nets that are worked on at a time, about."""

OVERHEAD = 20
"""Multiplications for every number of a net, beside those that halving takes."""

AHEAD = 1 << 13
"""Numbers of cells and their halves up to which both are judged in one step."""

TURNS = 2500
"""Those that comparing the normals of a cell takes."""


def divided(task: Task, start: Cells) -> Leaves:
    """The leaves of cells, cut as often as it takes; `Budget` and `too_deep` tell what it raises.

    Parameters
    ----------
    start : Cells
        Faces as a whole, or pieces of them, as cutting makes them.

    Returns
    -------
    Leaves
        In the order of face, u0, v0. The same, bit for bit, whatever other cells there are.
    """
    if not len(start):
        return Leaves.none()
    found: list[Leaves] = []
    several = np.any(start.box[1::2] - start.box[::2] > SPAN, axis=0)
    if several.any():
        found, rest = flattened(task, start.take(several))
        start = Cells.joined([start.take(~several), *rest])
    for nets, here in task.ground.by_group(task.patch_of(start)):
        found += _divided(task, start.take(here), nets)
    return Leaves.joined(found)


def _divided(task: Task, start: Cells, nets: Nets) -> Iterator[Leaves]:
    """Leaves of cells of one span and one degree, deepest first and a block at a time."""
    degrees = max(nets.degree[0], 2), max(nets.degree[1], 2)
    numbers = (degrees[0] + 1) * (degrees[1] + 1) * nets.values.shape[2]
    block = max(16, BLOCK // numbers)
    angles = task.goal.angle < np.pi
    patches = task.patch_of(start)
    waiting: list[_Level] = [
        (start.take(rows), patches[rows], None)
        for rows in (slice(k, k + block) for k in reversed(range(0, len(start), block)))
    ]
    leaves = 0
    while waiting:
        cells, patch, net = waiting.pop()
        if net is None:
            net = over(nets.take(task.ground.row[patch]), cells)
        parts = [(cells, patch, net)]
        total = len(cells)
        while waiting and (more := waiting[-1][2]) is not None and total + more.shape[3] <= block:
            parts.append((*waiting.pop()[:2], more))
            total += more.shape[3]
        if len(parts) > 1:
            cells = Cells.joined([part[0] for part in parts])
            patch = np.concatenate([part[1] for part in parts])
            net = np.concatenate([part[2] for part in parts], axis=3)
        known = len(cells)
        ahead = 5 * net.size <= AHEAD and _is_long(cells)
        if ahead:
            cells, patch, net = _with_halves(cells, patch, net)
        turns = TURNS * len(cells) if angles else 0
        task.budget.spend(net.size * (sum(degrees) + OVERHEAD) + turns)
        size = scale(cells.box / SPAN, task.ground.sizes[patch]) if angles else None
        verdict = judged(net, task.goal, task.eye_of(patch), size)
        done, cut = (~verdict.fails[:known]).nonzero()[0], verdict.fails[:known].nonzero()[0]
        if ahead and len(cut):
            # Halves are known as well: those across u, and those across v.
            half = known + cut + 2 * known * verdict.along_v[cut]
            half = np.concatenate([half, half + known])
            done = np.concatenate([done, half[~verdict.fails[half]]])
            cut = half[verdict.fails[half]]
        if len(done):
            yield Leaves(cells, verdict.along_v, verdict.rising, verdict.form).take(done)
            leaves += len(done)
            task.budget.count(leaves)
        if not len(cut):
            continue
        halves, twice, made = _halved(cells, patch, net, cut, verdict.along_v[cut])
        waiting += [
            (halves.take(rows), twice[rows], made[..., rows])
            for rows in (slice(k, k + block) for k in range(0, len(halves), block))
        ]


def _halved(
    cells: Cells, patch: Ints, net: FloatArray, cut: Ints, along_v: Bools
) -> tuple[Cells, Ints, FloatArray]:
    """Halves of some cells: first those across u, then those across v."""
    order = np.argsort(along_v, kind="stable")
    cut, along_v, count = cut[order], along_v[order], len(cut)
    made = np.empty((*net.shape[:3], 2 * count))
    both = made.reshape(*net.shape[:3], 2, count)
    middle = count - int(np.count_nonzero(along_v))
    for axis, rows in enumerate((slice(0, middle), slice(middle, None))):
        if len(cut[rows]):
            halve(net[..., cut[rows]], axis, both[..., rows])
    return Cells.joined([*cells.take(cut).halved(along_v)]), np.tile(patch[cut], 2), made


def _is_long(cells: Cells) -> bool:
    """Whether all cells may be halved at least twice either way."""
    return bool((cells.box[1::2] - cells.box[::2]).min(initial=SPAN) >= 4 * SHORTEST)


def _with_halves(cells: Cells, patch: Ints, net: FloatArray) -> tuple[Cells, Ints, FloatArray]:
    """Few cells, then their halves across u, first ones and second ones, and those across v.

    A step takes as long for five as for one of them, so two levels are judged at once.
    """
    count = len(cells)
    made = np.empty((*net.shape[:3], 5 * count))
    made[..., :count] = net
    parts = [cells]
    for axis in (0, 1):
        begin = (1 + 2 * axis) * count
        halve(net, axis, made[..., begin : begin + 2 * count].reshape(*net.shape[:3], 2, count))
        parts += cells.halved(np.full(count, axis == 1))
    return Cells.joined(parts), np.tile(patch, 5), made


_Level: TypeAlias = tuple[Cells, Ints, FloatArray | None]
"""Cells, their patches, and their nets unless they are still to be made."""
