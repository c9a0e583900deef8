"""The box of a part: it depends on its faces, not on the surfaces that carry them."""

from service.bases.arrays import FloatArray, Ints
from service.engine.trims.places import Places
from service.surface.placement import Box


def find_part_box(places: Places, faces: Ints, *points: FloatArray) -> Box:
    """The box about points, (…, 3) each, and faces.

    A face counts with the nets of its surface restricted to the box of its parameter curves.
    """
    raise NotImplementedError
