"""A multipatch: one surface of several patches and splines, as isogeometric analysis uses them.

Each surface keeps its own degrees, knots and parameters. Where two surfaces have equal borders,
they are joined like the patches of one surface. The module also makes models of other patches: it
joins batches, and replaces patches of a model by pieces of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Ints
from service.bases.row_batches import expand_runs
from service.errors import InvalidRequest, Issue, count_nouns, pointer
from service.surface.batches import Channel, Patches
from service.surface.bezier import UNIT_SQUARE, BezierSurface, TriangleSurface
from service.surface.bspline import BsplineSurface
from service.surface.checks import Up, check_up
from service.surface.lowered import Domain, Part, PatchModel
from service.surface.placement import Box, join_boxes
from service.surface.sizes import NUMBER, SurfaceKind, SurfaceSize, add_sizes

Single: TypeAlias = BezierSurface | BsplineSurface | TriangleSurface
"""One surface of a multipatch."""

MAX_SURFACES = 4096
"""The most surfaces of a multipatch: meshing even a small one takes about 0.2 ms."""


@dataclass(frozen=True, eq=False, slots=True)
class MultipatchSurface(SurfaceKind):
    """Bézier patches, B-splines and triangles that form one surface; each is a part, with its name.

    Attributes
    ----------
    surfaces : tuple of BezierSurface, BsplineSurface and TriangleSurface
        1 to `MAX_SURFACES`, all with the same colours, texture coordinates and attributes, if any.
        Their own vertical axes are ignored.
    up : "y" or "z"
        The model's vertical axis.
    name : str
        Name of the surface.

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the surface.
    """

    surfaces: tuple[Single, ...]
    up: Up = "y"
    name: str = "surface"

    def __post_init__(self) -> None:
        check_up(self.up)
        if not 1 <= len(self.surfaces) <= MAX_SURFACES:
            raise InvalidRequest(
                Issue(
                    "wrong_length",
                    "A multipatch has surfaces.",
                    "/surfaces",
                    count_nouns(len(self.surfaces), "surfaces"),
                    f"1 to {MAX_SURFACES}",
                )
            )
        first_channels = _describe_channels(self.surfaces[0])
        for number, surface in enumerate(self.surfaces):
            if _describe_channels(surface) != first_channels:
                raise InvalidRequest(
                    Issue(
                        "channel_shape",
                        "All surfaces of a multipatch must have the same channels.",
                        pointer(("surfaces", number)),
                        "channels that differ from those of the first surface",
                        "the channels of the first surface, with the same numbers of values",
                    )
                )
        # The vertical axes of the surfaces have no effect. All become the same, so that equal
        # multipatches have equal bytes, hence equal hashes.
        upright = (s if s.up == self.up else replace(s, up=self.up) for s in self.surfaces)
        object.__setattr__(self, "surfaces", tuple(upright))

    def size(self) -> SurfaceSize:
        """The size of all surfaces together; each is lowered before they are joined."""
        size = add_sizes([surface.size() for surface in self.surfaces], name=self.name)
        joined_bytes = size.control_points * (4 + size.width) * NUMBER
        return replace(
            size,
            lowered_bytes=size.lowered_bytes + joined_bytes,
            peak_bytes=size.peak_bytes + joined_bytes,
        )

    def bounds(self) -> Box:
        """Least and greatest coordinates of the control points of all surfaces."""
        return join_boxes(surface.bounds() for surface in self.surfaces)

    def lower(self) -> PatchModel:
        """A batch for all patches that have one `_form`; each surface is a part with its domain."""
        models = [surface.lower() for surface in self.surfaces]
        forms: dict[tuple[object, ...], list[int]] = {}
        for number, model in enumerate(models):
            forms.setdefault(_form(model.batches[0]), []).append(number)
        counts = np.array([model.patch_count for model in models])
        # Patches are numbered form after form, so surfaces have their patches in this order.
        order = [number for numbers in forms.values() for number in numbers]
        first_patches = np.empty_like(counts)
        first_patches[order] = np.cumsum(counts[order]) - counts[order]
        ends = np.cumsum(counts).tolist()
        domains = (
            replace(model.domain or UNIT_SQUARE, first=first_patch)  # a triangle has no domain
            for model, first_patch in zip(models, first_patches.tolist(), strict=True)
        )
        nets = tuple(net for model in models for net in model.nets)
        return PatchModel(
            self.name,
            tuple(
                join_batches([models[n].batches[0] for n in numbers]) for numbers in forms.values()
            ),
            tuple(
                Part(surface.name, end - count, end)
                for surface, count, end in zip(self.surfaces, counts.tolist(), ends, strict=True)
            ),
            self.up,
            tuple(domains),
            sequence=expand_runs(counts, first_patches)[1] if len(forms) > 1 else None,
            control_nets=nets if any(model.control_nets for model in models) else (),
            merged_knots=sum(model.merged_knots for model in models),
        )


def _describe_channels(surface: Single) -> list[tuple[str, int]]:
    """Names and dimensions of the channels of a surface."""
    return [(name, net.shape[-1]) for name, _, _, net in surface.channels.each()]


def _form(batch: Patches) -> tuple[object, ...]:
    """A key that is equal for two batches if they can be joined to one.

    That is: tensor-product or triangular, the degree, rational or not, and the shapes of the nets
    of channels.
    """
    nets = tuple(channel.nets.shape[1:] for channel in batch.channels)
    return type(batch), batch.degree, batch.weights is None, nets


def join_batches(batches: Sequence[Patches]) -> Patches:
    """Join batches of one form and degree, all rational or all polynomial, to one batch."""
    first = batches[0]
    if len(batches) == 1:
        return first
    weights = [batch.weights for batch in batches if batch.weights is not None]
    channels = tuple(
        Channel(c.name, c.kind, np.concatenate([batch.channels[k].nets for batch in batches]))
        for k, c in enumerate(first.channels)
    )
    points = np.concatenate([batch.points for batch in batches])
    return replace(
        first,
        points=points,
        weights=np.concatenate(weights) if weights else None,
        channels=channels,
    )


def surfaces_of(model: PatchModel) -> tuple[Domain, ...]:
    """The domains of the parametric surfaces of a model, in the order of their patches.

    If the model has no domains, each patch is such a surface, over [0, 1]².
    """
    domains = model.domains or tuple(
        replace(UNIT_SQUARE, first=k) for k in range(model.patch_count)
    )
    return tuple(sorted(domains, key=lambda domain: domain.first))


def order_as_before(model: PatchModel, domains: Sequence[Domain]) -> tuple[Domain, ...]:
    """New domains of the surfaces of a model, in the order of the request.

    The domains are in the order of `surfaces_of(model)`. A model without domains has the order of
    its patches.
    """
    if not model.domains:
        return tuple(domains)
    order = np.argsort([domain.first for domain in model.domains])
    return tuple(domains[k] for k in np.argsort(order).tolist())


def rebuild(
    model: PatchModel, pieces: list[list[Patches]], owner: Ints, domains: tuple[Domain, ...]
) -> PatchModel:
    """A model whose patches are replaced by pieces of them.

    Parameters
    ----------
    model : PatchModel
    pieces : list of list of TensorPatches or TrianglePatches
        The new patches; each inner list becomes one batch.
    owner : ndarray of int, shape (P',)
        New patch k, counted through all of `pieces`, is a piece of patch `owner[k]` of `model`, or
        the whole patch. If `model.sequence` is None, the new patches must be in the order of the
        parts.
    domains : tuple of Domain
        The domains of the new model.
    """
    batches = tuple(join_batches(group) for group in pieces if group)
    part_order = np.arange(model.patch_count) if model.sequence is None else model.sequence
    position = np.empty(model.patch_count, dtype=np.intp)
    position[part_order] = np.arange(model.patch_count)
    owner_positions = position[owner]
    # offsets[k]: how many new patches come from the first k old patches in the order of the parts.
    offsets = np.concatenate(
        [[0], np.cumsum(np.bincount(owner_positions, minlength=model.patch_count))]
    )
    parts = tuple(Part(p.name, int(offsets[p.first]), int(offsets[p.last])) for p in model.parts)
    sequence = None if model.sequence is None else np.argsort(owner_positions, kind="stable")
    return replace(
        model,
        batches=batches,
        parts=parts,
        domains=domains,
        request_numbers=None,
        sequence=sequence,
        control_nets=model.nets,
    )
