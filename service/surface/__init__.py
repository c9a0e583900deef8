"""Kinds of surface: frozen values, checked when created, and their lowering to Bézier patches."""

from typing import TypeAlias

from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.group import GroupSurface
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from service.surface.sweeps import RibbonSurface, TubeSurface
from service.surface.triangle import TriangleSurface

Surface: TypeAlias = (
    BezierSurface
    | BsplineSurface
    | TriangleSurface
    | PatchSurface
    | MultipatchSurface
    | TubeSurface
    | RibbonSurface
    | GroupSurface
)
"""The type of all surfaces."""
