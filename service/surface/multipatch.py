"""One surface of several patches and splines, as systems for isogeometric analysis write them.

Each of its surfaces keeps its degrees, knots and parameters. Where their borders are equal they
meet as the patches of one surface do.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Ints
from service.errors import InvalidRequest, Issue, pointer
from service.surface.batches import Channel, Patches
from service.surface.bezier import UNIT_SQUARE, BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.checks import Up, check_up
from service.surface.lowered import Domain, Part, PatchModel
from service.surface.sizes import NUMBER, SurfaceKind, SurfaceSize, added_sizes
from service.surface.triangle import TriangleSurface

Single: TypeAlias = BezierSurface | BsplineSurface | TriangleSurface

MAX_SURFACES = 4096
"""Each takes some tenths of a millisecond, however small it is."""


@dataclass(frozen=True, eq=False, slots=True)
class MultipatchSurface(SurfaceKind):
    """Bézier patches, B-splines and triangles that are one surface, each a part of its name.

    Attributes
    ----------
    surfaces : tuple of BezierSurface, BsplineSurface and TriangleSurface
        1 to `MAX_SURFACES`, all with the same colours, texture coordinates and attributes, if any.
        Their own vertical axis does not matter.
    up : "y" or "z"
        The model's vertical axis.
    name : str
        Name of the whole.

    Raises
    ------
    InvalidRequest
        At birth, with pointers relative to the surface.
    """

    surfaces: tuple[Single, ...]
    up: Up = "y"
    name: str = "surface"

    def __post_init__(self) -> None:
        check_up(self.up)
        if not 1 <= len(self.surfaces) <= MAX_SURFACES:
            message, got = "A multipatch has surfaces.", f"{len(self.surfaces)} surfaces"
            needed = f"1 to {MAX_SURFACES}"
            raise InvalidRequest(Issue("wrong_length", message, "/surfaces", got, needed))
        first = _carried(self.surfaces[0])
        for number, surface in enumerate(self.surfaces):
            if _carried(surface) != first:
                raise InvalidRequest(
                    Issue(
                        "channel_shape",
                        "All surfaces of a multipatch carry the same beside their points.",
                        pointer(("surfaces", number)),
                        "other colours, texture coordinates or attributes than the first",
                        "those of the first, with as many numbers each",
                    )
                )
        # Equal surfaces shall have equal content.
        alike = (s if s.up == self.up else replace(s, up=self.up) for s in self.surfaces)
        object.__setattr__(self, "surfaces", tuple(alike))

    def size(self) -> SurfaceSize:
        """All surfaces together, each lowered by itself before they are joined."""
        size = added_sizes([surface.size() for surface in self.surfaces], name=self.name)
        joined = size.control_points * (4 + size.width) * NUMBER
        return replace(size, arrays=size.arrays + joined, peak=size.peak + joined)

    def lower(self) -> PatchModel:
        """A batch for each form of patches; each surface is a part, and has its own domain."""
        models = [surface.lower() for surface in self.surfaces]
        forms: dict[tuple[object, ...], list[int]] = {}
        for number, model in enumerate(models):
            forms.setdefault(_form(model.batches[0]), []).append(number)
        counts = np.array([model.patch_count for model in models])
        order = [number for numbers in forms.values() for number in numbers]
        first = np.empty_like(counts)
        first[order] = np.cumsum(counts[order]) - counts[order]
        ends = np.cumsum(counts).tolist()
        unit = UNIT_SQUARE.u, UNIT_SQUARE.v
        domains = (
            Domain(*((d.u, d.v) if (d := model.domain) else unit), first=begin)
            for model, begin in zip(models, first.tolist(), strict=True)
        )
        nets = tuple(net for model in models for net in model.nets)
        return PatchModel(
            self.name,
            tuple(joined([models[n].batches[0] for n in numbers]) for numbers in forms.values()),
            tuple(
                Part(surface.name, end - count, end)
                for surface, count, end in zip(self.surfaces, counts.tolist(), ends, strict=True)
            ),
            self.up,
            tuple(domains),
            sequence=_listed(first, counts) if len(forms) > 1 else None,
            control_nets=nets if any(model.control_nets for model in models) else (),
            merged_knots=sum(model.merged_knots for model in models),
        )


def _carried(surface: Single) -> list[tuple[str, int]]:
    """Names and dimensions of the channels of a surface."""
    return [(name, net.shape[-1]) for name, _, _, net in surface.channels.each()]


def _form(batch: Patches) -> tuple[object, ...]:
    """What patches of one batch have in common."""
    nets = tuple(channel.nets.shape[1:] for channel in batch.channels)
    return type(batch), batch.degree, batch.weights is None, nets


def joined(batches: Sequence[Patches]) -> Patches:
    """Batches of one form as one."""
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


def _listed(first: Ints, counts: Ints) -> Ints:
    """Numbers of the patches, those of one surface after those of another."""
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.asarray(np.repeat(first, counts) + within)
