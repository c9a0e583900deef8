"""Open edges as borders: chains of edges, each of which begins where the one before it ends."""

import numpy as np

from service.bases.arrays import Ints


def chain_edges(begins: Ints, ends: Ints) -> list[tuple[list[int], bool]]:
    """Edges with corners (m,) at which they begin and end, as chains in the order of their first.

    A chain is a list of edges, and whether the last one ends where the first one begins. If several
    edges begin at a corner, a chain continues with the unused edge of the least number. If none
    does, it continues with one that ends there, and passes it in the other direction: where the
    surface changes side, its border is one curve all the same.
    """
    count = len(begins)
    corners = np.stack([begins, ends])
    # The edges that begin at each corner, and those that end there, the least number last.
    at_corner: tuple[dict[int, list[int]], dict[int, list[int]]] = ({}, {})
    for end, edges in enumerate(at_corner):
        for k in reversed(range(count)):
            edges.setdefault(int(corners[end, k]), []).append(k)
    is_used = [False] * count

    def pass_next(corner: int) -> tuple[int, int] | None:
        """The next edge, and the end at which it is left: 1, or 0 in the other direction."""
        for end, edges in enumerate(at_corner):
            waiting = edges.get(corner, [])
            while waiting:
                k = waiting.pop()
                if not is_used[k]:
                    is_used[k] = True
                    return k, 1 - end
        return None

    # Begin first at corners that only one edge has: a beginning in the middle of a border would
    # divide it.
    uses = np.bincount(corners.ravel())[corners] if count else corners
    loose = np.flatnonzero(uses[0] == 1), np.flatnonzero(uses[1] == 1)
    starts = [(k, end) for end in (0, 1) for k in loose[end].tolist()]
    chains = []
    for start, end in (*starts, *((k, 0) for k in range(count))):
        if is_used[start]:
            continue
        is_used[start] = True
        chain, first_corner, corner = (
            [start],
            int(corners[end, start]),
            int(corners[1 - end, start]),
        )
        while corner != first_corner:
            following = pass_next(corner)
            if following is None:
                break
            chain.append(following[0])
            corner = int(corners[following[1], following[0]])
        chains.append((chain, corner == first_corner))
    return sorted(chains)
