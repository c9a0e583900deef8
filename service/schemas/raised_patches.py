"""Raises the patches of a `patches` surface until all their weights are positive.

Patches of one degree are raised alike, so that neighbours keep equal borders. A raised patch has
control points of its own; equal ones become one vertex again.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, Ints
from service.bases.raising import Direction, Raising, TriangleDirection
from service.bases.row_batches import find_first_rows
from service.bases.triangle import degree_of
from service.errors import InvalidRequest
from service.schemas.document import DocumentLimits
from service.schemas.raising import (
    bezier_directions,
    least_of_patches,
    least_of_triangles,
    plan_net,
)
from service.schemas.validation import to_refusal
from service.surface.channels import Channels
from service.surface.convert.nets import map_channels
from service.surface.grids import NO_GRIDS, Grids, check_indices, group_by_degree


@dataclass(frozen=True)
class RaisedForm:
    """Patches of one degree: their numbers, their vertices (K, …), and how they are raised."""

    numbers: Ints
    indices: NDArray[np.int64]
    raising: Raising

    @property
    def point_count(self) -> int:
        """The number of control points of all patches, raised."""
        return len(self.indices) * self.raising.point_count


@dataclass(frozen=True)
class RaisedPatches:
    """How the patches of a surface are raised.

    Attributes
    ----------
    patches, triangles : Grids and ndarray of int64
        As in the document.
    forms : sequence of RaisedForm
        Grids of each degree, and then the triangles if there are any; empty if all weights are
        positive and nothing is raised.
    """

    patches: Grids
    triangles: NDArray[np.int64]
    forms: Sequence[RaisedForm]

    @property
    def point_count(self) -> int | None:
        """The number of control points of all patches, raised; None if nothing is raised."""
        return sum(form.point_count for form in self.forms) or None

    def apply(
        self, values: FloatArray, channels: Channels
    ) -> tuple[FloatArray, Grids, NDArray[np.int64], Channels]:
        """The values of all vertices, the grids and triangles of their numbers, and the channels.

        `values` are the homogeneous vertices (V, 4).
        """
        if not self.forms:
            return values, self.patches, self.triangles, channels
        index_count = sum(form.indices.size for form in self.forms)
        channels.check_per_vertex(len(values), index_count)
        nets = [values, *(net for *_, net in channels.each())]
        rows = np.empty(
            (sum(form.point_count for form in self.forms), sum(n.shape[1] for n in nets))
        )
        columns = np.split(rows, np.cumsum([net.shape[1] for net in nets])[:-1], axis=1)
        for net, column in zip(nets, columns, strict=True):
            first_row = 0
            for form in self.forms:
                raised = form.raising.apply(net[form.indices]).reshape(-1, net.shape[1])
                column[first_row : first_row + len(raised)] = raised
                first_row += len(raised)
        rows += 0.0  # −0 becomes 0
        first, numbers = find_first_rows(rows)
        new_values, *nets = [column[first] for column in columns]
        raised_nets = iter(nets)
        parts = np.split(numbers, np.cumsum([form.point_count for form in self.forms])[:-1])
        shapes = list[tuple[Ints, NDArray[np.int64]]]()
        triangles = self.triangles
        for form, part in zip(self.forms, parts, strict=True):
            pairs = zip(form.raising.directions, form.raising.degrees, strict=True)
            lengths = [direction.count(degree) for direction, degree in pairs]
            indices = part.reshape(-1, *lengths).astype(np.int64, copy=False)
            if len(lengths) == 1:
                triangles = indices
            else:
                shapes.append((form.numbers, indices))
        patches = _list_grids(shapes)
        return new_values, patches, triangles, map_channels(channels, lambda _: next(raised_nets))


def _list_grids(shapes: Sequence[tuple[Ints, NDArray[np.int64]]]) -> Grids:
    """Grids in the order of their numbers: one array if all have one shape, else a tuple."""
    if not shapes:
        return NO_GRIDS
    if len(shapes) == 1:
        return shapes[0][1]
    grids = {
        n: grid for numbers, each in shapes for n, grid in zip(numbers.tolist(), each, strict=True)
    }
    return tuple(grids[number] for number in sorted(grids))


def plan_patches(
    weights: FloatArray,
    patches: Grids,
    triangles: NDArray[np.int64],
    field: str,
    limits: DocumentLimits,
) -> RaisedPatches:
    """How patches are raised; `weights` (V,) are those of the vertices, in the field `field`."""
    if (weights > 0).all():
        return RaisedPatches(patches, triangles, ())
    try:
        check_indices(patches, len(weights), "patches")
        check_indices(triangles, len(weights), "triangles")
    except InvalidRequest as error:
        raise to_refusal(((), issue) for issue in error.issues) from None
    groups = [*group_by_degree(patches)]
    if len(triangles):
        groups.append((np.arange(len(patches), len(patches) + len(triangles)), triangles))
    left = sum(indices.size for _, indices in groups)
    forms = list[RaisedForm]()
    for numbers, indices in groups:
        left -= indices.size
        raising = _plan_form(
            weights,
            numbers,
            indices,
            field=field,
            others=left + sum(form.point_count for form in forms),
            limits=limits,
        )
        forms.append(RaisedForm(numbers, indices, raising))
    return RaisedPatches(patches, triangles, forms)


def _plan_form(
    weights: FloatArray,
    numbers: Ints,
    indices: NDArray[np.int64],
    *,
    field: str,
    others: int,
    limits: DocumentLimits,
) -> Raising:
    """How patches of one degree are raised; `others` are the control points of other degrees."""
    own = weights[indices]
    wrong = np.flatnonzero((own <= 0).reshape(len(own), -1).any(axis=1))
    nets = own[wrong] if len(wrong) else own[:1]
    directions: Sequence[Direction]
    if indices.ndim == 2:
        degree, least = degree_of(indices.shape[1]), least_of_triangles
        directions, ends = [TriangleDirection(1, degree)], indices[:, [0, degree, -1]]
    else:
        directions, least = bezier_directions(own.shape[1:], 1), least_of_patches
        ends = indices[:, [0, -1]][:, :, [0, -1]]
    corners = np.unique(ends)
    return plan_net(
        nets,
        directions,
        limits,
        corners=[(field, number) for number in corners[weights[corners] <= 0].tolist()],
        look=lambda: least(nets, numbers[wrong].tolist()),
        copies=len(own),
        others=others,
        largest=float(weights.max()),
    )
