"""The parameters at which open edges must be cut, because a part of them is a shared curve."""

import numpy as np

from service.bases.polynomials import split
from service.engine.connectivity.seams import find_seams
from service.engine.joining.shared_curves import find_cuts
from service.surface.batches import TensorPatches

ARC = np.array([[0.0, 0, 0], [1, 1, 0], [2, 0, 0]])


def test_cuts_depend_on_weights() -> None:
    """An arc meets its two halves; with different weights, the halves are different curves."""
    weights = np.array([1.0, 2, 1])
    pieces = [(ARC, weights), *split((ARC, weights), 0.5)]
    rises = np.array([[0.0, 0, 1], [0, 0, -1], [0, 0, -1]])
    nets = np.stack([np.stack([p, p + by], 1) for (p, _), by in zip(pieces, rises, strict=True)])
    weight_nets = np.stack([np.stack([w, w], 1) for _, w in pieces if w is not None])
    cuts = find_cuts(find_seams((TensorPatches(nets, weight_nets),)), 1e-12)
    assert (cuts.patch.tolist(), cuts.at.tolist()) == ([0], [0.5])
    changed_weights = weight_nets * np.array([1, 1.5, 1])[:, None]
    assert not len(find_cuts(find_seams((TensorPatches(nets, changed_weights),)), 1e-12).at)
