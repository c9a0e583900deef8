"""The waist of the house: every kind of surface lowers to batches of Bézier patches.

What stands above (kinds of surface) and below (engine, encoders) meets only here, in the batches
(`service.surface.batches`) and, for what is swept, in `service.surface.sweep_model`.
"""

from dataclasses import dataclass
from math import dist
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray
from service.surface.batches import Patches
from service.surface.checks import Up
from service.surface.placement import placed_bounds
from service.surface.sweep_model import SweepModel


@dataclass(frozen=True, slots=True)
class Part:
    """A named run of patches, [first, last) in the numbering across all batches of a model.

    Or in the `sequence` of the model, if it has one.
    """

    name: str
    first: int
    last: int


@dataclass(frozen=True, eq=False, slots=True)
class Domain:
    """The rectangle of parameters that the patches of a surface divide among themselves.

    Patch (k, l) covers [u_k, u_{k+1}] × [v_l, v_{l+1}] and has number `first` + k M_v + l.

    Attributes
    ----------
    u, v : ndarray of float64, shapes (M_u+1,) and (M_v+1,)
        Strictly increasing: the distinct knots of a B-spline's domain, (0, 1) for one patch.
    first : int
        Number of the first patch in the model.
    """

    u: FloatArray
    v: FloatArray
    first: int = 0

    @property
    def patch_count(self) -> int:
        """Number of its patches."""
        return (len(self.u) - 1) * (len(self.v) - 1)


@dataclass(frozen=True, eq=False, slots=True)
class PatchModel:
    """A surface lowered to Bézier patches: all that the engine and the encoders need to know.

    The parts cover the patches without gap or overlap, in order; if there is a `sequence`, in that
    order, which lists the patches by number. A surface without parts of its own is one part of the
    surface's name. `up` is the model's vertical axis. `domains` are those of the parametric
    surfaces of which the patches are pieces, in the order in which the request lists these. Without
    them the parameters of every patch are its own, in [0, 1], and patch k was number `order[k]` of
    those that the request lists, k itself where `order` is None. `control_nets` are those that were
    given, where they are others than the patches have. `stretch`, affine, float64 of shape (4, 4),
    is what its place does to it up to a turn: curvatures are those of the stretched surface.
    `merged_knots` differed from the knot before by rounding alone, and were taken for equal.
    No patch is further than `moved`, in model units, from the one that was given.
    """

    name: str
    batches: tuple[Patches, ...]
    parts: tuple[Part, ...]
    up: Up = "y"
    domains: tuple[Domain, ...] = ()
    order: NDArray[np.intp] | None = None
    sequence: NDArray[np.intp] | None = None
    control_nets: tuple[Patches, ...] = ()
    stretch: FloatArray | None = None
    merged_knots: int = 0
    moved: float = 0.0

    @property
    def nets(self) -> tuple[Patches, ...]:
        """The control nets that were given: those of the patches, or others."""
        return self.control_nets or self.batches

    @property
    def domain(self) -> Domain | None:
        """The domain of the surface, if all patches are pieces of one parametric surface."""
        return self.domains[0] if len(self.domains) == 1 else None

    @property
    def patch_count(self) -> int:
        """Number of patches in all batches."""
        return sum(batch.count for batch in self.batches)

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest coordinates of the control points: they enclose the surface."""
        if len(self.batches) == 1:
            return self.batches[0].bounds
        lows, highs = zip(*(batch.bounds for batch in self.batches), strict=True)
        return np.min(lows, axis=0), np.max(highs, axis=0)

    @property
    def diagonal(self) -> float:
        """Diagonal of the box about the control points."""
        if len(self.batches) == 1:
            return self.batches[0].diagonal
        return dist(*(bound.tolist() for bound in self.bounds))


Color: TypeAlias = tuple[float, float, float, float]
"""Red, green, blue and opacity, sRGB, 0 … 1."""


@dataclass(frozen=True, eq=False, slots=True)
class PlacedModel:
    """One copy of a model, at a place of its own.

    `model` is its number in `GroupModel.models`. `matrix` is affine, float64 of shape (4, 4), and
    acts on columns (x, y, z, 1); None leaves the model where it is. `color` is what white becomes.
    """

    name: str
    model: int
    color: Color | None = None
    matrix: FloatArray | None = None


@dataclass(frozen=True, eq=False, slots=True)
class GroupModel:
    """Placed copies of models: what a group of surfaces lowers to.

    The models are different from one another; all matrices turn them to the group's own `up`.
    """

    name: str
    models: tuple[PatchModel | SweepModel, ...]
    members: tuple[PlacedModel, ...]
    up: Up = "y"

    @property
    def patch_count(self) -> int:
        """Number of patches of all copies."""
        return sum(self.models[member.model].patch_count for member in self.members)

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest coordinates of the control points of all copies."""
        boxes = [placed_bounds(self.models[m.model].bounds, m.matrix) for m in self.members]
        lows, highs = zip(*boxes, strict=True)
        return np.min(lows, axis=0), np.max(highs, axis=0)

    @property
    def diagonal(self) -> float:
        """Diagonal of the box about the control points of all copies."""
        return dist(*(bound.tolist() for bound in self.bounds))


Model: TypeAlias = PatchModel | SweepModel | GroupModel
"""What a surface lowers to."""
