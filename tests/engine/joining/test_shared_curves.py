"""Where open edges must be cut: parameters along curves that they share."""

import numpy as np

from service.bases.polynomials import split
from service.engine.joining.shared_curves import find_cuts
from service.engine.mesh.seams import find_seams
from service.surface.batches import TensorPatches

ARC = np.array([[0.0, 0, 0], [1, 1, 0], [2, 0, 0]])


def test_cuts_depend_on_weights() -> None:
    """An arc above its two halves: with other weights the halves are other curves."""
    weights = np.array([1.0, 2, 1])
    pieces = [(ARC, weights), *split((ARC, weights), 0.5)]
    rises = np.array([[0.0, 0, 1], [0, 0, -1], [0, 0, -1]])
    nets = np.stack([np.stack([p, p + by], 1) for (p, _), by in zip(pieces, rises, strict=True)])
    loads = np.stack([np.stack([w, w], 1) for _, w in pieces if w is not None])
    shared = find_cuts(find_seams((TensorPatches(nets, loads),)), 1e-12)
    assert (shared.patch.tolist(), shared.at.tolist()) == ([0], [0.5])
    heavier = loads * np.array([1, 1.5, 1])[:, None]
    assert not len(find_cuts(find_seams((TensorPatches(nets, heavier),)), 1e-12).at)
