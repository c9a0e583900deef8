"""The measures of a whole part: a brep, or a group with breps, each as an interval.

Copies of a brep that are only moved, turned, mirrored and scaled alike are measured once. Members
without trims are measured together, as a group without breps is.

Proofs in docs/proofs.md: "Panels of trimmed faces" and "Closing the gaps of edges".
"""

from collections.abc import Sequence
from dataclasses import replace

from service.engine.joining.join import Allow, allow_any
from service.engine.measures.joined_surface import RequestSide
from service.engine.measures.measure import measure
from service.engine.measures.values import (
    MAX_LISTED,
    FaceEdge,
    MeasureQuery,
    Measures,
    PartMeasures,
)
from service.engine.parts.copies import BrepCopy, Members
from service.engine.parts.measures.brep import (
    AllowPanels,
    BrepMeasures,
    allow_all,
    measure_brep,
)
from service.engine.parts.measures.copies import find_scaling, place_measures
from service.engine.parts.measures.placed import PlacedBrep
from service.engine.parts.measures.sums import join_measures
from service.surface.brep_model import BrepModel
from service.surface.lowered import GroupModel


def measure_part(
    lowered: BrepModel | GroupModel,
    query: MeasureQuery,
    allow: Allow = allow_any,
    allow_panels: AllowPanels = allow_all,
) -> Measures[RequestSide | FaceEdge]:
    """Measure a brep, or all members of a group that has breps.

    Parameters
    ----------
    allow : callable
        As in `service.engine.measures.measure.measure`, for the members without trims.
    allow_panels : callable
        Is called for each brep that is measured; raises an error if that takes too much work.

    Raises
    ------
    InvalidRequest
        A brep is invalid; or `not_parametric`: tubes and ribbons have no measures.
    BudgetEnded
        The query is a trial, and a larger budget would change the result.
    """
    members = Members.of(lowered)
    copies = _measure_copies(members, query, allow_panels)
    others = None
    if isinstance(lowered, GroupModel) and members.patches is not None:
        others = measure(_without_breps(lowered), query, allow)
    parts = _list_parts(lowered, copies, others)
    return join_measures(members, copies, others, parts, query.tolerance)


def _measure_copies(
    members: Members, query: MeasureQuery, allow: AllowPanels
) -> list[BrepMeasures]:
    """The measures of all copies of breps; each brep is measured once for copies alike."""
    done: dict[tuple[int, bytes], BrepMeasures] = {}
    # The budget of an integral is shared by all that are measured, by their numbers of coedges.
    keys = [_find_key(copy) for copy in members.copies]
    sizes = {key: len(members.definitions[key[0]].coedge_edges) + 1 for key in keys}
    total = sum(sizes.values())
    results = []
    for copy, key in zip(members.copies, keys, strict=True):
        if key not in done:
            matrix = None if not key[1] else copy.matrix
            placed = PlacedBrep(members.definitions[key[0]], matrix)
            done[key] = measure_brep(placed, query.with_share(sizes[key] / total), allow)
        measures = done[key]
        scaling = find_scaling(copy.matrix)
        if scaling is not None and copy.matrix is not None:
            measures = place_measures(measures, copy.matrix, scaling)
        results.append(measures)
    return results


def _find_key(copy: BrepCopy) -> tuple[int, bytes]:
    """The definition of a copy, and the bytes of a matrix that does not scale lengths alike."""
    is_alike = copy.matrix is None or find_scaling(copy.matrix) is not None
    return copy.definition, b"" if is_alike or copy.matrix is None else copy.matrix.tobytes()


def _without_breps(group: GroupModel) -> GroupModel:
    """The group without its breps, with the numbers of its members in the request."""
    kept = [
        number
        for number, member in enumerate(group.members)
        if not isinstance(group.models[member.model], BrepModel)
    ]
    return replace(
        group,
        members=tuple(group.members[number] for number in kept),
        numbers=tuple(group.find_number(number) for number in kept),
        nodes=(),
        definitions=(),
    )


def _list_parts(
    lowered: BrepModel | GroupModel,
    copies: Sequence[BrepMeasures],
    others: Measures[RequestSide] | None,
) -> tuple[PartMeasures, ...]:
    """The first `MAX_LISTED` shells of a brep, or the members of a group."""
    if isinstance(lowered, BrepModel):
        (measures,) = copies
        count = len(measures.areas) - 1
        if count == 1:
            return (PartMeasures(lowered.name, measures.areas[0], *measures.solids[0]),)
        return tuple(
            PartMeasures(f"shell {k}", measures.areas[k + 1], *measures.solids[k + 1])
            for k in range(min(count, MAX_LISTED))
        )
    breps, patches = iter(copies), iter(() if others is None else others.parts)
    parts = []
    for member in lowered.members:
        if isinstance(lowered.models[member.model], BrepModel):
            measures = next(breps)
            parts.append(PartMeasures(member.name, measures.areas[0], *measures.solids[0]))
        else:
            parts.append(next(patches))
    return tuple(parts)
