"""How far surfaces move where places of their borders and knots are rounded.

Proof in docs/proofs.md: "Places of trimmed faces".
"""

from service.bases.arrays import FloatArray, Ints
from service.engine.trims.places import Places
from service.engine.trims.splines import Splines

UNITS = 2.5
"""Places may move by up to this number of units along both axes."""


def bound_slack(places: Places, pcurves: Splines, face: Ints) -> FloatArray:
    """Bounds σ (F,) of how far a surface moves over `UNITS` units along both axes.

    Only the spans that a border touches, or comes near, count; and all spans that are shorter than
    a unit, which have no places.

    Parameters
    ----------
    pcurves : Splines
        Parameter curves, in places.
    face : ndarray of int, shape (n,)
        The face of each parameter curve.
    """
    raise NotImplementedError
