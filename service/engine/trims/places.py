"""Places: whole numbers from 0 to 2^30 over the box of the parameter curves of each face.

A small face on a large surface keeps its digits, because the box is that of the face. Knots are
places too; between two of them a place x has the parameter (x − K_0) / (K_1 − K_0) in its patch. A
span that is shorter than a unit may begin and end at one place: no place is inside.

Proof in docs/proofs.md: "Places of trimmed faces".
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.bounds.faces import Faces
from service.engine.trims.surfaces import FaceSurfaces, evaluate_patches
from service.surface.spline_tables import find_starts

BITS = 30
SIZE = 1 << BITS
"""The box of places is this many units long and wide."""

LEAST_SHARE = 2.0**-15
"""The box of places is at least this share of the domain of the surface, in both directions. So
rounding of parameters is far below a unit, and knots are below 2^46."""

WHOLE_SHARE = 0.25
"""If the parameter curves need more than this share of the domain, the box is the whole domain;
else it is twice as long as they need."""

_STEP = 1 << (BITS + 2)
"""Distance of the keys of two knot vectors: those of one are from −1 to SIZE + 1. For 20,000 faces
they are below 2^48."""


@dataclass(frozen=True, eq=False)
class PlaceFrames:
    """The frames of the places of F faces: which parameters places stand for.

    Attributes
    ----------
    origin, extent : ndarray of float64, shape (F, 2)
        Place x stands for the parameter origin + x / SIZE · extent.
    """

    origin: FloatArray
    extent: FloatArray

    def to_places(self, face: Ints, parameters: FloatArray) -> FloatArray:
        """Places (m, 2), not rounded, of parameters (m, 2)."""
        places: FloatArray = (parameters - self.origin[face]) * (SIZE / self.extent)[face]
        return places

    def to_parameters(self, face: Ints, places: FloatArray | Ints) -> FloatArray:
        """Parameters (m, 2) of places (m, 2)."""
        parameters: FloatArray = self.origin[face] + places * (self.extent / SIZE)[face]
        return parameters


@dataclass(frozen=True, eq=False)
class Places(PlaceFrames):
    """Places of F faces, and the knots of their surfaces among them.

    Attributes
    ----------
    surfaces : FaceSurfaces
    faces : Faces
        The spans that the box touches: span (k, l) is patch `first[f] + k stride[f] + l`.
    first_knot : ndarray of int, shape (2, F)
        The knots along axis a of face f are the `faces.spans[a, f]` + 1 numbers of `knots` from
        this row on.
    knots : ndarray of int, shape (K,)
        Ascending for each axis of a face; equal where a span has no places. The first knot is at
        most 0, the second above 0, the last but one below SIZE, the last at least SIZE.
    """

    surfaces: FaceSurfaces
    faces: Faces
    first_knot: Ints
    knots: Ints

    @classmethod
    def of(cls, surfaces: FaceSurfaces, low: FloatArray, high: FloatArray) -> "Places":
        """The places over boxes [low, high], (F, 2) each, of parameters.

        Boxes are clipped to the domains, and are larger where parameter curves need little or most
        of the domain (`LEAST_SHARE`, `WHOLE_SHARE`). A box that is not finite becomes the domain.
        """
        start, end = surfaces.low, surfaces.high
        width = end - start
        low = np.where(np.isfinite(low), np.minimum(np.maximum(low, start), end), start)
        high = np.where(np.isfinite(high), np.minimum(np.maximum(high, start), end), end)
        need = np.maximum(high - low, LEAST_SHARE * width)
        middle = low + (high - low) / 2
        is_part = need < WHOLE_SHARE * width
        first = np.where(is_part, np.maximum(start, middle - need), start)
        last = np.where(is_part, np.minimum(end, middle + need), end)
        extent = last - first
        breaks = surfaces.breaks
        owner = breaks.owner
        knots = (breaks.values - first.ravel()[owner]) / extent.ravel()[owner] * SIZE
        whole = np.rint(knots).astype(np.int64)
        # The last knot at or below 0, and the first one at or above SIZE.
        begin = np.add.reduceat(whole <= 0, breaks.first, dtype=np.intp) - 1
        count = np.add.reduceat(whole < SIZE, breaks.first, dtype=np.intp) - begin
        _, rows = expand_runs(count + 1, breaks.first + begin)
        skipped, spans = begin.reshape(-1, 2), np.ascontiguousarray(count.reshape(-1, 2).T)
        stride = surfaces.faces.stride
        patch = surfaces.faces.first + skipped[:, 0] * stride + skipped[:, 1]
        first_knot = np.ascontiguousarray(find_starts(count + 1)[:-1].reshape(-1, 2).T)
        faces = Faces(patch, stride, spans)
        return cls(first, extent, surfaces, faces, first_knot, whole[rows])

    @property
    def first(self) -> Ints:
        """The patch (F,) of the first spans of each face."""
        return self.faces.first

    @property
    def stride(self) -> Ints:
        """The step (F,) from a patch to the next one along u."""
        return self.faces.stride

    def find_spans(
        self, face: Ints, axis: int, low: FloatArray | Ints, high: FloatArray | Ints
    ) -> tuple[Ints, Ints]:
        """The first and the last span (m,) along an axis that intervals [low, high] touch.

        `low` and `high` (m,) are places. A knot belongs to the span after it as `low`, and to the
        span before it as `high`. Both spans have places.
        """
        if self._is_single:
            zeros = np.zeros(len(face), np.intp)
            return zeros, zeros
        domain = 2 * face + axis
        begin = self._find_spans(domain, low, "right")
        return begin, np.maximum(self._find_spans(domain, high, "left"), begin)

    def knots_at(self, face: Ints, axis: int, span: Ints) -> tuple[Ints, Ints]:
        """The knots (m,) at which spans begin and end."""
        row = self.first_knot[axis].take(face) + span
        return self.knots.take(row), self.knots.take(row + 1)

    def locate(self, face: Ints, places: FloatArray | Ints) -> tuple[Ints, FloatArray, FloatArray]:
        """Patches (m,), their parameters (2, m) at places (m, 2), and widths (2, m) of spans.

        At a knot it is the span after the knot. Places are clamped to the box, but not on planes.
        """
        patch = self.first.take(face)
        local, width = np.empty((2, 2, len(face)))
        for axis in range(2):
            x = places[:, axis]
            if self._is_single:
                span = np.zeros(len(face), np.intp)
            else:
                span = self._find_spans(2 * face + axis, x, "right")
                patch = patch + (span * self.stride.take(face) if axis == 0 else span)
            begin, end = self.knots_at(face, axis, span)
            width[axis] = end - begin
            np.divide(x - begin, width[axis], out=local[axis])
        inside = np.minimum(np.maximum(local, 0.0), 1.0)
        is_free = self.surfaces.is_planar.take(face)
        return patch, np.where(is_free, local, inside), width

    def evaluate(self, face: Ints, places: FloatArray | Ints) -> FloatArray:
        """Points (m, 3) of the surfaces at places (m, 2)."""
        patch, local, _ = self.locate(face, places)
        return self.surfaces.nets.evaluate_points(patch, *local)

    def evaluate_partials(
        self, face: Ints, places: FloatArray | Ints, order: int = 1
    ) -> FloatArray:
        """S, S_u, S_v and, if `order` is 2, S_uu, S_uv, S_vv: shape (3 or 6, m, 3).

        Partials are with respect to places, that is, for each unit.
        """
        return evaluate_patches(self.surfaces.nets, *self.locate(face, places), order)

    def has_single_spans(self, face: Ints) -> bool:
        """Whether each of these faces (m,) is one patch in the box of its places."""
        return self._is_single or int(self.faces.spans.take(face, axis=1).max(initial=1)) == 1

    @cached_property
    def _is_single(self) -> bool:
        """Whether every face is one patch."""
        return int(self.faces.spans.max(initial=1)) == 1

    @cached_property
    def has_skipped_spans(self) -> bool:
        """Whether a span may have no places: whether two knots in a row are equal."""
        return bool((self.knots[1:] == self.knots[:-1]).any())

    @cached_property
    def _keys(self) -> Ints:
        """For each knot, `_STEP` times its knot vector 2 f + axis, and its place; ascending."""
        counts = self.faces.spans.T.ravel() + 1
        owner = np.repeat(np.arange(len(counts)), counts)
        return np.minimum(np.maximum(self.knots, -1), SIZE + 1) + owner * _STEP

    @cached_property
    def _most(self) -> Ints:
        """The last span of each knot vector 2 f + axis, (2F,)."""
        return self.faces.spans.T.ravel() - 1

    @cached_property
    def _first(self) -> Ints:
        """The first knot of each knot vector 2 f + axis, (2F,)."""
        return np.ascontiguousarray(self.first_knot.T.ravel())

    def _find_spans(self, domain: Ints, x: FloatArray | Ints, side: str) -> Ints:
        """The spans (m,) of knot vectors (m,) with places x (m,), from the side of knots."""
        inside = np.minimum(np.maximum(x, 0), SIZE)
        is_right = side == "right"
        whole = inside if inside.dtype.kind == "i" else (np.floor if is_right else np.ceil)(inside)
        key = whole.astype(np.int64) + domain * _STEP
        after = self._keys.searchsorted(key, side="right" if is_right else "left")
        span: Ints = after - 1 - self._first.take(domain)
        return np.minimum(np.maximum(span, 0), self._most.take(domain))
