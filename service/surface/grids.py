"""Grids of vertex indices, one grid for each patch; and named parts, which list patches.

A list of P grids is an array (P, p+1, q+1) if all patches have one degree (p, q). Otherwise it is a
tuple of P arrays (p+1, q+1). Other modules compute the grids of one degree at a time
(`group_by_degree`).
"""

from collections.abc import Callable, Sequence
from itertools import chain
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import Ints
from service.errors import MAX_ISSUES, InvalidRequest, Issue, pointer
from service.surface.checks import check_grid
from service.surface.lowered import Part

IndexGrid: TypeAlias = NDArray[np.int64]
Grids: TypeAlias = IndexGrid | tuple[IndexGrid, ...]

NO_GRIDS: IndexGrid = np.empty((0, 2, 2), dtype=np.int64)


def validate_grids(values: IndexGrid | Sequence[IndexGrid]) -> Grids:
    """A list of grids as read-only copies: one array if all degrees are equal, else a tuple.

    Raises
    ------
    InvalidRequest
        `too_few_points` or `degree_too_high`.
    """
    if isinstance(values, np.ndarray):
        return _validate(values, "patches", 3)
    if not values:
        return NO_GRIDS
    grids = [_validate(grid, f"patches/{k}", 2) for k, grid in enumerate(values)]
    if len({grid.shape for grid in grids}) > 1:
        return tuple(grids)
    return _validate(np.stack(grids), "patches", 3)


def group_by_degree(grids: Grids) -> tuple[tuple[Ints, IndexGrid], ...]:
    """Group grids by their degree.

    Returns
    -------
    tuple of (numbers, grids), one for each degree, in the order in which degrees first occur
        For K patches of degree (p, q): their numbers, shape (K,), and their grids, shape (K, p+1,
        q+1).
    """
    if isinstance(grids, np.ndarray):
        return ((np.arange(len(grids)), grids),) if len(grids) else ()
    numbers: dict[tuple[int, ...], list[int]] = {}
    for number, grid in enumerate(grids):
        numbers.setdefault(grid.shape, []).append(number)
    return tuple(
        (np.array(group, np.intp), np.stack([grids[k] for k in group]))
        for group in numbers.values()
    )


def map_grids(grids: Grids, change: Callable[[IndexGrid], IndexGrid]) -> Grids:
    """Apply a function of arrays (K, rows, columns) to a list of grids."""
    if isinstance(grids, np.ndarray):
        return change(grids)
    return tuple(change(grid[np.newaxis])[0] for grid in grids)


def check_indices(grids: Grids, count: int, name: str) -> None:
    """Refuse indices outside 0 … count − 1. So −1 is refused, although NumPy allows −1."""
    if not isinstance(grids, np.ndarray):
        for number, grid in enumerate(grids):
            check_indices(grid, count, f"{name}/{number}")
        return
    # Viewed as unsigned integers, negative indices are the largest.
    if not grids.size or np.maximum.reduce(grids.view(np.uint64), axis=None) < count:
        return
    positions = np.argwhere((grids < 0) | (grids >= count))[:MAX_ISSUES]
    raise InvalidRequest(
        *(
            Issue(
                "index_out_of_range",
                "Patches index the list of vertices from 0.",
                f"/{name}" + pointer(position),
                str(grids[tuple(position)]),
                f"0 to {count - 1}",
            )
            for position in positions.tolist()
        )
    )


def _validate(values: IndexGrid, name: str, axes: int) -> IndexGrid:
    """Check an array of indices with `axes` axes; the last two are rows and columns of a grid."""
    grids = np.array(values, dtype=np.int64, order="C")
    if grids.ndim != axes:
        raise InvalidRequest(
            Issue(
                "too_few_points",
                "Every patch is a grid of vertex indices.",
                f"/{name}",
                f"indices of shape {grids.shape}",
                "patches × rows × columns" if axes == 3 else "rows × columns",
            )
        )
    check_grid(grids.shape[-2], grids.shape[-1], name)
    grids.flags.writeable = False
    return grids


PartMembers: TypeAlias = tuple[tuple[str, tuple[int, ...]], ...]
"""Names of parts, each with the numbers of its patches."""


def first_patch(part: tuple[str, tuple[int, ...]]) -> tuple[tuple[int, ...], str]:
    """The key by which parts are sorted: the first patch (if there is one), then the name.

    The order of parts in a request means nothing, because JSON objects have no order.
    """
    name, members = part
    return members[:1], name


def order_parts(parts: PartMembers, count: int, name: str) -> tuple[Ints | None, tuple[Part, ...]]:
    """Order the patches so that the patches of each part are consecutive.

    Patches without a part come last, as a part with the name of the surface.

    Returns
    -------
    order : ndarray of int, shape (count,), or None
        Patch numbers in the new order; None if `parts` is empty: the order does not change.
    ranges : tuple of Part
        The range of each part in the new order; a part without patches is left out.
    """
    if not parts:
        return None, (Part(name, 0, count),)
    order = np.fromiter(chain.from_iterable(members for _, members in parts), np.intp)
    if len(order) < count:
        has_part = np.zeros(count, bool)
        has_part[order] = True
        order = np.concatenate([order, np.flatnonzero(~has_part)])
    runs: list[Part] = []
    first = 0
    for title, members in parts:
        if members:
            runs.append(Part(title, first, first + len(members)))
            first += len(members)
    if first < count:
        runs.append(Part(name, first, count))
    return order, tuple(runs)


def check_parts(parts: PartMembers, count: int) -> None:
    """Refuse patch numbers that are not 0 … count − 1, and a patch that is listed twice."""
    all_members = [member for _, members in parts for member in members]
    if not all_members or (
        min(all_members) >= 0
        and max(all_members) < count
        and len(set(all_members)) == len(all_members)
    ):
        return
    issues: list[Issue] = []
    seen_members: set[int] = set()
    for title, members in parts:
        for position, member in enumerate(members):
            where = pointer(("parts", title, position))
            if not 0 <= member < count:
                issues.append(
                    Issue(
                        "index_out_of_range",
                        "Parts list the numbers of patches, which begin at 0.",
                        where,
                        str(member),
                        f"0 to {count - 1}",
                    )
                )
            elif member in seen_members:
                issues.append(
                    Issue(
                        "repeated_patch",
                        "A patch belongs to at most one part.",
                        where,
                        f"patch {member} once more",
                        "each patch once",
                    )
                )
            seen_members.add(member)
            if len(issues) == MAX_ISSUES:
                raise InvalidRequest(*issues)
    if issues:
        raise InvalidRequest(*issues)
