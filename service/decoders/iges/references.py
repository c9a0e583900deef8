"""Which entities refer to which: what is a root of the file, and what has been read.

References
----------
IGES 5.3, sections 4.3, 4.17 to 4.20, 4.25, 4.31 to 4.35, 4.43 to 4.54, 4.69 (308), 4.90 (402) and
4.127 (408): the parameters of entities that refer to others.
"""

from collections.abc import Callable, Iterable

from service.decoders.iges.entities import Entity, IgesFile
from service.decoders.iges.faults import Fault

GROUP = 402
GROUP_FORMS = frozenset({1, 7, 14, 15})
"""The forms of associativities that are groups."""


def list_children(file: IgesFile, number: int) -> list[int]:
    """The entities that an entity consists of; none if it is damaged or refers to no others.

    Matrices, colours and other attributes are left out.
    """
    kind = file.type(number)
    if kind not in _CHILDREN:
        return []
    try:
        return [child for child in _CHILDREN[kind](file.read(number)) if child]
    except Fault:
        return []


def find_owned(file: IgesFile) -> set[int]:
    """The entities that others consist of; being in a group makes no difference."""
    owned: set[int] = set()
    for row, kind in enumerate(file.directory.types.tolist()):
        if kind in _CHILDREN and kind != GROUP:
            owned.update(list_children(file, 2 * row + 1))
    return owned


def find_reached(file: IgesFile, roots: Iterable[int]) -> set[int]:
    """The entities of which roots consist, directly or not, and the roots themselves."""
    reached = set(roots)
    pending = list(reached)
    while pending:
        for child in list_children(file, pending.pop()):
            if child not in reached:
                reached.add(child)
                pending.append(child)
    return reached


def _at(*positions: int) -> Callable[[Entity], list[int]]:
    """Pointers at some positions."""
    return lambda entity: [entity.parameters.pointer(position) for position in positions]


def _listed(
    count: int, *positions: int, start: int, stride: int = 1
) -> Callable[[Entity], list[int]]:
    """Pointers at some positions, and in a list whose length is at the position `count`."""

    def read(entity: Entity) -> list[int]:
        parameters = entity.parameters
        items = parameters.pointers(start, parameters.count(count, stride), stride)
        return [*map(parameters.pointer, positions), *items]

    return read


def _read_group(entity: Entity) -> list[int]:
    return _listed(0, start=1)(entity) if entity.form in GROUP_FORMS else []


def _read_boundary(entity: Entity) -> list[int]:
    """The surface of a boundary (141), and its curves with their curves of parameters."""
    parameters = entity.parameters
    found, position = [parameters.pointer(2)], 4
    for _ in range(parameters.count(3)):
        count = parameters.count(position + 2)
        found += [parameters.pointer(position), *parameters.pointers(position + 3, count)]
        position += 3 + count
    return found


def _read_loop(entity: Entity) -> list[int]:
    """The lists of edges and vertices of a loop (508), and its curves of parameters."""
    parameters = entity.parameters
    found, position = [], 1
    for _ in range(parameters.count(0, 5)):
        count = parameters.count(position + 4)
        found += [parameters.pointer(position + 1)]
        found += parameters.pointers(position + 6, count, 2)
        position += 5 + 2 * count
    return found


def _read_edges(entity: Entity) -> list[int]:
    """The curves of a list of edges (504), and the lists of their vertices."""
    parameters = entity.parameters
    count = parameters.count(0, 5)
    found = [parameters.pointers(start, count, 5) for start in (1, 2, 4)]
    return [*found[0], *dict.fromkeys(found[1] + found[2])]


_CHILDREN: dict[int, Callable[[Entity], list[int]]] = {
    102: _listed(0, start=1),
    108: _at(4),
    118: _at(0, 1),
    120: _at(0, 1),
    122: _at(0),
    130: _at(0, 2),
    140: _at(4),
    141: _read_boundary,
    142: _at(1, 2, 3),
    143: _listed(2, 1, start=3),
    144: _listed(2, 0, 3, start=4),
    184: _listed(0, start=1),
    186: _listed(2, 0, start=3, stride=2),
    190: _at(0, 1, 2),
    192: _at(0, 1, 3),
    194: _at(0, 1, 4),
    196: _at(0, 2, 3),
    198: _at(0, 1, 4),
    308: _listed(2, start=3),
    GROUP: _read_group,
    408: _at(0),
    430: _at(0),
    504: _read_edges,
    508: _read_loop,
    510: _listed(1, 0, start=3),
    514: _listed(0, start=1, stride=2),
}
"""How to find the children of an entity, by its type."""
