"""A brep: a solid or open shells of trimmed faces, checked on creation."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import partial
from math import dist
from typing import Literal, TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue, count_nouns
from service.surface.brep_columns import BrepColumns
from service.surface.brep_lowering import lower_columns
from service.surface.brep_model import BrepModel
from service.surface.bspline import BsplineSurface
from service.surface.checks import (
    Up,
    check_metres_per_unit,
    check_uncertainties,
    check_up,
    validate_points,
)
from service.surface.curve import BsplineCurve
from service.surface.knot_tables import KnotTable
from service.surface.placement import Box, find_box
from service.surface.sizes import NUMBER, SurfaceKind, SurfaceSize
from service.surface.spline_checks import check_curves, check_surfaces
from service.surface.spline_tables import CurveTable, SurfaceTable, expand_rows, find_starts

InvalidFaces: TypeAlias = Literal["refuse", "skip"]

UNCERTAINTY_SHARE = 1e-6
"""The default uncertainty, as a share of the diagonal of the brep's outline."""

DEFAULT_NAME_BYTES = 16
"""Most bytes of the name that a part of a face without a name gets."""


_SHARED = (
    *(each.name for each in fields(BrepColumns)),
    "uncertainty", "vertex_uncertainties", "edge_uncertainties", "up", "name",
)  # fmt: skip
"""The fields that a brep and its model have in common."""


@dataclass(frozen=True, eq=False, slots=True)
class BrepSurface(BrepColumns, SurfaceKind):
    """One solid (its outer shell, then its voids) or open shells; V vertices, E edges, F faces.

    Attributes
    ----------
    uncertainty : float or None
        None becomes 1e-6 of the diagonal of the box about vertices, control points of edges, and
        the nets of faces that have no edges.
    vertex_uncertainties, edge_uncertainties : ndarray of float64, shapes (V,) and (E,), or None
        None, and each NaN, become the uncertainty of the brep.
    invalid_faces : "refuse" or "skip"
        Whether faces that fail a check are left out and listed, or refuse the brep.
    up : "y" or "z"
        The model's vertical axis.
    name : str
    metres_per_unit : float or None
        The unit of the coordinates; None if it is not known. That of a member of a group has no
        effect.

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the brep: the errors of single curves and surfaces;
        `unknown_vertex`, `unknown_edge`, `unknown_face`, `repeated_face`, `missing_face`;
        `degenerate_curve`, `edge_not_at_vertex`, `loop_open`, `used_twice_same_direction` and
        `not_closed`. If invalid faces are skipped, the last five and unknown vertices and edges
        refuse no brep.
    """

    uncertainty: float | None = None
    vertex_uncertainties: FloatArray | None = None
    edge_uncertainties: FloatArray | None = None
    invalid_faces: InvalidFaces = "refuse"
    up: Up = "y"
    name: str = "brep"
    metres_per_unit: float | None = None
    _model: BrepModel = field(init=False, repr=False)
    _size: SurfaceSize = field(init=False, repr=False)

    def __post_init__(self) -> None:
        set_field = partial(object.__setattr__, self)
        check_up(self.up)
        check_metres_per_unit(self.metres_per_unit)
        set_field("vertices", validate_points(self.vertices, "vertices", axes=2))
        for name in ("curves", "pcurves"):
            set_field(name, self._validate_curves(name))
        set_field("surfaces", self._validate_surfaces())
        self._fill_uncertainties()
        for each in fields(self):
            value = getattr(self, each.name, None)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
        columns = {name: getattr(self, name) for name in _SHARED}
        model = BrepModel(**columns, skips_invalid=self.invalid_faces == "skip")
        set_field("_model", lower_columns(model))
        set_field("_size", self._count())

    @property
    def unit(self) -> float | None:
        """Metres in one unit of the coordinates; None if this is not known."""
        return self.metres_per_unit

    def size(self) -> SurfaceSize:
        """Counts of faces, coedges and edges, and of the Bézier patches and pieces of all splines.

        A name counts twice, as that of the brep and of a part.
        """
        return self._size

    def lower(self) -> BrepModel:
        """The brep as columns, without faces that failed a check; lines have become curves."""
        return self._model

    def bounds(self) -> Box:
        """The box of vertices, control points of edges and whole nets."""
        return self._model.bounds

    def _validate_curves(self, name: Literal["curves", "pcurves"]) -> CurveTable:
        """Check the curves of edges, or the pcurves."""
        table, invalid = check_curves(getattr(self, name))
        for number in invalid.tolist():
            one = table.select(np.array([number]))
            try:
                weights = one.weights if one.is_rational[0] else None
                BsplineCurve(one.points, one.degrees.item(0), one.knots, weights)
            except InvalidRequest as error:
                raise error.within(self._locate_curve(name, number)) from None
        return table

    def _locate_curve(self, name: Literal["curves", "pcurves"], number: int) -> str:
        """The JSON pointer of the curve with a number of its table."""
        if name == "curves":
            return f"/edges/{np.flatnonzero(self.edge_curves == number)[0]}/curve"
        coedge = int(np.flatnonzero(self.coedge_pcurves == number)[0])
        starts = find_starts(self.loop_counts)
        loop = int(np.searchsorted(starts, coedge, side="right")) - 1
        face = self.loop_faces.item(loop)
        first = int(np.searchsorted(self.loop_faces, face))
        return f"/faces/{face}/loops/{loop - first}/pcurves/{coedge - starts[loop]}"

    def _validate_surfaces(self) -> SurfaceTable:
        """Check the surfaces of faces."""
        table, invalid = check_surfaces(self.surfaces)
        for number in invalid.tolist():
            where = f"/faces/{number}/surface"
            one = table.select(np.array([number]))
            (p, q), counts = one.degrees[0].tolist(), one.counts[0]
            u, v = np.split(one.knots, [one.knot_starts[1]])
            weights = one.weights.reshape(counts) if one.is_rational[0] else None
            try:
                BsplineSurface(one.points.reshape(*counts, 3), (p, q), (u, v), weights)
            except InvalidRequest as error:
                raise error.within(where) from None
            raise InvalidRequest(discontinuous_surface(f"{where}/knots"))
        return table

    def _fill_uncertainties(self) -> None:
        """Check the uncertainties; those that are not given become that of the brep."""
        uncertainty = self.uncertainty
        if uncertainty is None:
            uncertainty = UNCERTAINTY_SHARE * self._outline_diagonal()
        check_uncertainties(np.array([uncertainty]), lambda _: "/uncertainty")
        object.__setattr__(self, "uncertainty", float(uncertainty) + 0.0)
        columns: tuple[tuple[str, int, Callable[[int], str]], ...] = (
            ("vertex", len(self.vertices), "/vertex_uncertainties/{}".format),
            ("edge", len(self.edge_vertices), "/edges/{}/uncertainty".format),
        )
        for noun, count, where in columns:
            given = getattr(self, f"{noun}_uncertainties")
            values = np.full(count, np.nan) if given is None else given
            if len(values) != count:
                raise InvalidRequest(
                    Issue(
                        "wrong_length",
                        "There is one uncertainty for each vertex.",
                        f"/{noun}_uncertainties",
                        count_nouns(len(values), "numbers"),
                        str(count),
                    )
                )
            values = np.where(np.isnan(values), uncertainty, values) + 0.0
            check_uncertainties(values, where)
            object.__setattr__(self, f"{noun}_uncertainties", values)

    def _outline_diagonal(self) -> float:
        """The diagonal of the outline: vertices, edges, and nets of faces that have no edges."""
        loops = np.repeat(np.arange(len(self.loop_counts)), self.loop_counts)
        has_edges = np.zeros(len(self.surfaces), bool)
        has_edges[self.loop_faces[loops[self.coedge_edges >= 0]]] = True
        rows = expand_rows(self.surfaces.point_starts, np.flatnonzero(~has_edges))
        points = [self.vertices, self.curves.points, self.surfaces.points[rows]]
        outline = np.concatenate(points)
        if not len(outline):  # loops of edges that the brep lacks, which `lower_columns` refuses
            return 0.0
        low, high = find_box(outline)
        return dist(low.tolist(), high.tolist())

    def _count(self) -> SurfaceSize:
        """Compute the result of `size`, once, on creation."""
        model, surfaces = self._model, self.surfaces
        knots = KnotTable(surfaces.knots, surfaces.degrees.ravel(), surfaces.counts.ravel())
        spans = knots.span_counts.reshape(-1, 2)
        spline_pieces, spline_numbers = 0, 0
        for table in (model.curves, self.pcurves):
            pieces = KnotTable(table.knots, table.degrees, table.counts).span_counts
            spline_pieces += int(pieces.sum())
            spline_numbers += int((pieces * (table.degrees + 1)).sum()) * 4
        points = int((spans * (surfaces.degrees + 1)).prod(axis=1).sum())
        columns = sum(
            array.nbytes
            for owner in (model, model.curves, model.pcurves, model.surfaces)
            for array in vars(owner).values()
            if isinstance(array, np.ndarray)
        )
        names = sum(map(len, map(str.encode, self.face_names)))
        lowered = NUMBER * (4 * points + spline_numbers) + columns
        p, q = surfaces.degrees.max(axis=0).tolist()
        return SurfaceSize(
            (p, q),
            control_points=points,
            name_bytes=2 * len(self.name.encode()),
            surface_bytes=columns,
            lowered_bytes=lowered,
            peak_bytes=2 * lowered,
            nets=model.face_count,
            faces=model.face_count,
            edges=len(model.edge_vertices),
            coedges=len(model.coedge_edges),
            face_colors=len(self.palette) + bool((self.face_colors < 0).any()),
            face_patches=int(spans.prod(axis=1).sum()),
            edge_pieces=spline_pieces,
            placed_faces=model.face_count,
            defined_faces=model.face_count,
            face_name_bytes=names + DEFAULT_NAME_BYTES * model.face_count,
        )


def discontinuous_surface(where: str) -> Issue:
    """The issue for the surface of a face with degree + 1 equal knots inside its domain."""
    return Issue(
        "knot_multiplicity",
        "At degree + 1 equal knots inside its domain the surface of a face would be discontinuous; "
        "make two faces.",
        where,
        "degree + 1 equal knots",
        "at most degree equal knots inside the domain",
    )
