"""The surfaces of all faces as patches of one model, evaluated at parameters of their own domains.

A plane (a bilinear surface that is affine) is one patch, whose domain is moved to wherever the
parameter curves of its face are.

Proof in docs/proofs.md: "Lowered splines".
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.bounds.faces import Faces
from service.engine.nets.partials import evaluate_partials
from service.engine.nets.patch_nets import PatchNets
from service.engine.trims.lowering import lower_surfaces, move_plane_corners
from service.engine.trims.spans import Breaks, find_breaks, list_spans
from service.surface.batches import Patches, TensorPatches
from service.surface.lowered import Domain, Part, PatchModel
from service.surface.spline_tables import SurfaceTable

BEND = 1e-12
"""A bilinear surface is a plane if P_00 − P_01 − P_10 + P_11 is at most this share of its largest
coordinate."""

MARGIN = 2.0**-10
"""The domains of planes are wider than the boxes of parameter curves by this share on each side."""


@dataclass(frozen=True, eq=False)
class FaceSurfaces:
    """The surfaces of F faces.

    Attributes
    ----------
    model : PatchModel
        A tensor patch for each pair of spans: one batch for each degree.
    nets : PatchNets
    faces : Faces
        Span (k, l) of face f is patch `first[f] + k stride[f] + l`.
    breaks : Breaks
        The knots between spans; those along axis a of face f belong to domain 2 f + a.
    is_planar : ndarray of bool, shape (F,)
        Whether a surface is affine in its parameters, up to `errors`.
    errors : ndarray of float64, shape (F,)
        Bounds of the distances between the patches and the surfaces of the request.
    """

    model: PatchModel
    nets: PatchNets
    faces: Faces
    breaks: Breaks
    is_planar: Bools
    errors: FloatArray

    @classmethod
    def of(cls, table: SurfaceTable, name: str = "brep") -> "FaceSurfaces":
        """All surfaces of a table, lowered to Bézier patches."""
        count = len(table)
        degrees = table.degrees.ravel()
        position, owner = list_spans(table.knots, degrees, table.knot_starts)
        breaks = find_breaks(table.knots, position, owner, 2 * count)
        batches, first, errors = lower_surfaces(table, position, breaks)
        spans = breaks.count.reshape(-1, 2)
        faces = Faces(first, spans[:, 1].copy(), np.ascontiguousarray(spans.T))
        is_planar = (table.degrees == 1).all(axis=1) & (table.counts == 2).all(axis=1)
        is_planar &= ~table.is_rational
        planes = is_planar.nonzero()[0]
        corners = table.points[table.point_starts[planes][:, np.newaxis] + np.arange(4)]
        bend = np.abs(corners[:, 0] - corners[:, 1] - corners[:, 2] + corners[:, 3])
        size = np.abs(corners).max(axis=(1, 2), initial=0.0)
        is_affine = bend.max(axis=1, initial=0.0) <= BEND * size
        is_planar[planes[~is_affine]] = False
        errors[planes] = np.where(is_affine, bend.sum(axis=1) + 2.0**-49 * size, 0.0)
        model, nets = build_nets(batches, name, errors)
        return cls(model, nets, faces, breaks, is_planar, errors)

    def __len__(self) -> int:
        return len(self.is_planar)

    def list_domains(self) -> tuple[Domain, ...]:
        """The domain of each surface, with the numbers of its patches."""
        knots = np.split(self.breaks.values, self.breaks.first[1:])
        first = self.faces.first.tolist()
        return tuple(
            Domain(u, v, number)
            for u, v, number in zip(knots[::2], knots[1::2], first, strict=True)
        )

    @property
    def low(self) -> FloatArray:
        """The least parameters (F, 2) of the domains."""
        return self.breaks.start.reshape(-1, 2)

    @property
    def high(self) -> FloatArray:
        """The greatest parameters (F, 2) of the domains."""
        return self.breaks.end.reshape(-1, 2)

    def move_planes(self, low: FloatArray, high: FloatArray) -> "FaceSurfaces":
        """The surfaces after the domains of planes have become [low, high], (F, 2) each.

        The domains become a little wider than that. Planes with low = high in both directions, or
        without a finite box, keep their domains.
        """
        planes = self.is_planar.nonzero()[0]
        old_low, width = self.low[planes], (self.high - self.low)[planes]
        new_low, new_high = low[planes], high[planes]
        side = new_high - new_low
        is_moved = np.isfinite(side).all(axis=1) & (side > 0).any(axis=1)
        planes = planes[is_moved]
        if not len(planes):
            return self
        old_low, width, new_low, side = (x[is_moved] for x in (old_low, width, new_low, side))
        # A side is at least a thousandth of the other one, measured in space.
        corners = self.model.batches[0].points[self.faces.first[planes]]
        along = np.stack([corners[:, 1, 0], corners[:, 0, 1]], axis=1) - corners[:, :1, 0]
        speed = np.sqrt(np.square(along).sum(axis=2)) / width
        fastest = np.maximum(speed.max(axis=1, keepdims=True), np.finfo(np.float64).tiny)
        speed = np.where(speed > 2.0**-40 * fastest, speed, fastest)
        least = 2.0**-10 * (side * speed).max(axis=1, keepdims=True) / speed
        margin = np.maximum((least - side) / 2, MARGIN * side)
        new_low, side = new_low - margin, side + 2 * margin
        points = self.model.batches[0].points.copy()
        points[self.faces.first[planes]] = move_plane_corners(
            corners, (new_low - old_low) / width, (new_low + side - old_low) / width
        )
        batch = TensorPatches(points)
        errors = self.errors.copy()
        errors[planes] += 2.0**-49 * np.abs(points[self.faces.first[planes]]).max(axis=(1, 2, 3))
        values = self.breaks.values.copy()
        at = self.breaks.first.reshape(-1, 2)[planes]
        values[at], values[at + 1] = new_low, new_low + side
        return replace(
            self,
            model=replace(self.model, batches=(batch, *self.model.batches[1:])),
            nets=self.nets.replace_first(batch, float(errors.max())),
            breaks=replace(self.breaks, values=values),
            errors=errors,
        )

    def evaluate(self, face: Ints, parameters: FloatArray) -> FloatArray:
        """Points (m, 3) of faces (m,) at parameters (m, 2) of their own domains.

        Parameters are clamped to the domain, but those of planes, which have no ends.
        """
        patch, local, _ = self.locate(face, parameters)
        return self.nets.evaluate_points(patch, *local)

    def evaluate_partials(self, face: Ints, parameters: FloatArray, order: int = 1) -> FloatArray:
        """S, S_u, S_v and, if `order` is 2, S_uu, S_uv, S_vv: shape (3 or 6, m, 3).

        Partials are with respect to the parameters of the surface.
        """
        return evaluate_patches(self.nets, *self.locate(face, parameters), order)

    def locate(self, face: Ints, parameters: FloatArray) -> tuple[Ints, FloatArray, FloatArray]:
        """Patches (m,), their own parameters (2, m), and widths of spans (2, m)."""
        m = len(face)
        domain = np.concatenate([2 * face, 2 * face + 1])
        t = parameters.T.ravel()
        span = self.breaks.find_spans(domain, t)
        at = self.breaks.first[domain] + span
        low = self.breaks.values[at]
        width = self.breaks.values[at + 1] - low
        local = (t - low) / width
        free = self._is_free[domain]
        local = np.where(free, local, np.minimum(np.maximum(local, 0.0), 1.0))
        patch = self.faces.first[face] + span[:m] * self.faces.stride[face] + span[m:]
        return patch, local.reshape(2, m), width.reshape(2, m)

    @cached_property
    def _is_free(self) -> Bools:
        """For each direction of a face, (2F,), whether its parameters are not clamped."""
        return np.repeat(self.is_planar, 2)


def evaluate_patches(
    nets: PatchNets, patch: Ints, local: FloatArray, width: FloatArray, order: int
) -> FloatArray:
    """Points and partials (3 or 6, m, 3) of patches (m,) at their own parameters (2, m).

    Partials are with respect to parameters by which the patches are `width` (2, m) wide.
    """
    partials = np.empty((3 if order == 1 else 6, 3, len(patch)))
    for group, rows in nets.split_by_group(patch):
        chosen = group.nets.take(nets.row[patch[rows]], axis=0)
        found = evaluate_partials(chosen, local[0, rows], local[1, rows], order)
        if len(rows) == len(patch):
            partials = found
        else:
            partials[:, :, rows] = found
    partials[0] += nets.middles.take(patch, axis=1)
    partials[1] /= width[0]
    partials[2] /= width[1]
    if order > 1:
        partials[3] /= width[0] * width[0]
        partials[4] /= width[0] * width[1]
        partials[5] /= width[1] * width[1]
    return np.ascontiguousarray(partials.transpose(0, 2, 1))


def build_nets(
    batches: tuple[Patches, ...], name: str, errors: FloatArray
) -> tuple[PatchModel, PatchNets]:
    """The model of batches of patches, and its nets."""
    count = sum(batch.count for batch in batches)
    model = PatchModel(name, batches, (Part(name, 0, count),))
    return model, replace(PatchNets.of(model), lowering=float(errors.max(initial=0.0)))
