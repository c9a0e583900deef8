"""Parts of trimmed faces that share edges: one part for faces that are connected.

In IGES the normal of a trimmed face is that of its surface, so neighbours may have opposite ones.
Here the faces of a part are turned so that along each edge two faces run in opposite directions,
and those of a closed part so that their normals point outwards.

References
----------
Hoppe et al., Surface reconstruction from unorganized points, SIGGRAPH 1992: consistent orientation
by propagation over neighbours.
"""

from collections import defaultdict
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import dist

from service.decoders.cad.content import Coedge
from service.decoders.cad.frames import Vector
from service.decoders.cad.parts import PartBuilder
from service.decoders.cad.splines import find_ends, project_points
from service.decoders.iges.attributes import Attributes
from service.decoders.iges.feet import is_closed_surface
from service.decoders.iges.joining import EdgeUse, Joined
from service.decoders.iges.trimmed import TrimmedFace
from service.decoders.iges.volumes import is_inside_out


@dataclass(frozen=True, slots=True)
class Component:
    """Connected faces.

    Attributes
    ----------
    faces : tuple of int
    is_turned : tuple of bool
        Whether the normal of each face is opposite to du × dv.
    is_closed : bool
        Whether each edge has two sides, in opposite directions.
    open_edges : int
        The number of edges with one side.
    """

    faces: tuple[int, ...]
    is_turned: tuple[bool, ...]
    is_closed: bool
    open_edges: int


def find_components(
    joined: Joined, faces: Sequence[TrimmedFace], faults: Container[int]
) -> list[Component]:
    """The connected components of faces without faults, in the order of their first faces."""
    uses: dict[int, list[tuple[int, bool]]] = defaultdict(list)
    for number, loops in enumerate(joined.loops):
        for use in _list_edges(loops):
            uses[use.edge].append((number, use.is_reversed))
    is_turned: dict[int, bool] = {}
    components = []
    for number in range(len(faces)):
        if number not in is_turned and number not in faults:
            members = _grow(number, joined, uses, is_turned)
            components.append(_finish(members, joined, uses, is_turned, faces))
    return components


def add_component(
    component: Component,
    joined: Joined,
    faces: Sequence[TrimmedFace],
    attributes: Attributes,
    builder: PartBuilder,
) -> None:
    """Add the faces of a component to a part, as a shell."""
    numbers = []
    for number, is_turned in zip(component.faces, component.is_turned, strict=True):
        face = faces[number]
        builder.note_gap(face.gap)
        loops = [
            [_add_coedge(builder, joined, use) for use in loop]
            for loop in ([] if _is_whole(face, joined.loops[number]) else joined.loops[number])
        ]
        numbers.append(
            builder.add_face(
                face.surface,
                loops,
                is_reversed=is_turned,
                turns_with_face=False,
                name=attributes.find_name(face.number),
                color=attributes.find_color(face.number),
            )
        )
    builder.add_shell(numbers, component.is_closed)


def _grow(
    first: int,
    joined: Joined,
    uses: Mapping[int, Sequence[tuple[int, bool]]],
    is_turned: dict[int, bool],
) -> list[int]:
    """The faces that are connected with a face; each is turned to fit the one before it."""
    is_turned[first] = False
    members = [first]
    for number in members:  # grows while it is read
        for use in _list_edges(joined.loops[number]):
            for other, is_reversed in uses[use.edge]:
                if other not in is_turned:
                    is_same = is_reversed == use.is_reversed
                    is_turned[other] = is_turned[number] != is_same
                    members.append(other)
    return members


def _finish(
    members: Sequence[int],
    joined: Joined,
    uses: Mapping[int, Sequence[tuple[int, bool]]],
    is_turned: Mapping[int, bool],
    faces: Sequence[TrimmedFace],
) -> Component:
    edges = {use.edge for number in members for use in _list_edges(joined.loops[number])}
    open_edges = sum(len(uses[edge]) < 2 for edge in edges)
    is_consistent = all(
        (first[1] != is_turned[first[0]]) != (second[1] != is_turned[second[0]])
        for first, second in (uses[edge] for edge in edges if len(uses[edge]) == 2)
    )
    is_closed = not open_edges and is_consistent
    if not edges:
        is_closed = all(is_closed_surface(faces[number].surface) for number in members)
    turned = [is_turned[number] for number in members]
    if is_closed:
        is_wrong = is_inside_out(
            [
                (faces[number].surface, faces[number].polygons, is_turned[number])
                for number in members
            ],
            project_points(faces[members[0]].surface.points[0, 0]),
        )
    else:
        is_wrong = 2 * sum(turned) > len(turned)
    if is_wrong:
        turned = [not flag for flag in turned]
    order = sorted(range(len(members)), key=members.__getitem__)
    return Component(
        tuple(members[position] for position in order),
        tuple(turned[position] for position in order),
        is_closed,
        open_edges,
    )


def _list_edges(loops: Sequence[Sequence[EdgeUse]]) -> Iterator[EdgeUse]:
    """The uses of edges that are no poles."""
    return (use for loop in loops for use in loop if use.edge >= 0)


def _is_whole(face: TrimmedFace, loops: Sequence[Sequence[EdgeUse]]) -> bool:
    """Whether a face is a surface without borders, and its loops are seams and poles."""
    counts: dict[int, int] = defaultdict(int)
    for use in _list_edges(loops):
        counts[use.edge] += 1
    return all(count == 2 for count in counts.values()) and is_closed_surface(face.surface)


def _add_coedge(builder: PartBuilder, joined: Joined, use: EdgeUse) -> Coedge:
    if use.edge < 0:
        vertex = builder.add_vertex(use.vertex, _point(joined, use.vertex))
        pole = builder.add_pole(("pole", builder.face_count, use.vertex), vertex)
        return Coedge(pole, use.is_reversed, use.pcurve)
    number = builder.find_edge(use.edge)
    if number is None:
        edge = joined.edges[use.edge]
        points = [_point(joined, vertex) for vertex in edge.vertices]
        first, last = map(builder.add_vertex, edge.vertices, points)
        ends = find_ends(edge.curve)
        gap = max(map(dist, ends.tolist(), points))
        is_line = len(edge.curve.points) == 2 and first != last
        builder.note_gap(edge.distance)
        number = builder.add_edge(
            use.edge,
            (first, last),
            None if is_line else edge.curve,
            gap=gap,
            uncertainty=edge.distance if edge.distance > (builder.uncertainty or 0.0) else None,
        )
    return Coedge(number, use.is_reversed, use.pcurve)


def _point(joined: Joined, vertex: int) -> Vector:
    x, y, z = joined.points[vertex].tolist()
    return x, y, z
