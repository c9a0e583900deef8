"""Lowered models: what every kind of surface becomes before it is computed.

A model is batches of Bézier patches (`service.surface.batches`), a sweep
(`service.surface.curve_model`), a brep (`service.surface.brep_model`), or a group of these. The
engine and the encoders use only models, and not the kinds of surface.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import dist
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.surface.batches import Patches
from service.surface.brep_model import BrepModel
from service.surface.checks import Up
from service.surface.curve_model import SweepModel
from service.surface.placement import Box, join_boxes, place_boxes


@dataclass(frozen=True, slots=True)
class Part:
    """A named range of patches, [first, last).

    `first` and `last` count patches in the order of the parts: `PatchModel.sequence` has the patch
    numbers in this order. If it is None, they are the patch numbers themselves.
    """

    name: str
    first: int
    last: int


@dataclass(frozen=True, eq=False, slots=True)
class SplineNet:
    """The control net of a B-spline surface as its definition has it.

    Attributes
    ----------
    degree : (int, int)
    knots : tuple of two ndarrays of float64
        Full knot vectors, not always clamped; in a periodic direction they fit the control points
        after the first p of them are repeated.
    points : ndarray of float64, shape (n, m, 3)
    weights : ndarray of float64, shape (n, m), or None
    is_periodic : (bool, bool)
        Along which directions the first p control points are to be repeated.
    """

    degree: tuple[int, int]
    knots: tuple[FloatArray, FloatArray]
    points: FloatArray
    weights: FloatArray | None
    is_periodic: tuple[bool, bool]


@dataclass(frozen=True, eq=False, slots=True)
class Domain:
    """The rectangle of parameters of a surface, divided into one rectangle for each of its patches.

    Patch (k, l) covers [u_k, u_{k+1}] × [v_l, v_{l+1}] and has number `first` + k M_v + l.

    Attributes
    ----------
    u, v : ndarray of float64, shapes (M_u+1,) and (M_v+1,)
        Strictly increasing: the distinct knots of a B-spline's domain, (0, 1) for one patch.
    first : int
        Number of the first patch in the model.
    net : SplineNet or None
        The B-spline of which the patches are the spans, if the surface is one.
    """

    u: FloatArray
    v: FloatArray
    first: int = 0
    net: SplineNet | None = None

    @property
    def patch_count(self) -> int:
        """Number of its patches."""
        return (len(self.u) - 1) * (len(self.v) - 1)


@dataclass(frozen=True, eq=False, slots=True)
class PatchModel:
    """A surface lowered to Bézier patches, for the engine and the encoders.

    Attributes
    ----------
    name : str
    batches : tuple of TensorPatches and TrianglePatches
        Patch numbers continue from one batch to the next.
    parts : tuple of Part
        Named ranges that cover all patches in order, without gap or overlap. A surface without
        parts is one part with the surface's name.
    up : "y" or "z"
        The model's vertical axis.
    domains : tuple of Domain
        If the patches are pieces of parametric surfaces, the domains of these surfaces, in the
        order of the request. If there are no domains, every patch has its own parameters in [0, 1].
    request_numbers : ndarray of int, shape (P,), or None
        For models without domains: the number of each patch in the request. None if each patch has
        the same number there.
    sequence : ndarray of int, shape (P,), or None
        Patch numbers in the order of the parts; None stands for 0, 1, 2, ….
    control_nets : tuple of TensorPatches and TrianglePatches
        The control nets of the request; empty if they are the nets of the patches.
    stretch : ndarray of float64, shape (4, 4), or None
        For copies in a group: their placement without its translation and rotation. Curvatures are
        those of the surface after this matrix.
    merged_knots : int
        Number of knots that differed from the knot before by rounding alone and were made equal.
    moved : float
        The largest distance by which a point of a patch was moved, so that borders could be joined.
        Model units.
    """

    name: str
    batches: tuple[Patches, ...]
    parts: tuple[Part, ...]
    up: Up = "y"
    domains: tuple[Domain, ...] = ()
    request_numbers: Ints | None = None
    sequence: Ints | None = None
    control_nets: tuple[Patches, ...] = ()
    stretch: FloatArray | None = None
    merged_knots: int = 0
    moved: float = 0.0

    @property
    def nets(self) -> tuple[Patches, ...]:
        """The control nets of the request: `control_nets`, or the nets of the patches."""
        return self.control_nets or self.batches

    @property
    def domain(self) -> Domain | None:
        """The only domain if all patches are pieces of one parametric surface, else None."""
        return self.domains[0] if len(self.domains) == 1 else None

    @property
    def patch_count(self) -> int:
        """Number of patches in all batches."""
        return sum(batch.count for batch in self.batches)

    @property
    def part_numbers(self) -> Ints:
        """The number of the part of each patch, (P,)."""
        numbers = np.repeat(np.arange(len(self.parts)), [p.last - p.first for p in self.parts])
        if self.sequence is not None:
            numbers[self.sequence] = numbers.copy()
        return numbers

    @property
    def bounds(self) -> Box:
        """Least and greatest coordinates of the control points: a box that contains the surface."""
        if len(self.batches) == 1:
            return self.batches[0].bounds
        return join_boxes(batch.bounds for batch in self.batches)

    @property
    def diagonal(self) -> float:
        """Diagonal of the box about the control points."""
        if len(self.batches) == 1:
            return self.batches[0].diagonal
        return dist(*(bound.tolist() for bound in self.bounds))

    @property
    def largest_patch(self) -> float:
        """The largest diagonal of the boxes about the nets of single patches."""
        largest = 0.0
        for batch in self.batches:
            extents = np.ptp(batch.points.reshape(batch.count, -1, 3), axis=1)
            largest = max(largest, float(np.sqrt(np.square(extents).sum(axis=1).max())))
        return largest


Color: TypeAlias = tuple[float, float, float, float]
"""Red, green, blue and opacity, sRGB, 0 … 1."""


Chain: TypeAlias = tuple[int, float, float]
"""The number of placements of which one is the product, and upper bounds of the product of their
scalings and of the distance by which they move the origin (`service.surface.frames`)."""


@dataclass(frozen=True, eq=False, slots=True)
class PlacedModel:
    """One placed copy of a model of a group.

    Attributes
    ----------
    name : str
        Name of the member, after those of its parents: "machine/bolt".
    model : int
        The number of the model in `GroupModel.models`.
    color : tuple of four floats, or None
        The colours of the model are multiplied by this colour.
    matrix : ndarray of float64, shape (4, 4), or None
        Affine placement, which acts on columns (x, y, z, 1). None stands for the identity.
    chain : Chain or None
        If the matrix is a product of several.
    """

    name: str
    model: int
    color: Color | None = None
    matrix: FloatArray | None = None
    chain: Chain | None = None


@dataclass(frozen=True, eq=False, slots=True)
class GroupNode:
    """A node of the tree of a group.

    Attributes
    ----------
    name : str
    parent : int or None
        The number of an earlier node; None for the root.
    matrix : ndarray of float64, shape (4, 4), or None
        Placement in the frame of the parent. None stands for the identity.
    copy : int or None
        The number in `GroupModel.members` of the copy in the frame of the node, if there is one.
    """

    name: str
    parent: int | None = None
    matrix: FloatArray | None = None
    copy: int | None = None


@dataclass(frozen=True, eq=False, slots=True)
class GroupModel:
    """A lowered group: placed copies of distinct models.

    The matrices of the copies include the turn from a model's vertical axis to the group's axis
    `up`.

    Attributes
    ----------
    name : str
    models : tuple of PatchModel, SweepModel and BrepModel
    members : tuple of PlacedModel
        The copies, in the order of the request; members without a surface are not among them.
    up : "y" or "z"
    nodes : tuple of GroupNode
        The tree of the members; none if each copy is a node below the root.
    numbers : tuple of int
        For each copy the number of its member in the request; empty for 0, 1, 2, ….
    definitions : tuple of (int or None)
        For each copy the number of its surface, if the request has it among its definitions.
    """

    name: str
    models: tuple["SingleModel", ...]
    members: tuple[PlacedModel, ...]
    up: Up = "y"
    nodes: tuple[GroupNode, ...] = ()
    numbers: tuple[int, ...] = ()
    definitions: tuple[int | None, ...] = ()

    @property
    def patch_count(self) -> int:
        """Number of patches of all copies."""
        counts = [model.patch_count for model in self.models]
        return sum(counts[member.model] for member in self.members)

    @property
    def has_breps(self) -> bool:
        """Whether a member is a brep."""
        return any(isinstance(model, BrepModel) for model in self.models)

    @property
    def bounds(self) -> Box:
        """Least and greatest coordinates of the control points of all copies."""
        lows, highs = place_copies(self.members, [model.bounds for model in self.models])
        return lows.min(axis=0), highs.max(axis=0)

    @property
    def diagonal(self) -> float:
        """Diagonal of the box about the control points of all copies."""
        return dist(*(bound.tolist() for bound in self.bounds))

    def locate(self, model: int) -> str:
        """The JSON pointer, in the group, of the surface with this number in `models`."""
        copy = next(k for k, each in enumerate(self.members) if each.model == model)
        definition = self.definitions[copy] if self.definitions else None
        if definition is not None:
            return f"/definitions/{definition}"
        return f"/members/{self.find_number(copy)}/surface"

    def find_number(self, copy: int) -> int:
        """The number of the member of a copy in the request."""
        return self.numbers[copy] if self.numbers else copy


def place_copies(copies: Sequence[PlacedModel], boxes: Sequence[Box]) -> Box:
    """The boxes of N copies, (N, 3) each, from the boxes of the models."""
    lows, highs = (np.array(ends) for ends in zip(*boxes, strict=True))
    numbers = np.array([copy.model for copy in copies])
    placed = [k for k, copy in enumerate(copies) if copy.matrix is not None]
    lows, highs = lows[numbers], highs[numbers]
    if placed:
        matrices = np.array([copies[k].matrix for k in placed])
        lows[placed], highs[placed] = place_boxes(lows[placed], highs[placed], matrices)
    return lows, highs


SingleModel: TypeAlias = PatchModel | SweepModel | BrepModel
"""A lowered surface of any kind but a group."""

Model: TypeAlias = SingleModel | GroupModel
"""A lowered surface."""
