"""Patches over shared vertices, out of nets: equal control points become one vertex."""

import numpy as np

from service.bases.polynomials import Net
from service.bases.rows import distinct_rows
from service.surface.channels import NO_CHANNELS, Channels
from service.surface.convert.nets import changed
from service.surface.lowered import Up
from service.surface.patches import PartMembers, PatchSurface


def shared(
    net: Net,
    channels: Channels = NO_CHANNELS,
    parts: PartMembers = (),
    up: Up = "y",
    name: str = "surface",
) -> PatchSurface:
    """Patches over vertices in the order in which they first come.

    Control points are one vertex if they are equal in position, weight and all channels.

    Parameters
    ----------
    net : points (P, p+1, q+1, 3) and weights (P, p+1, q+1) or None
    channels : Channels
        Nets of the same degree, shapes (P, p+1, q+1, d).
    """
    points, weights = net
    count = points.size // 3
    columns = [points.reshape(count, 3)]
    columns += [] if weights is None else [weights.reshape(count, 1)]
    columns += [values.reshape(count, -1) for _, _, _, values in channels.each()]
    rows = np.concatenate(columns, axis=1) + 0.0  # −0 and 0 are one number
    first, number = distinct_rows(rows)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    chosen = first[order]
    return PatchSurface(
        vertices=points.reshape(count, 3)[chosen],
        patches=rank[number].reshape(points.shape[:-1]),
        weights=None if weights is None else weights.reshape(count)[chosen],
        parts=parts,
        up=up,
        name=name,
        channels=changed(channels, lambda values: values.reshape(count, -1)[chosen]),
    )
