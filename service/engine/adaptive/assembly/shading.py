"""Channels and curvatures at samples that lie anywhere, each in its own patch."""

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein
from service.bases.chunks import chunks
from service.bases.triangle import degree_of
from service.bases.triangle_basis import triangle_bernstein
from service.engine.adaptive.assembly.samples import Samples
from service.engine.curvatures.care import Care
from service.engine.curvatures.rows import as_channels, stored, stretched
from service.engine.evaluation.scattered import by_batch
from service.engine.evaluation.triangle_nets import barycentric_places
from service.engine.mesh.channels import CHUNK_VALUES, ChannelRows, limits_of
from service.engine.scratch import Real
from service.surface.batches import TrianglePatches
from service.surface.lowered import PatchModel


def scattered_channels(
    model: PatchModel, samples: Samples, dtype: Real, *, uvs: bool
) -> tuple[ChannelRows, ...]:
    """Every channel of the model; with `uvs`, parameters where it has no texture coordinates."""
    carried = model.batches[0].channels
    found = [
        ChannelRows(channel.name, channel.kind, _rows(model, samples, number, dtype))
        for number, channel in enumerate(carried)
    ]
    if uvs and not any(channel.kind == "uvs" for channel in carried):
        found.append(ChannelRows("uvs", "uvs", _parameters(model, samples).astype(dtype)))
    return tuple(found)


def scattered_curvatures(
    model: PatchModel, samples: Samples, dtype: Real
) -> tuple[ChannelRows, ...]:
    """Gaussian and mean curvature."""
    rows = np.empty((2, len(samples.patch)), dtype=dtype)
    care = Care()
    for batch, first, here in by_batch(model.batches, samples.patch):
        index, u, v = samples.patch[here] - first, samples.u[here], samples.v[here]
        if isinstance(batch, TrianglePatches):
            u = u * (1.0 - v)
        rows[:, here] = stored(care.curvatures(stretched(batch, model.stretch), index, u, v))
    return as_channels(model, rows)


def _rows(model: PatchModel, samples: Samples, number: int, dtype: Real) -> FloatArray:
    """Values (N, d) of one channel, computed in float64."""
    values = np.empty((len(samples.patch), model.batches[0].channels[number].dimension))
    for batch, first, rows in by_batch(model.batches, samples.patch):
        nets = batch.channels[number].nets
        for part in chunks(len(rows), nets[0].size, CHUNK_VALUES):
            some = rows[part]
            own, u, v = nets[samples.patch[some] - first], samples.u[some], samples.v[some]
            if isinstance(batch, TrianglePatches):
                places = barycentric_places(u * (1.0 - v), v)
                basis = triangle_bernstein(degree_of(nets.shape[1]), places)
                values[some] = np.einsum("km,mkd->md", basis, own)
            else:
                along_u, along_v = (
                    bernstein(nets.shape[axis] - 1, t) for axis, t in ((1, u), (2, v))
                )
                lines = np.einsum("mi,mijd->mjd", along_u, own)
                values[some] = np.einsum("mj,mjd->md", along_v, lines)
    if model.batches[0].channels[number].kind == "colors":
        np.clip(values, 0.0, 1.0, out=values)
    # As for points: adding 0.0 turns -0.0 into 0.0.
    return (values + 0.0).astype(dtype)


def _parameters(model: PatchModel, samples: Samples) -> FloatArray:
    """Parameters (N, 2): in the surface's own domain, or in the patch; of triangles (s, t)."""
    rows = np.stack([samples.u, samples.v], axis=1)
    for batch, _, here in by_batch(model.batches, samples.patch):
        if isinstance(batch, TrianglePatches):
            rows[here, 0] *= 1.0 - rows[here, 1]
    if model.domains:
        for axis, limits in enumerate(limits_of(samples.patch, model.domains)):
            low, high = limits.T
            rows[:, axis] = (1.0 - rows[:, axis]) * low + rows[:, axis] * high
    return rows
