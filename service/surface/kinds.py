"""The union of all kinds of surface.

To add a kind, write its class in a module of its own, and add it to `Surface`. Modules of the kinds
do not import this one.
"""

from typing import TypeAlias

from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.brep import BrepSurface
from service.surface.bspline import BsplineSurface
from service.surface.group import GroupSurface
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from service.surface.sweeps import RibbonSurface, TubeSurface

Surface: TypeAlias = (
    BezierSurface
    | BsplineSurface
    | TriangleSurface
    | PatchSurface
    | MultipatchSurface
    | TubeSurface
    | RibbonSurface
    | BrepSurface
    | GroupSurface
)
"""The type of all surfaces."""
