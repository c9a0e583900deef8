"""Counts, volumes and areas of a shape by Open CASCADE.

Only a Python in which cadquery-ocp is installed can import this module.
"""

from typing import Any

from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer

ACCURACY = 1e-10
"""The accuracy of integrals. Without it, those over splines are wrong by up to 1 %."""


def find(shape: Any, kind: Any) -> list[Any]:
    """All parts of a shape of one kind; a part that is used twice counts twice."""
    explorer = TopExp_Explorer(shape, kind)
    parts = []
    while explorer.More():
        parts.append(explorer.Current())
        explorer.Next()
    return parts


def volume(shape: Any) -> float:
    """The volume of a solid, by the rule of Gauss and Kronrod.

    The library's other rule is wrong by up to 2e-7 over rational splines, whatever it is asked for.
    """
    properties = GProp_GProps()
    BRepGProp.VolumePropertiesGK_s(shape, properties, ACCURACY, False, True, False, False, False)
    return float(properties.Mass())


def area(shape: Any) -> float:
    """The area of all faces."""
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, properties, ACCURACY, False)
    return float(properties.Mass())


def measure(shape: Any) -> dict[str, Any]:
    """Counts and measures of a shape, in its own unit."""
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    corners = None
    if not box.IsVoid():
        low, high = box.CornerMin(), box.CornerMax()
        corners = [[low.X(), low.Y(), low.Z()], [high.X(), high.Y(), high.Z()]]
    solids = find(shape, TopAbs_SOLID)
    return {
        "faces": len(find(shape, TopAbs_FACE)),
        "shells": len(find(shape, TopAbs_SHELL)),
        "solids": len(solids),
        "volumes": [volume(solid) for solid in solids],
        "area": area(shape),
        "box": corners,
        "is_valid": bool(BRepCheck_Analyzer(shape).IsValid()),
    }
